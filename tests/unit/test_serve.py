"""The page of a running study: what it shows, and whom it does not answer."""

import json
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from http.client import HTTPConnection
from pathlib import Path
from urllib.request import Request, urlopen

import numpy as np
import pandas as pd
import psutil
import pytest
import yaml

from browser import browse, find_browser
from calibration.errors import ConfigError
from calibration.interface.api import Study
from calibration.runs.plans import plan, write_plan
from calibration.runs.progress import REPEAT
from calibration.study.stages import expected_runs
from calibration.study.stages.screening import runs as expected_of_screening
from calibration.telling.serve import Server
from calibration.telling.serve.job import Job
from calibration.telling.serve.server import PATIENCE_S
from dem.results import write_failure, write_result
from dem.spec import parse_spec
from facts import tells

ROOT = Path(__file__).parents[2]


class NoFlow(Exception):
    """Stands for a run's physical failure."""


@pytest.fixture
def study(tmp_path, monkeypatch):
    """A screening of two runs of which one is done and one failed; the workflow is a stub."""
    for name in ("config", "data"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / "Snakefile").write_text("rule all:\n    shell: 'sleep 60'\n")
    monkeypatch.chdir(tmp_path)
    data = yaml.safe_load((ROOT / "config" / "config.yaml").read_text()) | {"name": "two"}
    Path("two.yaml").write_text(yaml.safe_dump(data))
    found = Study("two.yaml")
    design = pd.DataFrame([{f.name: f.centre for f in found.factors}] * 2)
    table, specs = plan(design, found.factors, found.config)
    write_plan("results/two/screening", table, specs)
    done, failed = table["run_id"]
    _finish(Path("results/runs") / done, specs[done])
    folder = Path("results/runs") / failed
    write_failure(folder, parse_spec(specs[failed]), NoFlow("nothing flowed"))
    (folder / REPEAT).write_text(yaml.safe_dump(specs[failed]))  # as a run of the chain leaves it
    return found


def _finish(folder, spec):
    """A small heap as a run leaves it."""
    folder.mkdir(parents=True)
    line = np.arange(-0.01, 0.011, 0.002)
    x, y = (a.ravel() for a in np.meshgrid(line, line))
    position = np.column_stack([x, y, np.full_like(x, 0.001)])
    zero, radius = np.zeros_like(position), np.full(len(x), 0.001)
    np.savez(
        folder / "final.npz", position=position, radius=radius, velocity=zero,
        tag=np.arange(len(x)),
    )  # fmt: skip
    metrics = {"angle_of_repose_deg": 31.25, "height_mm": 2.0}
    write_result(folder, parse_spec(spec), metrics, {"wall_time_s": 6.0})


@pytest.fixture
def server(study):
    with Server(study) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        yield server
        server.job.stop()
        server.shutdown()
        thread.join()


def ask(server, path, method="GET", **headers):
    """(status, headers, body) of a request with the token, which a header may replace."""
    connection = HTTPConnection("127.0.0.1", server.server_port, timeout=30)
    headers = {"X-Token": server.token} | {k.replace("_", "-"): v for k, v in headers.items()}
    connection.request(method, path, headers={k: v for k, v in headers.items() if v is not None})
    answer = connection.getresponse()
    found = answer.status, dict(answer.getheaders()), answer.read()
    connection.close()
    return found


def test_a_coarse_study_is_the_one_that_its_command_makes(study):
    coarse = Study("two.yaml", resolution="quick")
    assert coarse.folder == Path("results/two-quick")
    assert coarse.config.run["particles"]["count"] < study.config.run["particles"]["count"]
    command = coarse.command("-j2", "joint")
    assert command[command.index("--config") + 1] == "resolution=quick"
    assert command[-2:] == ["-j2", "joint"]
    assert "--config" not in study.command("-j2")
    assert Job(coarse, 2).command == coarse.command("-j2")
    with pytest.raises(ConfigError, match="resolution"):
        Study("two.yaml", resolution="quickly")


def test_it_tells_progress_heaps_and_failures(server, study):
    status, headers, body = ask(server, "/state")
    state = json.loads(body)
    assert status == 200
    total = expected_runs(study.config) - expected_of_screening(study.config) + 2
    assert tells(state["sentence"], f"1 of {total}", "1 failed")
    (heap,) = state["heaps"]
    assert heap["text"] == "31.25°"
    (failure,) = state["failures"]
    assert "nothing flowed" in failure["cause"]
    assert state["running"] is False
    status, headers, body = ask(server, f"/heap/{heap['run']}")
    assert (status, headers["Content-Type"]) == (200, "image/webp")
    assert body[8:12] == b"WEBP"


