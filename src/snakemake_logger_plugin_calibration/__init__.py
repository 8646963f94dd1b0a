"""A logger plugin of snakemake, `--logger calibration`: one line for each step of a study, and each
error as a sentence.

The profiles choose it, so that `snakemake -j2` and `calibration run` show the same. What it leaves
out is in snakemake's own log; `--verbose` shows all of it.
"""

import sys
from logging import INFO, WARNING, Handler, LogRecord

from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent

TOLD_ELSEWHERE = ("dem_run", "run_batch")
"""Rules that make runs: each run says by itself how far the study is, so the start of one says
nothing."""
TARGETS = ("all", "study")
"""Rules that only name others: no step."""
NOTHING = "Nothing to be done"
LONGEST = 100  # characters of a reason


class LogHandler(LogHandlerBase):
    """Writes to the stream that snakemake writes to: standard output in a dry run, else standard
    error."""

    def __post_init__(self) -> None:
        Handler.__init__(self)  # which the interface of snakemake 9.10 leaves out
        settings = self.common_settings
        self.stream = sys.stdout if settings.stdout else sys.stderr
        self.whole = settings.verbose or settings.debug_dag or settings.printshellcmds
        self.begun = self.listed = False

    def emit(self, record: LogRecord) -> None:
        """Write what is to be told of a record; all of it where the call asks for more than
        that."""
        try:
            self.begun |= _event(record) == LogEvent.WORKFLOW_STARTED
            text = self.format(record) if self.whole else self._told(record)
            if text and text != "None":
                print(text, file=self.stream, flush=True)
        except BrokenPipeError:
            raise
        except Exception:
            self.handleError(record)

    def _told(self, record: LogRecord) -> str | None:
        """The line of a record, or None."""
        event = _event(record)
        if event == LogEvent.JOB_INFO:
            return self._job(record)
        if event == LogEvent.JOB_ERROR:
            return _failed(vars(record))
        if event == LogEvent.GROUP_ERROR:
            return "\n".join(map(_failed, record.job_error_info))
        if event == LogEvent.RUN_INFO:  # the table of jobs, which a dry run ends with as well
            shown = self.common_settings.dryrun and not self.listed
            self.listed = True
            return _counts(record.stats) if shown else None
        if event == LogEvent.ERROR:
            return _error(record)
        if event is not None:
            return None
        text = record.getMessage().strip()
        # before the workflow has started it answers another question, as --lint does
        asked = not self.begun and not text.startswith("Assuming unrestricted")
        shown = record.levelno >= WARNING or asked or text.startswith(NOTHING)
        return text if shown and record.levelno >= INFO else None

    def _job(self, record: LogRecord) -> str | None:
        """The message of a rule, and in a dry run why it is made; None for a rule that only names
        others."""
        dry = self.common_settings.dryrun
        if not record.output or (record.rule_name in TOLD_ELSEWHERE and not dry):
            return None
        reason = _reason(str(record.reason)) if dry else None
        text = record.rule_msg or record.rule_name
        return f"{text} ({reason})" if reason else text

    @property
    def writes_to_stream(self) -> bool:
        """It does."""
        return True

    @property
    def writes_to_file(self) -> bool:
        """It does not."""
        return False

    @property
    def has_filter(self) -> bool:
        """Snakemake's own heeds --quiet."""
        return False

    @property
    def has_formatter(self) -> bool:
        """Snakemake's own is for a call that asks for more."""
        return False

    @property
    def needs_rulegraph(self) -> bool:
        """It does not."""
        return False


def _counts(stats: dict) -> str:
    """How many steps there are, in place of a table of them; how many runs a study has and what
    they take is told beside it, as most are planned by steps of these.

    stats: {rule: jobs}, with their `total`.
    """
    runs = sum(stats.get(rule, 0) for rule in TOLD_ELSEWHERE)
    steps = stats["total"] - runs - sum(stats.get(rule, 0) for rule in TARGETS)
    told = f"{steps} step{'' if steps == 1 else 's'}"
    return f"{told} and {runs} job{'' if runs == 1 else 's'} of runs" if runs else told


def _event(record: LogRecord) -> LogEvent | None:
    return getattr(record, "event", None)


def _failed(job: dict) -> str:
    """Which step failed and where its log is. The reason is told by the step itself."""
    name = job.get("rule_msg") or job["rule_name"]
    return f"failed: {name}; log: {', '.join(job.get('log') or ['none'])}"


def _error(record: LogRecord) -> str | None:
    """An error; of one that is a sentence to the user, the sentence alone. None where a script has
    ended: the step itself has told why."""
    lines = record.getMessage().strip().splitlines()
    if any(line.startswith("CalledProcessError") for line in lines[:2]):
        return None
    if getattr(record, "exception", None) == "WorkflowError":
        lines = [line for line in lines[1:] if not line.startswith('  File "')]
    elif "  WorkflowError:" in lines:  # of an input function: what it says is indented below
        lines = lines[lines.index("  WorkflowError:") + 1 :]
        lines = lines[: lines.index("Wildcards:")] if "Wildcards:" in lines else lines
    return "\n".join(line.strip() for line in lines)


def _reason(text: str) -> str | None:
    """Why a step is made, in a few words; None where its files are not there yet, as in a new
    study."""
    if text.startswith("Missing output files"):
        return None
    if text.startswith("Params have changed"):
        return "its code, settings or tables have changed"
    text = " ".join(text.split())
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}…"
