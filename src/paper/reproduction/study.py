"""What a study's stages have left in its folder."""

from typing import Any

import pandas as pd

from calibration.chain.study import Results
from paper.reproduction.rows import Place


class Study(Results):
    """The results of a study, and what the paper's tables ask of them.

    repeats: the same study at other seeds, whose runs count beside its own where they are of the
    same design."""

    repeats: tuple["Study", ...] = ()

    def place(
        self, item: str, ident: str, quantity: str, unit: str = "1", headline: bool = False
    ) -> Place:
        """Return what a row about this study is about, see `Place`."""
        return Place(item, ident, quantity, unit, self.name, headline)

    def region_runs(self) -> pd.DataFrame | None:
        """Runs of the response surface's design, those of `repeats` in the same region too, each
        repeat of the design with a number of its own (`replicate`); None without."""
        tables = []  # type: ignore[var-annotated]
        for study in (self, *self.repeats):
            runs = study.table("response_surface", "runs")
            if runs is not None and study.region == self.region and (tables or study is self):
                last = tables[-1]["replicate"].max() if tables else 0
                tables.append(runs.assign(replicate=runs.get("replicate", 1) + last))
        return pd.concat(tables, ignore_index=True) if tables else None

    @property
    def region(self) -> list[dict[str, Any]] | None:
        """The response surface's factors in its order, or None."""
        return self.summary("response_surface", "region")

    def seed_spread(self) -> tuple[float, int] | None:
        """(sd, n) of the angle between seeds at one point: validation, else the response surface's
        centre; or None."""
        validation = self.summary("validation")
        if validation:
            return validation["simulated_sd"], validation["simulated_n"]
        runs = self.table("response_surface", "runs")
        if runs is None or self.region is None:
            return None
        codes = [f["code"] for f in self.region]
        centre = runs.loc[(runs[codes].abs() < 1e-9).all(axis=1), "response"].dropna()
        return (float(centre.std(ddof=1)), len(centre)) if len(centre) > 1 else None