def test_it_listens_on_the_loopback_alone(server):
    assert server.server_address[0] == "127.0.0.1"


@pytest.mark.parametrize("token", [None, "", "wrong", "x" * 32])
@pytest.mark.parametrize(("method", "path"), [("GET", "/"), ("GET", "/state"), ("POST", "/start")])
def test_nobody_is_answered_without_the_token(server, token, method, path):
    status, _, body = ask(server, path, method, X_Token=token)
    assert status == 403
    assert b"token" in body
    assert not server.job.running


def test_a_token_in_the_address_does_not_start_anything(server):
    """Another page could make a browser send such an address."""
    status, _, _ = ask(server, f"/start?token={server.token}", "POST", X_Token=None)
    assert status == 403
    assert not server.job.running


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:80", "127.0.0.1", "127.0.0.1:1", "localhost.evil:80", ""]
)
def test_another_host_header_is_refused(server, host):
    status, _, _ = ask(server, "/state", Host=host)
    assert status == 403


def test_another_origin_is_refused(server):
    assert ask(server, "/start", "POST", Origin="http://evil.example")[0] == 403
    assert not server.job.running
    own = f"http://127.0.0.1:{server.server_port}"
    assert ask(server, "/state", Origin=own)[0] == 200


@pytest.mark.parametrize(
    "path",
    [
        "/heap/../../../two.yaml",
        "/heap/..%2f..%2f..%2ftwo.yaml",
        "/heap/%2e%2e/two.yaml",
        "/heap//etc/passwd",
        "/heap/heap-0123456789abcdef",
        "/heap/heap-0123456789abcdef/../../../two.yaml",
        "/../two.yaml",
        "/two.yaml",
        "/report/../../two.yaml",
        "//etc/passwd",
    ],
)
def test_no_path_leaves_the_study(server, path):
    status, _, body = ask(server, path)
    assert status == 404
    assert b"name:" not in body
    assert b"root:" not in body


def test_it_changes_nothing_but_its_own_study(server):
    for method in ("PUT", "DELETE", "PATCH"):
        assert ask(server, "/state", method)[0] == 501
    for path in ("/state", "/", "/report", "/heap/x"):
        assert ask(server, path, "POST")[0] == 404


def test_the_report_is_shown_when_there_is_one(server, study):
    assert ask(server, "/report")[0] == 404
    (study.folder / "report.html").write_text("<p>the report</p>")
    status, headers, body = ask(server, "/report")
    assert (status, body) == (200, b"<p>the report</p>")
    assert "default-src 'none'" in headers["Content-Security-Policy"]


def test_it_starts_its_study_once_and_stops_it(server):
    assert ask(server, "/start", "POST")[0] == 200
    first = server.job._process.pid
    assert ask(server, "/start", "POST")[0] == 200
    assert server.job._process.pid == first
    assert json.loads(ask(server, "/state")[2])["running"] is True
    assert ask(server, "/stop", "POST")[0] == 200
    state = json.loads(ask(server, "/state")[2])
    assert state["running"] is False
    assert "ended with status" in state["ended"]


