"""What a study's stages have left in its folder."""

import pandas as pd

from calibration.chain.study import Results


class Study(Results):
    """The results of a study, and what the paper's tables ask of them.

    repeats: the same study at other seeds, whose runs count beside its own where they are of the
    same design."""

    repeats: tuple["Study", ...] = ()

    def region_runs(self) -> pd.DataFrame | None:
        """Runs of the response surface's design, those of `repeats` in the same region too, each
        repeat of the design with a number of its own (`replicate`); None without."""
        own, region = self.table("response_surface", "runs"), self._region()
        if own is None:
            return None
        tables = [own.assign(replicate=own.get("replicate", 1))]
        for other in self.repeats:
            runs = other.table("response_surface", "runs")
            if runs is not None and other._region() == region:
                last = tables[-1]["replicate"].max()
                tables.append(runs.assign(replicate=runs.get("replicate", 1) + last))
        return pd.concat(tables, ignore_index=True)

    def _region(self):
        return self.summary("response_surface", "region")

    def seed_spread(self) -> tuple[float, int] | None:
        """(sd, n) of the angle between seeds at one point: validation, else the response surface's
        centre; or None."""
        validation = self.summary("validation")
        if validation:
            return validation["simulated_sd"], validation["simulated_n"]
        runs, region = self.table("response_surface", "runs"), self.region_names()
        if runs is None or region is None:
            return None
        codes = [f["code"] for f in self.summary("response_surface", "region")]
        centre = runs.loc[(runs[codes].abs() < 1e-9).all(axis=1), "response"].dropna()
        return (float(centre.std(ddof=1)), len(centre)) if len(centre) > 1 else None

    def region_names(self) -> list[str] | None:
        """Names of the response surface's factors in its order, or None."""
        region = self.summary("response_surface", "region")
        return [f["name"] for f in region] if region else None
