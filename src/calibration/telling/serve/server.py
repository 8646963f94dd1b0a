"""The server of a running study's page: on the loopback alone, behind a token, for one study.

Without a study it shows the form of a new one, builds it in the folder that it was started in, and
is its page from then on. Everything else is read but for two requests, which start and stop the
study's own workflow.
"""

import hmac
import io
import json
import secrets
import signal
import socket
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

from jinja2 import Environment, PackageLoader

from calibration.errors import REFUSALS, CalibrationError, in_words
from calibration.telling.serve import form
from calibration.telling.serve.job import Job
from calibration.telling.serve.state import State
from dem.errors import DemError
from dem.render import draw_run, read_run
from dem.results import RUN_NAME, read_result

ADDRESS = "127.0.0.1"
ENDS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
PATIENCE_S = 30.0
LONGEST_LENGTH = 12  # digits
WIDTH = 320  # of a heap's picture [px]
POLICY = (
    "default-src 'none'; img-src 'self' data:; connect-src 'self'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'"
)
REPORT_POLICY = (
    "default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; "
    "script-src 'unsafe-inline'; frame-ancestors 'none'"
)


class Refusal(Exception):
    """A request that is not answered: its status and a sentence."""

    def __init__(self, status: int, sentence: str) -> None:
        super().__init__(sentence)
        self.status = status


