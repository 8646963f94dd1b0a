"""The form of a new study: the same study as by options, behind the same door as a study's page."""

import json
import threading
from http.client import HTTPConnection
from pathlib import Path

import pytest
import yaml

from browser import browse, find_browser
from calibration.interface.api import Study
from calibration.interface.commands import main
from calibration.telling.serve import Server
from facts import tells

WHEAT = {
    "grain": {"density": "1.32 g/cm3", "moisture": "dry"},
    "axes": {"length": "6.2", "width": "3.3", "thickness": "2,9"},
    "lifted-cylinder": {"angle": "26.1 27.4\n28.0\n26.8, 27.9", "cylinder": "60"},
    "bulk-density": {"density": "765", "sd": "6", "n": "5"},
    "drop": {"rebound": "78 mm\n80 mm", "height": "300", "wall": "steel", "sd": ""},
}
THE_SAME = (
    "--lifted-cylinder 26.1,27.4,28.0,26.8,27.9 cylinder=60mm --bulk-density 765kg/m3 sd=6kg/m3 "
    "n=5 --drop 78mm 80mm height=300mm wall=steel --axes 6.2mmx3.3mmx2.9mm --density 1.32g/cm3 "
    "--moisture dry"
).split()


def body(name="wheat", tests=WHEAT, **changes):
    tests = [{"method": m, "answers": a} for m, a in (tests | changes).items()]
    return json.dumps({"name": name, "tests": tests})


@pytest.fixture
def server(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with Server(opened=Study) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        yield server
        server.shutdown()
        thread.join()


def ask(server, path, method="GET", content=None, **headers):
    """(status, body) of a request with the token, which a header may replace."""
    connection = HTTPConnection("127.0.0.1", server.server_port, timeout=60)
    own = {"X-Token": server.token, "Content-Type": "application/json"}
    own |= {k.replace("_", "-"): v for k, v in headers.items()}
    own = {k: v for k, v in own.items() if v is not None}
    connection.request(method, path, body=content, headers=own)
    answer = connection.getresponse()
    found = answer.status, answer.read()
    connection.close()
    return found


def test_a_form_builds_the_study_that_options_build(server):
    status, page = ask(server, "/")
    assert status == 200
    assert b'data-method="shear-cell"' in page
    status, answer = ask(server, "/build", "POST", body())
    told = json.loads(answer)
    assert (status, told["folder"]) == (200, "wheat")
    assert len(told["given"]) == 2 + 3 + 6 + 3 + 4
    assert main(["new", "same", *THE_SAME, "--no-pilot"]) == 0
    texts = [Path(n, "config.yaml").read_text().replace(f"{n}/", "") for n in ("wheat", "same")]
    a, b = map(yaml.safe_load, texts)
    assert a | {"name": ""} == b | {"name": ""}
    # from then on it is the study's page
    status, state = ask(server, "/state")
    assert (status, json.loads(state)["name"]) == (200, "wheat")
    assert ask(server, "/build", "POST", body("again"))[0] == 404


def test_every_fault_is_told_and_nothing_written(server):
    wrong = body(drop={"rebound": "78 kg", "height": ""}, grain={"density": "1.32"})
    status, answer = ask(server, "/build", "POST", wrong)
    faults = json.loads(answer)["faults"]
    assert status == 422
    for facts in (
        ("Drop test", "rebound"),
        ("Drop test", "height", "missing"),
        ("Grain", "density"),
    ):
        assert any(tells(fault, *facts) for fault in faults), facts
    assert not list(Path().iterdir())
    assert server.study is None


@pytest.mark.parametrize("name", ["", "..", "../up", "/tmp/x", "a/b", "a;b", "$HOME"])
def test_a_folder_elsewhere_is_refused(server, name):
    status, _ = ask(server, "/build", "POST", body(name))
    assert status == 422
    assert not list(Path().iterdir())


@pytest.mark.parametrize(
    "content",
    ["", "[]", "{}", "null", '{"name": 1, "tests": []}', '{"name": "a", "tests": [1]}',
     '{"name": "a", "tests": [{"method": "drop", "answers": {"height": 3}}]}', "[" * 100_000],
)  # fmt: skip
def test_what_is_no_form_is_refused(server, content):
    assert ask(server, "/build", "POST", content)[0] == 422
    assert not list(Path().iterdir())


def test_the_door_is_that_of_a_study(server):
    own = f"http://127.0.0.1:{server.server_port}"
    for status, headers in (
        (403, {"X_Token": None}),
        (403, {"X_Token": "wrong"}),
        (403, {"Origin": "http://evil.example"}),
        (403, {"Host": "evil.example"}),
        (415, {"Content_Type": "text/plain"}),
        (200, {"Origin": own}),
    ):
        assert ask(server, "/build", "POST", body(), **headers)[0] == status, headers
    assert ask(server, f"/build?token={server.token}", "POST", body(), X_Token=None)[0] == 403


def test_a_form_that_is_too_long_is_not_read(server):
    assert ask(server, "/build", "POST", "x" * 300_000)[0] == 413
    # a number of so many digits is none to Python
    assert ask(server, "/build", "POST", "{}", Content_Length="9" * 5000)[0] == 413
    assert ask(server, "/state")[0] == 404
    assert ask(server, "/start", "POST")[0] == 404


@pytest.mark.skipif(find_browser() is None, reason="no Chromium on this machine")
def test_a_person_fills_it_in_and_goes_on(server, tmp_path):
    with browse(find_browser(), tmp_path / "browser") as tab:
        for width, scheme in ((390, "dark"), (1280, "light")):
            tab.open(server.address, width, 844, scheme)
            tab.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)")
            assert tab.evaluate("document.documentElement.scrollWidth") <= width
        for method, answers in WHEAT.items():
            for key, value in answers.items():
                field = f"document.querySelector('[data-method={method}] [name={key}]')"
                tab.evaluate(f"{field}.value = {json.dumps(value)}")
        tab.evaluate("document.querySelector('.more').click()")
        tab.evaluate("document.getElementById('name').value = 'wheat'")
        tab.evaluate("document.getElementById('build').click()")
        tab.evaluate(
            "new Promise(done => { const t = setInterval(() => { if (!document.getElementById("
            "'told').hidden) { clearInterval(t); done(); } }, 100); })"
        )
        assert tab.evaluate("document.getElementById('faults').textContent") == ""
        assert tab.evaluate("document.querySelectorAll('#given tbody tr').length") == 18
        assert tab.complaints() == []
    assert Path("wheat/config.yaml").exists()
