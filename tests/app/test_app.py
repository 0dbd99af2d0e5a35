"""The page's server: its runs are those of `udd.simulate`, and it lets nobody else in."""

from __future__ import annotations

import itertools
import json
import re
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("starlette")
pytest.importorskip("httpx2")
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

import udd
from app_for_tests import CHAOS, HOST, ORIGIN, SOCKET, TOKEN, client
from udd.app import growing_run, limits, maps, security, server, spec
from udd.app.presets import catalogue
from udd.app.serving import hosts_of
from udd.cli import main
from udd.discovery.verdict import verdict_of
from udd.errors import IncompleteWarning
from udd.simulation.trajectory import integrated

__all__ = ["client"]

DRY = {"name": "coulomb", "c": 0.001, "treatment": "set-valued"}
STATIC = Path(server.__file__).parent / "static"


def asked(start: dict[str, Any], first: int = 0, count: int = 120, **more: int) -> dict[str, Any]:
    return {"type": "run", "generation": 1, "run": 0, "first": first, "count": count, **start, **more}


def of(model: dict[str, Any], state: object = (0, 0, 0, 0)) -> str:
    return json.dumps(asked({"model": model, "state": state}))


def piece(message: bytes) -> tuple[tuple[int, ...], np.ndarray]:
    head = struct.unpack_from("<8I", message)
    rows, columns = head[4:6] if head[0] == 1 else head[2:4]
    return head, np.frombuffer(message, "<f8", offset=32)[: rows * columns].reshape(rows, columns)


# --- runs


@pytest.mark.parametrize(
    ("model", "state"),
    [
        ({"kind": "disk", "W": 0.03}, [0.0, 0.001, 0.04, 0.0]),
        ({"kind": "dle", "w": 3.9, "B": 0.0}, [1.0, 1.0, 0.01]),
        (
            {"kind": "disk", "W": 0.05, "effects": [{"name": "relaxation", "b": 6.0}], "edge": "ignore"},
            [2.0, 0.02, -0.02, 0.0],
        ),
        (
            {
                "kind": "disk",
                "W": 0.02,
                "effects": [{"name": "coulomb", "c": 0.001, "treatment": "set-valued"}],
            },
            [2.0, 0.02, -0.02, 0.0],
        ),
    ],
)
def test_pieces_are_the_bits_of_one_call_of_simulate(model: dict[str, Any], state: list[float]) -> None:
    start = spec.start_of({"model": model, "state": state})
    run = growing_run.Run(start)
    shown = np.vstack([run.piece(first, 120)[0] for first in range(0, 4800, 120)])
    per = 64 if model["kind"] == "dle" else 240
    # Longer than any call of the page's, so that the last step of none of these is the one that is cut.
    whole = integrated(start.model, np.arange(30_000) / per, state)  # some leave the wheels later
    assert len(shown) == 4800
    np.testing.assert_array_equal(shown[:, : len(state)], whole.state[:4800])


def test_a_run_that_leaves_the_wheels_ends_where_simulate_ends() -> None:
    start = spec.start_of({"model": {"kind": "disk", "W": 0.042}, "state": [3.0, 0.005, 0.0, 0.0]})
    with pytest.warns(IncompleteWarning, match="left the wheels"):
        whole = udd.simulate(start.model, np.arange(60_000) / 240, list(start.state), method="dopri5")
    assert whole.outcome == "ejected"
    run = growing_run.Run(start)
    rows, last = run.piece(0, 60_000)
    assert (last, run.outcome, len(rows)) == (True, "ejected", len(whole.t))
    np.testing.assert_array_equal(rows[:, :4], whole.state)
    assert run.t[-1] == whole.t[-1]


def test_a_long_run_is_full(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "MODEL_SECONDS", 5.0)
    run = growing_run.Run(spec.start_of(CHAOS))
    rows, last = run.piece(0, 4000)
    assert (len(rows), last, run.outcome) == (1200, True, "full")


def test_the_table_holds_the_same_bits(client: TestClient) -> None:
    answer = client.get("/api/run.csv", params={"run": json.dumps(CHAOS), "seconds": 2})
    assert answer.headers["content-disposition"] == 'attachment; filename="udd-run.csv"'
    lines = [line for line in answer.text.splitlines() if not line.startswith("#")]
    assert lines[0] == "t,Omega,Y,Z,beta"
    table = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    whole = udd.simulate(udd.Disk(0.03), np.arange(2000) / 240, CHAOS["state"], method="dopri5")
    np.testing.assert_array_equal(table[:, 0], whole.t[:481])
    np.testing.assert_array_equal(table[:, 1:], whole.state[:481])


