"""What every script of the workflow needs: its log, and the configuration."""

import json
import sys
import traceback
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path

from calibration.config import Config
from calibration.errors import CalibrationError
from dem.errors import DemError


@contextmanager
def logged(log):
    """Send what a stage prints to its log; an error of ours ends the job with one line there and on the screen."""
    Path(log).parent.mkdir(parents=True, exist_ok=True)
    with open(log, "w") as stream, redirect_stdout(stream), redirect_stderr(stream):
        try:
            yield
        except (CalibrationError, DemError) as error:
            print(error, file=stream)
            print(error, file=sys.__stderr__)
            sys.exit(1)
        except Exception:
            traceback.print_exc(file=stream)
            raise


def settings_of(data, bench_files=()):
    """`Config` of already checked settings; the levels that the bench tests found, where given, replace its own."""
    config = Config.model_validate(data)
    for file in bench_files or ():
        config = config.model_copy(
            update={"fixed": config.fixed | json.loads(Path(file).read_text())["fixed"]}
        )
    return config