class Server(ThreadingHTTPServer):
    """The page of one study at `address`, which bears the token."""

    daemon_threads = True

    def __init__(
        self,
        study: Any = None,
        cores: int = 2,
        port: int = 0,
        opened: Callable[[Path], Any] | None = None,
    ) -> None:
        """study: `calibration.interface.api.Study`, None for the form of a new one; port: a free
        one unless given; opened: opened(folder) -> study, of what the form built."""
        self.token, self.cores, self.opened = secrets.token_urlsafe(24), cores, opened
        self.building = threading.Lock()
        self.study = self.state = self.job = None
        if study is not None:
            self.take(study)
        super().__init__((ADDRESS, port), _Handler)

    def take(self, study: Any) -> None:
        """Be the page of a study."""
        self.state, self.job = State(study, self.cores), Job(study, self.cores)  # type: ignore[assignment]
        self.study = study

    @property
    def hosts(self) -> set[str]:
        """What a browser may have asked for: another name means that some page has renamed the
        loopback."""
        return {f"{name}:{self.server_port}" for name in (ADDRESS, "localhost")}

    @property
    def address(self) -> str:
        """The page's address with its token."""
        return f"http://{ADDRESS}:{self.server_port}/?token={self.token}"

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that goes away amid an answer is no fault, and is not told of."""
        if not isinstance(sys.exception(), ConnectionError | TimeoutError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    server_version, sys_version = "study", ""
    timeout = PATIENCE_S  # for a request that is begun and not ended

    def setup(self):
        super().setup()
        # the socket's own limit begins anew with each byte
        self._late = threading.Timer(self.timeout, self._read_no_more)
        self._late.daemon = True
        self._late.start()

    def finish(self):
        self._late.cancel()
        super().finish()

    def _read_no_more(self):
        with suppress(OSError):  # it has ended already
            self.connection.shutdown(socket.SHUT_RD)

    def do_GET(self):
        self._answer(
            {"/": self._page, "/state": self._state, "/report": self._report}
            if self.server.study
            else {"/": self._form}
        )

    def do_POST(self):
        self._answer(
            {"/start": self._start, "/stop": self._stop}
            if self.server.study
            else {"/build": self._build}
        )

    def log_message(self, *_):
        """The terminal is for the study."""

    def _answer(self, routes):
        try:
            asked = _address(self.path)
            self._check(asked)
            action = routes.get(asked.path)
            shown = self.server.study and self.command == "GET"
            if action is None and shown and asked.path.startswith("/heap/"):
                action = lambda: self._heap(asked.path.removeprefix("/heap/"))  # noqa: E731
            if action is None:
                raise Refusal(404, "there is no such page")
            action()
        except Refusal as refusal:
            self._send(str(refusal).encode(), "text/plain", status=refusal.status)
        except (ConnectionError, TimeoutError):
            raise
        except REFUSALS as error:  # a damaged file of the study, a full disk
            self._send(in_words(error).encode(), "text/plain; charset=utf-8", status=500)

    def _check(self, asked):
        """Refuse what does not come from the page itself."""
        if self.headers.get("Host") not in self.server.hosts:
            raise Refusal(403, "this server answers to its own address alone")
        origin = self.headers.get("Origin")
        if origin is not None and _address(origin).netloc not in self.server.hosts:
            raise Refusal(403, "another page asks")
        # what changes something takes the token in a header, which no other page can send
        given = self.headers.get("X-Token", "")
        if self.command == "GET" and not given:
            given = parse_qs(asked.query).get("token", [""])[0]
        if not hmac.compare_digest(given.encode(), self.server.token.encode()):
            raise Refusal(403, "the token is missing or wrong: open the address dem serve told")

    def _page(self):
        self._html("page.html.j2", name=self.server.study.name)

    def _form(self):
        self._html("form.html.j2", methods=form.form())

    def _html(self, template, **what):
        nonce = secrets.token_urlsafe(12)
        text = _template(template).render(nonce=nonce, **what)
        policy = f"{POLICY}; style-src 'nonce-{nonce}'; script-src 'nonce-{nonce}'"
        self._send(text.encode(), "text/html; charset=utf-8", policy)

    def _state(self):
        job = self.server.job
        found = self.server.state.mapping() | {"running": job.running, "ended": job.ended}
        self._send(json.dumps(found).encode(), "application/json")

    def _report(self):
        path = self.server.study.folder / "report.html"
        if not path.is_file():
            raise Refusal(404, "there is no report yet")
        self._send(path.read_bytes(), "text/html; charset=utf-8", REPORT_POLICY)

    def _heap(self, name):
        if not RUN_NAME.fullmatch(name) or not self.server.state.planned(name):
            raise Refusal(404, "there is no such run in this study")
        folder = Path(self.server.study.config.runs).resolve() / name
        try:
            picture = _picture(folder, read_result(folder, files=False)["checksum"])
        except (DemError, OSError):
            raise Refusal(404, "the run has no heap to show") from None
        self._send(picture, "image/webp")

    def _build(self):
        """Write the study of a filled form, and be its page."""
        body = self._body()
        with self.server.building:
            if self.server.study:
                raise Refusal(409, "the study is written already")
            try:
                laboratory, said = form.build(body, Path.cwd())
                self.server.take(self.server.opened(laboratory.folder))
            except (CalibrationError, DemError) as error:
                answer, status = {"faults": str(error).splitlines()}, 422
            else:
                given, status = laboratory.given, 200
                answer = {"folder": laboratory.folder.as_posix(), "said": said, "given": given}
        self._send(json.dumps(answer).encode(), "application/json", status=status)

    def _body(self):
        """What a request brings, of a stated length that a form may have."""
        length = self.headers.get("Content-Length", "")
        if not length.isascii() or not length.isdigit():
            raise Refusal(411, "the request does not say how long it is")
        # Python takes no number of thousands of digits
        if len(length) > LONGEST_LENGTH or int(length) > form.MOST_BYTES:
            raise Refusal(413, f"a form has {form.MOST_BYTES} bytes at most")
        if self.headers.get("Content-Type", "").split(";")[0].strip() != "application/json":
            raise Refusal(415, "a form is sent as application/json")
        return self.rfile.read(int(length))

    def _start(self):
        started = self.server.job.start()
        self._send(json.dumps({"started": started}).encode(), "application/json")

    def _stop(self):
        self.server.job.stop()
        self._send(b"{}", "application/json")

    def _send(self, content, kind, policy=POLICY, status=200):
        self.send_response(status)
        for name, value in (
            ("Content-Type", kind),
            ("Content-Length", str(len(content))),
            ("Content-Security-Policy", policy),
            ("X-Content-Type-Options", "nosniff"),
            ("Referrer-Policy", "no-referrer"),
            ("Cache-Control", "no-store"),
        ):
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content)


def _address(text):
    """Parts of an address. Raises Refusal for one that is none."""
    try:
        return urlsplit(text)
    except ValueError:
        raise Refusal(400, "the address is none") from None


@lru_cache(maxsize=512)
def _picture(folder, _checksum):
    """A finished run as WebP; kept by the result's checksum, as a run may be made again."""
    kept = io.BytesIO()
    draw_run(read_run(folder), width=WIDTH).save(kept, "WEBP", quality=70)
    return kept.getvalue()


def _template(name):
    loader = PackageLoader("calibration.telling.serve", ".")
    return Environment(loader=loader, autoescape=True).get_template(name)


def _end(*_):
    """End once: a second signal would leave behind what the first one is stopping."""
    for way in ENDS:
        signal.signal(way, signal.SIG_IGN)
    raise KeyboardInterrupt


def serve(
    study: Any = None,
    cores: int = 2,
    port: int = 0,
    say: Callable[..., object] = print,
    opened: Callable[[Path], Any] | None = None,
) -> None:
    """Serve a study, or the form of a new one that `opened` opens, until interrupted or terminated,
    or until the terminal is closed; what the page started is stopped then, and goes on at the next
    start."""
    for way in ENDS:
        signal.signal(way, _end)
    with Server(study, cores, port, opened) as server:
        name = study.name if study else "a new study"
        say(f"{name}: {server.address} (Ctrl + C ends it)", flush=True)
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            pass
        finally:
            if server.job:
                server.job.stop()