def test_the_table_in_the_units_shown_is_read_back(client: TestClient, tmp_path: Path) -> None:
    query = {"run": json.dumps(CHAOS), "seconds": 2, "units": "shown"}
    text = client.get("/api/run.csv", params=query).text
    assert "t [s],Omega [rad/s],Y [cm],Z [cm],beta [rad]" in text
    assert "# W [cm/s] = 3\n# R [cm] = 8\n" in text
    (tmp_path / "run.csv").write_text(text)
    with pytest.warns(UserWarning, match="converted Y from cm to m, Z from cm to m"):
        read = udd.read_measurement(tmp_path / "run.csv")
    whole = udd.simulate(udd.Disk(0.03), np.arange(2000) / 240, CHAOS["state"], method="dopri5")
    np.testing.assert_allclose(read.values, whole.state[:481, 1:], rtol=1e-9, atol=1e-12)


# --- the WebSocket


def test_a_page_gets_pieces_tagged_with_its_generation(client: TestClient) -> None:
    with client.websocket_connect(SOCKET) as socket:
        socket.send_json(asked(CHAOS, generation=7))
        about = socket.receive_json()
        assert about["generation"] == 7
        assert about["columns"][:4] == ["Omega", "Y", "Z", "beta"]
        assert about["motor"] == 9.81 * 0.03
        head, first = piece(socket.receive_bytes())
        socket.send_json(asked(CHAOS, 120, 240, generation=7))
        tail, second = piece(socket.receive_bytes())
    assert head == (1, 7, 0, 0, 120, 8, 0, 0)
    assert tail == (1, 7, 0, 120, 240, 8, 0, 0)
    whole = udd.simulate(udd.Disk(0.03), np.arange(2000) / 240, CHAOS["state"], method="dopri5")
    np.testing.assert_array_equal(np.vstack([first, second])[:, :4], whole.state[:360])


def test_a_dropped_connection_goes_on_where_it_was(client: TestClient) -> None:
    with client.websocket_connect(SOCKET) as socket:
        socket.send_json(asked(CHAOS))
        socket.receive_json()
        _, before = piece(socket.receive_bytes())
    with client.websocket_connect(SOCKET) as socket:
        socket.send_json(asked(CHAOS, 120))
        _, after = piece(socket.receive_bytes())
    whole = udd.simulate(udd.Disk(0.03), np.arange(2000) / 240, CHAOS["state"], method="dopri5")
    np.testing.assert_array_equal(np.vstack([before, after])[:, :4], whole.state[:240])


def test_two_pages_do_not_disturb_each_other(client: TestClient) -> None:
    other = {"model": {"kind": "dle", "w": 1.0}, "state": [1.0, 1.0, 0.01]}
    with client.websocket_connect(SOCKET) as a, client.websocket_connect(SOCKET) as b:
        a.send_json(asked(CHAOS))
        b.send_json(asked(other))
        assert a.receive_json()["columns"][0] == "Omega"
        assert b.receive_json()["columns"][0] == "omega"
        assert piece(a.receive_bytes())[1].shape == (120, 8)
        assert piece(b.receive_bytes())[1].shape == (120, 7)


def test_sections_grow_and_are_those_of_poincare(client: TestClient) -> None:
    with client.websocket_connect(SOCKET) as socket:
        socket.send_json(
            {"type": "section", "generation": 3, "surface": "zero", "count": 400}
            | {"model": {"kind": "dle", "w": 3.9}, "state": [1.0, 1.0, 0.01]}
        )
        sizes = []
        for _ in range(2):
            _, points = piece(socket.receive_bytes())
            said = socket.receive_json()
            sizes.append(len(points))
            assert said == {"type": "section", "generation": 3, "found": len(points), "outcome": "finished"}
    assert sizes == [200, 400]
    np.testing.assert_array_equal(
        points, udd.poincare(udd.DLE(3.9), n=400, state0=[1, 1, 0.01], transient=60).state
    )