def test_two_at_once_start_one(server, monkeypatch):
    """Requests come in threads. The check and the start are held apart here, as they may be."""
    plain = type(server.job).running.fget
    started, both = [], threading.Barrier(2)

    def slow(job):
        found = plain(job)
        time.sleep(0.2)
        return found

    monkeypatch.setattr(type(server.job), "running", property(slow))

    def post():
        both.wait()
        started.append(json.loads(ask(server, "/start", "POST")[2])["started"])

    threads = [threading.Thread(target=post) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(started) == [False, True]


@pytest.mark.parametrize("path", ["http://[", "http://[::1", "http://]/state"])
def test_an_address_that_is_none_is_told_so(server, path, capfd):
    """As bytes: a client of the library would not send it."""
    with socket.create_connection(("127.0.0.1", server.server_port), timeout=30) as client:
        client.sendall(f"GET {path} HTTP/1.0\r\n\r\n".encode())
        assert b" 400 " in client.recv(1000).splitlines()[0]
    assert ask(server, "/state", Origin="http://[")[0] == 400
    assert "Traceback" not in capfd.readouterr().err


def test_a_run_that_was_made_again_gets_its_new_picture(server, study):
    (heap,) = json.loads(ask(server, "/state")[2])["heaps"]
    before = ask(server, f"/heap/{heap['run']}")[2]
    folder = Path("results/runs") / heap["run"]
    with np.load(folder / "final.npz") as kept:
        arrays = dict(kept)
    arrays["position"] *= np.array([1.0, 1.0, 4.0])
    np.savez(folder / "final.npz", **arrays)
    spec = parse_spec(json.loads((folder / "result.json").read_text())["spec"])
    write_result(folder, spec, {"angle_of_repose_deg": 40.0}, {"wall_time_s": 6.0})
    assert ask(server, f"/heap/{heap['run']}")[2] != before


def test_a_request_that_is_not_ended_is_given_up(server, monkeypatch):
    assert server.RequestHandlerClass.timeout == PATIENCE_S
    monkeypatch.setattr(server.RequestHandlerClass, "timeout", 0.2)
    with socket.create_connection(("127.0.0.1", server.server_port), timeout=20) as held:
        held.sendall(b"GET / HT")
        while held.recv(1000):  # an answer, perhaps, and then the end
            pass
    assert ask(server, "/state")[0] == 200
    # nor does one last for ever that sends a byte now and then
    with socket.create_connection(("127.0.0.1", server.server_port), timeout=20) as held:
        held.settimeout(0.05)
        end = time.monotonic() + 15
        while True:
            assert time.monotonic() < end
            try:
                held.sendall(b"G")
                if not held.recv(1000):
                    break
            except TimeoutError:
                continue
            except ConnectionError:
                break


def test_a_browser_that_goes_away_is_no_fault(server, study, capfd):
    (study.folder / "report.html").write_text("x" * 8_000_000)
    request = f"GET /report HTTP/1.0\r\nHost: 127.0.0.1:{server.server_port}\r\n"
    for _ in range(3):
        with socket.create_connection(("127.0.0.1", server.server_port), timeout=20) as client:
            client.sendall(f"{request}X-Token: {server.token}\r\n\r\n".encode())
            assert client.recv(10)
    assert ask(server, "/state")[0] == 200
    time.sleep(0.2)
    assert capfd.readouterr().err == ""


def test_what_the_study_or_the_machine_refuses_is_told(server, study, capfd):
    plan_file = study.folder / "screening" / "plan.json"
    whole = plan_file.read_text()
    plan_file.write_text(whole[:-9])
    for path in ("/state", "/heap/heap-0123456789abcdef"):
        status, _, body = ask(server, path)
        assert (status, b"plan.json" in body) == (500, True)
    plan_file.write_text(whole)
    server.job.log.parent.write_text("no folder")
    status, _, body = ask(server, "/start", "POST")
    assert (status, b"logs" in body) == (500, True)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("way", [signal.SIGTERM, signal.SIGHUP])
def test_what_it_started_ends_with_it(study, tmp_path, way):
    """Also where it is terminated, or its terminal is closed: nothing goes on unseen. A terminal
    that is closed, or an impatient person, sends several signals."""
    command = [sys.executable, "-m", "calibration.interface.commands", "serve", "two.yaml"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True) as process:
        address = re.search(r"(http://\S+)/\?token=(\S+)", process.stdout.readline())
        started = Request(f"{address[1]}/start", method="POST", headers={"X-Token": address[2]})
        assert urlopen(started).status == 200
        (child,) = psutil.Process(process.pid).children()
        assert "snakemake" in " ".join(child.cmdline())
        process.send_signal(way)
        for _ in range(50):
            process.send_signal(signal.SIGINT)
            time.sleep(0.005)
        process.wait(60)
        assert (process.returncode, process.stderr.read()) == (0, "")
    assert not child.is_running() or child.status() == psutil.STATUS_ZOMBIE


@pytest.mark.skipif(find_browser() is None, reason="no Chromium on this machine")
def test_a_browser_shows_the_page_and_its_buttons_work(server, tmp_path):
    with browse(find_browser(), tmp_path / "browser") as tab:
        for width, scheme in ((390, "light"), (1280, "dark")):
            tab.open(server.address, width, 844, scheme)
            _until(tab, "document.querySelectorAll('#heaps img').length === 1")
            assert "1 failed" in tab.evaluate("document.getElementById('sentence').textContent")
            assert tab.evaluate("document.querySelector('#failures pre').textContent")
            assert tab.evaluate("document.documentElement.scrollWidth") <= width
        _until(tab, "document.querySelector('#heaps img').naturalWidth > 0")
        tab.evaluate("document.getElementById('start').click()")
        _until(tab, "!document.getElementById('stop').disabled")
        assert server.job.running
        tab.evaluate("document.getElementById('stop').click()")
        _until(tab, "!document.getElementById('start').disabled")
        assert not server.job.running
        assert tab.complaints() == []
        own = f"http://127.0.0.1:{server.server_port}/"
        assert all(address.startswith(own) for address in tab.requests())


def _until(tab, expression, deadline_s=60.0):
    end = time.monotonic() + deadline_s
    while not tab.evaluate(expression):
        assert time.monotonic() < end, expression
        time.sleep(0.2)
