"""The study's own workflow as a process that the page may start and stop, and no other."""

import os
import signal
import subprocess
import threading
from typing import Any

PATIENCE_S = 20.0


class Job:
    """One workflow at a time, whoever asks: the requests of a server come in threads."""

    def __init__(self, study: Any, cores: int) -> None:
        self.command = study.command(f"-j{cores}")
        self.log = study.folder / "logs" / "serve.log"
        self._process, self._lock = None, threading.Lock()

    @property
    def running(self) -> bool:
        """Whether what was started here still runs."""
        return self._process is not None and self._process.poll() is None

    @property
    def ended(self) -> str:
        """Words for how the last one ended; empty before."""
        if self._process is None or self.running:
            return ""
        code = self._process.returncode
        return "finished" if code == 0 else f"ended with status {code}; its words are in {self.log}"

    def start(self) -> bool:
        """Start the workflow; False where it runs already."""
        with self._lock:
            if self.running:
                return False
            self.log.parent.mkdir(parents=True, exist_ok=True)
            with open(self.log, "w") as stream:
                self._process = subprocess.Popen(  # type: ignore[assignment]
                    self.command, stdin=subprocess.DEVNULL, stdout=stream, stderr=stream,
                    start_new_session=True,
                )  # fmt: skip
            return True

    def stop(self) -> None:
        """End what was started here: its runs keep a checkpoint, and the next start goes on from
        there."""
        with self._lock:
            for way in (signal.SIGTERM, signal.SIGKILL):
                if not self.running:
                    return
                try:
                    os.killpg(self._process.pid, way)  # type: ignore[attr-defined]
                    self._process.wait(PATIENCE_S)  # type: ignore[attr-defined]
                except (subprocess.TimeoutExpired, ProcessLookupError):
                    continue