def test_the_diagram_tells_coexisting_attractors_apart() -> None:
    # Between 5.394713224 and 7.09642643066 the DLE has an asymmetric pair of figure-eights (reference).
    start = spec.start_of({"model": {"kind": "dle", "w": 6.5}, "state": [1.0, 1.0, 0.01]})
    diagram = maps.diagram(start, 6.4, 6.6, 5)
    exponents = maps.exponents(start, 6.4, 6.6, 5)
    assert diagram.points.shape == (3, 5, 40, 3)
    assert set(np.unique(diagram.label)) == {1.0, 2.0}
    assert (diagram.period == 2).all()
    assert np.abs(exponents.exponent).max() < 0.05  # periodic: zero, but for the short run


def test_the_first_picture_of_a_diagram_has_one_orbit_and_later_ones_three() -> None:
    start = spec.start_of({"model": {"kind": "dle", "w": 6.5}, "state": [1.0, 1.0, 0.01]})
    assert maps.diagram(start, 6.4, 6.6, maps.VALUES[0]).label.shape == (1, maps.VALUES[0])
    assert maps.diagram(start, 6.4, 6.6, 3).label.shape == (3, 3)


@pytest.mark.parametrize(
    ("message", "words"),
    [
        ("no json", "A message is not JSON: Expecting value: line 1 column 1 (char 0)."),
        ("[" * 60_000, "A message is not JSON: maximum recursion depth"),
        ("[1]", "A message must be a table of names and values, not [1]."),
        ('{"type": "os.system"}', "No message is called 'os.system'."),
        ('{"type": []}', "No message is called '[]'."),
        (json.dumps(asked(CHAOS, count=10**9)), "Count must be a whole number from 1 to 4096"),
        (json.dumps(asked(CHAOS, first=-1)), "First must be a whole number"),
        (of({"kind": "own"}), "The page shows a disk or the dle"),
        (
            json.dumps(asked({"model": {"kind": "disk", "W": -1}, "state": [0, 0, 0, 0]})),
            "W must not be below 0",
        ),
        (
            json.dumps(asked({"model": {"kind": "disk", "W": 1e999}, "state": [0, 0, 0, 0]})),
            "W must be finite",
        ),
        (of({"kind": "disk", "W": 1}, [0, 1, 0, 0]), "outside the disk"),
        (of({"kind": "disk", "W": 1}, "x"), "State0 must be numbers"),
        (of({"kind": "disk", "W": 1, "effects": [{"name": []}]}), "No effect is called []"),
        (json.dumps({"type": "watch", "job": "x"}), "There is no such job any more."),
        (json.dumps({"type": "diagram", "generation": 1, **CHAOS, "low": 2, "high": 1}), "0 < low < high"),
        (
            json.dumps({"type": "diagram", "generation": 1, **CHAOS, "low": "a", "high": 1}),
            "Low must be a number",
        ),
        (json.dumps({"type": "diagram", "generation": 1, **CHAOS}), "Low must be a number"),
        ("x" * 70_000, "The message is too long."),
    ],
)
def test_a_bad_message_gets_one_sentence_and_the_page_lives_on(
    client: TestClient, message: str, words: str
) -> None:
    with client.websocket_connect(SOCKET) as socket:
        socket.send_text(message)
        said = socket.receive_json()
        assert said["type"] == "error"
        assert words in said["text"]
        assert said["text"].endswith(".")
        socket.send_json(asked(CHAOS))
        assert socket.receive_json()["type"] == "run"


# --- who may come in

BAD = [
    ({"host": "evil.example"}, "answers only to the address"),
    ({"host": "127.0.0.1:9999"}, "answers only to the address"),
    ({"origin": "http://evil.example"}, "comes from another page"),
    ({"origin": "null"}, "comes from another page"),
    ({"origin": "https://127.0.0.1:8765"}, "comes from another page"),
    ({"x-udd-token": "open"}, "token is missing or wrong"),
    ({"x-udd-token": ""}, "token is missing or wrong"),
    ({"x-udd-token": "sésame".encode()}, "token is missing or wrong"),
]


@pytest.mark.parametrize(("headers", "words"), BAD)
@pytest.mark.parametrize(
    ("method", "path"), [("GET", "/"), ("GET", "/api/catalogue"), ("POST", "/api/jobs/sample")]
)
def test_forged_requests_are_refused(
    client: TestClient, method: str, path: str, headers: dict[str, Any], words: str
) -> None:
    answer = client.request(method, path, headers=headers)
    assert answer.status_code == 403
    assert words in answer.text


