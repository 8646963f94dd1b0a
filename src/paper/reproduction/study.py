"""What a study's stages have left in its folder."""

import json
from pathlib import Path

from calibration.tables import read_written


class Study:
    """The files of results/<name>; a stage that has not run gives None."""

    def __init__(self, folder):
        self.folder = Path(folder)
        self.name = self.folder.name

    def summary(self, stage, name=None):
        """Summary of a stage as a mapping, or None."""
        path = self.folder / stage / f"{name or stage}.json"
        return json.loads(path.read_text()) if path.is_file() else None

    def table(self, stage, name):
        """Table `name`.csv of a stage, or None."""
        path = self.folder / stage / f"{name}.csv"
        return read_written(path) if path.is_file() else None

    def seed_spread(self):
        """(sd, n) of the angle between seeds at one point: validation, else the response surface's
        centre; or None."""
        validation = self.summary("validation")
        if validation:
            return validation["simulated_sd"], validation["simulated_n"]
        runs, region = self.table("response_surface", "runs"), self.region_names()
        if runs is None or region is None:
            return None
        codes = [f["code"] for f in self.summary("response_surface", "region")]
        centre = runs.loc[(runs[codes].abs() < 1e-9).all(axis=1), "response"]
        return (float(centre.std(ddof=1)), len(centre)) if len(centre) > 1 else None

    def region_names(self):
        """Names of the response surface's factors in its order, or None."""
        region = self.summary("response_surface", "region")
        return [f["name"] for f in region] if region else None
