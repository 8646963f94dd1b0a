"""What the page of a running study shows, as one mapping."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from calibration.figures import response_of
from calibration.runs.plans import read_plan
from calibration.runs.progress import REPEAT, progress
from calibration.runs.store import RunStore
from dem.errors import ResultError
from dem.results import is_current

if TYPE_CHECKING:
    from calibration.chain.study import Study


LAST_LINES = 6  # of a failed run's log: the reason, the likely cause and the points


class State:
    """The study's progress, heaps and failures; what has been read of a finished run is kept."""

    def __init__(self, study: Study, cores: int) -> None:
        self.study, self.cores = study, cores
        self._store, self._values = RunStore(study.config.runs), {}  # type: ignore[var-annotated]
        self._response = response_of(study.config.target.metric)

    def mapping(self) -> dict[str, Any]:
        """{name, sentence, plans: [{words, done, total}], heaps: [{run, text}], failures: [{run,
        cause}], report}. Heaps stand in the order of the plans."""
        found = progress(self.study.config, self._store)
        return {
            "name": self.study.name,
            "sentence": found.sentence(self.cores),
            "plans": [{"words": p.words, "done": p.done, "total": p.total} for p in found.plans],
            "heaps": self._heaps(found),
            "failures": [{"run": name, "cause": self._cause(name)} for name in found.failed],
            "report": (self.study.folder / "report.html").is_file(),
        }

    def _heaps(self, found):
        names = [n for plan in found.plans for n in self.plan(plan.name) if n.startswith("heap-")]
        shown = [(n, value) for n in dict.fromkeys(names) if (value := self._value(n))]
        return [{"run": name, "text": value} for name, value in shown]

    def plan(self, name: str) -> list[str]:
        """Names of the runs of a plan."""
        return list(read_plan(self.study.folder / name / "plan.json"))

    def planned(self, run: str) -> bool:
        """Whether a run is of this study."""
        plans = (p.name for p in progress(self.study.config, self._store).plans)
        return any(run in self.plan(name) for name in plans)

    def _value(self, run):
        """Words for a finished run's response, empty for one that is not finished."""
        if run not in self._values:
            entry = self._store.known(run)
            if not entry or not is_current(entry["engine"]):
                return ""
            try:
                y = self._store.result(run)["metrics"].get(self.study.config.target.metric)
            except ResultError:
                return ""
            self._values[run] = "counts for nothing" if y is None else self._response.value(y)
        return self._values[run]

    def _cause(self, run):
        """Why a run failed, as it was told."""
        kept = self._store.failure(run)
        if kept:
            return str(kept.get("error", ""))
        log = self._store.folder(run) / "run.log"
        if not log.is_file():
            return f"see {self._store.folder(run) / REPEAT}"
        lines = log.read_text("utf-8", errors="replace").splitlines()
        told = next((i for i, line in enumerate(lines) if line.startswith(f"run {run}")), 0)
        return "\n".join(lines[told : told + LAST_LINES])