@pytest.mark.parametrize(("headers", "words"), BAD)
def test_forged_sockets_are_refused(client: TestClient, headers: dict[str, Any], words: str) -> None:
    with (
        pytest.raises(WebSocketDisconnect) as refused,
        client.websocket_connect(SOCKET, headers=headers),
    ):
        pass
    assert refused.value.code == 1008
    assert words in (refused.value.reason or "")


def test_a_socket_or_a_post_without_an_origin_is_refused() -> None:
    app = server.make_app(TOKEN, [HOST])
    with TestClient(app, base_url=ORIGIN, headers={"x-udd-token": TOKEN}) as client:
        assert client.post("/api/jobs/sample").status_code == 403
        with pytest.raises(WebSocketDisconnect), client.websocket_connect(SOCKET):
            pass
        assert client.get("/").status_code == 200


def test_the_token_may_stand_in_the_address(client: TestClient) -> None:
    bare = {"x-udd-token": ""}
    assert client.get("/", headers=bare, params={"token": "x"}).status_code == 403
    del client.headers["x-udd-token"]
    assert client.get("/", params={"token": TOKEN}).status_code == 200
    assert client.get("/").status_code == 403


@pytest.mark.parametrize("path", ["/", "/static/main.js", "/api/catalogue", "/nowhere"])
def test_every_answer_has_the_policy(client: TestClient, path: str) -> None:
    headers = client.get(path).headers
    assert headers["content-security-policy"].startswith("default-src 'self';")
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["referrer-policy"] == "no-referrer"


@pytest.mark.parametrize(
    "path", ["/static/../server.py", "/static/..%2fserver.py", "/static/%2e%2e/server.py"]
)
def test_nothing_but_the_static_files_is_served(client: TestClient, path: str) -> None:
    assert client.get(path).status_code == 404


@pytest.mark.parametrize(
    ("method", "path", "status"),
    [
        ("GET", "/static/main.js", 200),
        ("POST", "/static/main.js", 405),
        ("GET", "/", 403),
        ("GET", "/api/catalogue", 403),
        ("GET", "/api/run.csv", 403),
        ("POST", "/api/jobs/sample", 403),
        ("GET", "/api/jobs/x/report.html", 403),
        ("GET", "/api/socket", 403),
    ],
)
def test_without_the_token_only_static_files_are_read(
    client: TestClient, method: str, path: str, status: int
) -> None:
    assert client.request(method, path, headers={"x-udd-token": ""}).status_code == status


def test_the_limits_are_those_of_the_security_table() -> None:
    table = (Path(__file__).parents[2] / "SECURITY.md").read_text()
    for words in (
        f"at most {limits.UPLOAD >> 20} MB",
        f"up to {limits.RUNS.processes} for runs ({limits.RUNS.seconds:g} s",
        f"{limits.STEPS // 10**6} million steps",
        f"{limits.MAPS.processes} for maps and tables ({limits.MAPS.seconds:g} s",
        f"({limits.CPU_SECONDS // 60} minutes)",
        f"at most {limits.MEMORY >> 30} GB",
        f"a connection for {limits.PAUSE:g} s",
        f"with {limits.QUESTIONS} open questions",
        f"at most {limits.CONNECTIONS} connections, and {limits.CLIENT_CONNECTIONS} from one address",
        f"ends after {limits.RUNS.share:g} s (a map after {limits.MAPS.share:g} s)",
    ):
        assert words in table, words
    assert limits.JOBS == 8 and "eight newer jobs" in table


def test_which_names_a_server_goes_by() -> None:
    assert hosts_of("127.0.0.1", 1) == (["127.0.0.1:1", "localhost:1"], False)
    assert hosts_of("192.168.1.5", 1) == (["192.168.1.5:1"], False)
    names, any_address = hosts_of("0.0.0.0", 1)
    assert any_address
    guard = security.Guard(server.make_app("t", []), "t", names, any_address=True)
    for host, fine in (("10.0.0.3:1", True), ("evil.example:1", False), ("[::1]:1", True)):
        scope = {
            "type": "http", "method": "GET", "path": "/", "query_string": b"token=t",
            "headers": [(b"host", host.encode())],
        }  # fmt: skip
        assert (guard.refusal(scope) is None) == fine


# --- the catalogue and the texts


