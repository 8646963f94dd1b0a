"""A headless Chromium, driven over its debugging pipe: no further package, no port, no network."""

import json
import os
import select
import shutil
import subprocess
import sys
import time
from contextlib import contextmanager

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = [
    "--headless=new",
    "--no-sandbox",
    "--disable-dev-shm-usage",
    "--disable-background-networking",
    "--disable-component-update",
    "--no-first-run",
    "--hide-scrollbars",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--remote-debugging-pipe",
]

# the browser reads commands from descriptor 3 and writes answers to 4
START = """
import fcntl, os, sys
ends = [fcntl.fcntl(int(fd), fcntl.F_DUPFD, 20) for fd in sys.argv[1:3]]
for end, wanted in zip(ends, (3, 4)):
    os.dup2(end, wanted)
os.execv(sys.argv[3], sys.argv[3:])
"""


def find_browser():
    """Path of a Chromium, or None."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


class Page:
    """One tab; `events` collects what the browser reports."""

    def __init__(self, to_browser, from_browser):
        self._out, self._in = to_browser, from_browser
        self._buffer, self._count, self.session = b"", 0, None
        self.events = []

    def call(self, method, deadline_s=60.0, **parameters):
        """Send a command of the DevTools protocol and return its result."""
        self._count += 1
        message = {"id": self._count, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        os.write(self._out, json.dumps(message).encode() + b"\0")
        return self._until(lambda m: m.get("id") == self._count, method, deadline_s)

    def wait_for(self, event, deadline_s=60.0):
        """Wait until an event has been reported."""
        if not any(e["method"] == event for e in self.events):
            self._until(lambda m: m.get("method") == event, event, deadline_s)

    def _until(self, wanted, what, deadline_s):
        end = time.monotonic() + deadline_s
        while (left := end - time.monotonic()) > 0:
            while b"\0" in self._buffer:
                raw, self._buffer = self._buffer.split(b"\0", 1)
                message = json.loads(raw)
                if "method" in message:
                    self.events.append(message)
                if wanted(message):
                    assert "error" not in message, f"{what}: {message['error']}"
                    return message.get("result")
            if select.select([self._in], [], [], left)[0]:
                chunk = os.read(self._in, 1 << 20)
                assert chunk, f"the browser ended during {what}"
                self._buffer += chunk
        raise TimeoutError(f"no answer to {what}")

    def open(self, address, width, height, scheme="light"):
        """Load an address at a size [px] and a colour scheme."""
        self.events.clear()
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=width < 600,
        )
        feature = {"name": "prefers-color-scheme", "value": scheme}
        self.call("Emulation.setEmulatedMedia", features=[feature])
        self.call("Page.navigate", url=address)
        self.wait_for("Page.loadEventFired")
        self.settle()

    def settle(self):
        """Wait until what has changed is drawn."""
        self.evaluate(
            "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"
        )

    def evaluate(self, expression):
        """Value of a JavaScript expression; a promise is awaited."""
        answer = self.call(
            "Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True
        )
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def complaints(self):
        """Messages of errors and warnings on the console, and uncaught exceptions."""
        found = []
        for event in self.events:
            p = event.get("params", {})
            if event["method"] == "Runtime.exceptionThrown":
                found.append(p["exceptionDetails"]["text"])
            elif event["method"] == "Log.entryAdded" and p["entry"]["level"] in (
                "error",
                "warning",
            ):
                found.append(p["entry"]["text"])
            elif event["method"] == "Runtime.consoleAPICalled" and p["type"] in (
                "error",
                "warning",
            ):
                found.append(str([a.get("value") for a in p["args"]]))
        return found

    def requests(self):
        """Addresses that were asked for, less data: and blob:."""
        asked = [
            e["params"]["request"]["url"]
            for e in self.events
            if e["method"] == "Network.requestWillBeSent"
        ]
        return [a for a in asked if not a.startswith(("data:", "blob:"))]


@contextmanager
def browse(binary, profile):
    """A `Page` of a browser that keeps its files in the folder `profile`."""
    in_r, in_w = os.pipe()
    out_r, out_w = os.pipe()
    process = subprocess.Popen(
        [
            sys.executable,
            "-c",
            START,
            str(in_r),
            str(out_w),
            binary,
            *FLAGS,
            f"--user-data-dir={profile}",
            "about:blank",
        ],
        pass_fds=(in_r, out_w),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(in_r)
    os.close(out_w)
    try:
        page = Page(in_w, out_r)
        target = page.call("Target.createTarget", url="about:blank")["targetId"]
        page.session = page.call("Target.attachToTarget", targetId=target, flatten=True)[
            "sessionId"
        ]
        for domain in ("Page", "Runtime", "Log", "Network"):
            page.call(f"{domain}.enable")
        yield page
    finally:
        os.close(in_w)
        process.terminate()
        try:
            process.wait(timeout=10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        os.close(out_r)
