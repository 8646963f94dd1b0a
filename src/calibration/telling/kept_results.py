"""What a study says before any run (what was read, what is valid but risky) and at its end; and
the results of a finished one kept, with what they found said on a page.

python -m calibration.telling.kept_results STUDY KEPT PAGE METRIC, for instance results/soybean
results/reference/soybean examples/soybean/README.md angle_of_repose_deg
"""

import re
import shutil
import sys
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from calibration.chain.responses import without_value
from calibration.chain.study import Results, Study
from calibration.errors import CalibrationError
from calibration.figures import Response, response_of
from calibration.runs.verify import FOLDER
from calibration.study.config import Config, point_spec, read_back
from calibration.study.factors import read_factors
from calibration.study.stage import Stage, load_stages
from calibration.telling.answer.schema import answer_of
from dem.spec import parse_spec


def opening(config: Config) -> list[str]:
    """Sentences: the measured values of each target as they were read, then the engine's warnings.

    Raises ConfigError for a table that cannot be read.
    """
    factors = read_factors(config.factors)
    warnings = [*_narrow(factors), *_warnings(config, factors)]
    return [f"read {text}" for text in read_back(config)] + [f"warning: {x}" for x in warnings]


NARROW = 0.05
"""Of its larger end: a range below it moves a response by less than runs scatter."""


def _narrow(factors):
    """Sentences on factors whose ranges hold hardly more than one level."""
    for f in factors:
        largest = max(abs(f.low), abs(f.high))
        if f.high - f.low < NARROW * largest:
            yield (
                f"{f.name} goes from {f.low:g} to {f.high:g}, {(f.high - f.low) / largest:.1%} of "
                "itself: so narrow a range moves a response by less than runs scatter"
            )


def _warnings(config, factors):
    """The engine's warnings of a run with every factor at its fixed level, else at its middle, and
    what more it says where one factor is at an end of its range."""
    from dem.advice import warnings_of  # loads the engine

    def at(levels):
        return warnings_of(parse_spec(point_spec(config.own_run, config.experiment, levels, seed)))

    seed = config.seed
    levels = {f.key: config.fixed.get(f.name, f.natural(0.0)) for f in factors}
    found = at(levels)
    for f in factors:
        for end in (f.low, f.high):
            more = [text for text in at(levels | {f.key: end}) if text not in found]
            found += [f"with {f.name} at {end}: {text}" for text in more]
    return found


def closing(study: Study) -> list[str]:
    """Sentences: the answer, the page of a diagnosis, and where the report is; whatever of them is
    there."""
    found = answer_of(study)
    said = str(found).splitlines() if found else []
    verdict = study.summary("diagnosis", "verdict")
    if verdict:
        page = Path(study.folder, "diagnosis", "diagnosis.html").absolute()
        said.append(f"diagnosis: {verdict['verdict']}: {page}")
    report = Path(study.folder, "report.html").absolute()
    return [*said, *([f"report: {report}"] if report.is_file() else [])]


TABLES = "effects anova runs coefficients numerics scaling parameters next"
KEPT = ("*.json", *(f"{name}.csv" for name in TABLES.split()))
NOT_KEPT = ("logs", FOLDER)
BEGIN, END = "<!-- found: begin -->", "<!-- found: end -->"


def keep(study: str | Path, target: str | Path, tables: Sequence[str] = KEPT) -> None:
    """Copy the summaries and `tables` of a study's stages; plans and figures stay behind."""
    for folder in sorted(p for p in Path(study).iterdir() if p.is_dir() and p.name not in NOT_KEPT):
        for pattern in tables:
            for path in folder.glob(pattern):
                if path.name != "plan.json":
                    (Path(target) / folder.name).mkdir(parents=True, exist_ok=True)
                    shutil.copy(path, Path(target) / folder.name / path.name)


def found(folder: str | Path, metric: str) -> str:
    """Markdown: what each stage in a folder of results says of itself, a line a stage."""
    results, response, lines = Results(folder), response_of(metric), []
    for stage in load_stages().values():
        summary = results.summary(stage.name)
        texts = sentences_of(stage, summary, response)
        if texts:
            lines.append(f"- **{stage.title}.** {' '.join(texts)}")
    return "\n".join(lines)


def sentences_of(stage: Stage, summary: Mapping[str, Any] | None, response: Response) -> list[str]:
    """Return what a stage says of its summary (a mapping, or None), which of its runs it left out,
    and what its runs say themselves."""
    if not summary:
        return []
    texts = stage.sentences(summary, response) if stage.sentences else []
    return [*texts, *without_value(summary.get("left_out", [])), *_noted(summary.get("noted", []))]


def _noted(rows):
    """A sentence for each thing that runs say of themselves, in the words of the first that says
    it: notes that differ in their numbers alone say one thing."""
    alike = defaultdict(list)
    for row in rows:
        alike[re.sub(r"[\d.]+", "", row["note"])].append(row)
    for first, *others in alike.values():
        yield f"Run {first['run']}: {first['note']}."
        if others:
            runs = ", ".join(str(row["run"]) for row in others)
            yield f"The same, with other numbers, of run{'s' if others[1:] else ''} {runs}."


def put(page: str | Path, text: str, begin: str = BEGIN, end: str = END) -> None:
    """Replace what stands between the two marks of a page. Raises CalibrationError for a page
    without them."""
    page = Path(page)
    before, mark, rest = page.read_text().partition(begin)
    _, last, after = rest.partition(end)
    if not mark or not last:
        raise CalibrationError(f"{page}: has no lines {begin} and {end}")
    page.write_text(f"{before}{begin}\n{text}\n{end}{after}")


def main(study: str | Path, target: str | Path, page: str | Path, metric: str) -> None:
    """Keep a study's results and say on the page what they found; metric: the study's target."""
    if Path(study).resolve() != Path(target).resolve():
        keep(study, target)
    put(page, found(target, metric))


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except CalibrationError as error:
        sys.exit(str(error))