def test_presets_run_and_have_words() -> None:
    words = json.loads((STATIC / "texts.en.json").read_text())
    offered = json.loads(json.dumps(catalogue(), allow_nan=False))
    for preset in offered["presets"]:
        assert f"preset_{preset['key']}" in words
        growing_run.Run(spec.start_of({"model": preset["model"], "state": preset["state"]}))
    outcome = {p["key"]: growing_run.Run(spec.start_of(p)).piece(0, 30 * 240)[1] for p in offered["presets"]}
    assert [key for key, over in outcome.items() if over] == ["ejected"]
    for effect in offered["effects"]:
        values = {p["name"]: p["default"] for p in effect["parameters"]}
        model = {"kind": "disk", "W": 0.03, "effects": [{"name": effect["name"], **values}]}
        spec.start_of({"model": model, "state": CHAOS["state"]})


def test_steadily_rotating_is_steady_and_bistable_has_two_attractors() -> None:
    offered = {p["key"]: p for p in catalogue()["presets"]}
    rotating = spec.start_of(offered["rotating"])
    late = growing_run.Run(rotating).piece(60_000, 240)[0][:, 0]
    assert np.ptp(late) < 1e-3 * abs(late.mean())
    bistable = spec.start_of(offered["bistable"])
    values = np.linspace(bistable.model.parameters["w"] - 1e-3, bistable.model.parameters["w"] + 1e-3, 3)
    result = maps._diagram(bistable.model, "w", values, maps.starts_of(bistable))
    assert len({label for label in result.label[:, 1] if label > 0}) >= 2


def test_every_word_that_the_page_says_is_in_its_file() -> None:
    words = json.loads((STATIC / "texts.en.json").read_text())
    page = (STATIC / "index.html").read_text()
    used = set(re.findall(r'data-(?:text|label|hint)="(\w+)"', page))
    script = "\n".join(path.read_text() for path in STATIC.glob("*.js"))
    used |= set(re.findall(r'\bt\("(\w+)"', script))
    assert used - words.keys() == set()
    # Keys that are put together: their beginnings.
    beginnings = set(re.findall(r"\bt\(`(\w+?)\$\{", script))
    unused = {w for w in words if w not in used and f'"{w}"' not in script}
    assert {w for w in unused if not any(w.startswith(b) for b in beginnings)} == set()


@pytest.mark.parametrize("language", ["nl", "de"])
def test_a_language_is_complete(language: str) -> None:
    english, other = (json.loads((STATIC / f"texts.{code}.json").read_text()) for code in ("en", language))
    assert other.keys() == english.keys()
    for key, text in english.items():
        if isinstance(text, str):
            # The same places for values, and no sentence left in English.
            assert sorted(re.findall(r"{\w*}", other[key])) == sorted(re.findall(r"{\w*}", text)), key
            words = re.findall(r"[a-z]{3,}", re.sub(r"{\w*}", "", text))
            assert other[key] != text or len(words) < 3, key
        else:
            assert [len(row) for row in other[key]] == [len(row) for row in text], key
    verdicts = [row[0] for row in other["verdicts"]]
    cases = itertools.product([[], [None]], [False, True], [[]], [False, True], [False, True])
    assert verdicts == [row[0] for row in english["verdicts"]]
    assert set(verdicts) == {verdict_of(*case) for case in cases}
    offered = re.search(r"LANGUAGES = {(.*)}", (STATIC / "texts.js").read_text())
    assert offered is not None and f"{language}:" in offered[1]


def test_the_page_reaches_for_nothing_outside() -> None:
    for path in STATIC.iterdir():
        for address in re.findall(r"(?:https?:)?//[\w.]+\.\w+[^\s\"'`]*", path.read_text()):
            assert address.startswith("http://www.w3.org/"), (path.name, address)


# --- the command


def test_the_command_says_what_is_wrong(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["app", "--port", "70000"]) == 1
    assert "--port must be from 0 to 65535" in capsys.readouterr().err
    assert main(["app", "nonsense"]) == 1
    assert "is no link of the page" in capsys.readouterr().err
    assert main(["app", "--host", "a..b", "--port", "0", "--no-browser"]) == 1
    assert "a..b is no name of a machine" in capsys.readouterr().err
    assert main(["app", "--host", "192.0.2.1", "--port", "0", "--no-browser"]) == 1
    assert "cannot be served" in capsys.readouterr().err
