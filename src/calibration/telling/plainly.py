"""What snakemake says of a study, without what is for its developers: a line for each job, our own
lines, and each error as a sentence."""

import re
import signal
import subprocess
import sys
from threading import Thread

NOISE = re.compile(
    r"""\s*$
    | (Using\ workflow\ specific|Assuming\ unrestricted|Using\ shell|Provided\ cores|Building\ DAG
      |Rules\ claiming|Conda\ environments|Select\ jobs|Execute\ \d+\ jobs|DAG\ of\ jobs
      |Updating\ checkpoint|Finished\ jobid|Touching\ output|Complete\ log|The\ run\ involves
      |Will\ exit\ after|Shutting\ down|Elapsed\ time|CalledProcessError\ in\ file|Command\ 'set)
    | SNAKEMAKE$ | =+$
    | \ \ (Date|Workflow\ ID|Platform|Host|User|Snakemake\ version|Python\ version|Command|Snakefile
          |Base\ directory|Run\ directory|Working\ directory|Config\ file\(s\)|Config\ MD5):
    | \[\w{3}\ \w{3}\ .*\]$ | \d+\ of\ \d+\ steps
    | Reason:\  | Reasons:$ | \ {4}(\(check\ individual|input\ files\ updated|output\ files\ have)
    | \ {8}[\w,\ ]+$ | \ {4}(resources|input|jobid|reason): | rule\ all:$
    | \ {4}message:\ None | RuleException:$ | WorkflowError(:$|\ in\ file)
    | \ \ File\ ".*",\ line\ \d+,\ in\ <module>$
    """,
    re.VERBOSE,
)
WHOLE = {"--verbose", "--quiet", "-q"}
"""Options that say how much is to be told: with one of them nothing is left out."""


def tell(command):
    """Run a command of snakemake; its exit status. What is NOISE in its output is left out. A
    signal to end reaches it, and it is waited for."""
    piped = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    keys = {} if WHOLE & set(command) else {**piped, "errors": "replace", "bufsize": 1}
    with subprocess.Popen(command, **keys) as process:
        ends = (process.stdout, sys.stdout), (process.stderr, sys.stderr)
        threads = [Thread(target=_pass_on, args=pair) for pair in ends if pair[0]]
        for thread in threads:
            thread.start()
        try:
            return _ended(process)
        finally:
            for thread in threads:
                thread.join()


def _ended(process):
    former = signal.signal(signal.SIGTERM, lambda *_: process.terminate())
    try:
        return process.wait()
    except KeyboardInterrupt:
        process.send_signal(signal.SIGINT)
        process.wait()
        raise
    finally:
        signal.signal(signal.SIGTERM, former)


def _pass_on(source, target):
    for line in source:
        if not NOISE.match(line):
            print(line, end="", file=target, flush=True)
