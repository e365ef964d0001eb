"""The mission over HTTP: what UPISAS expects of an exemplar, and what a server may expect of
clients.
"""

import json
import socket
import struct
import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from http.client import HTTPConnection

import jsonschema
import pytest

from suave_des import InputError, Mission, load_scenario
from suave_des.interfaces.serve import Server, Session
from suave_des.simulation.simulator import Simulator

SEARCH = "f_generate_search_path"


@contextmanager
def served(simulator: Simulator, host_names: Sequence[str] = ()) -> Iterator[int]:
    with Server(Session(simulator), port=0, host_names=host_names) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True)
        thread.start()
        yield server.server_port
        server.shutdown()


@pytest.fixture
def port(simulator: Simulator) -> Iterator[int]:
    with served(simulator) as port:
        yield port


def request(
    port: int, method: str, path: str, body: object = None, **headers: str
) -> tuple[int, bytes]:
    """Send a request; further headers, in which an underscore stands for a dash, replace those that
    it has.
    """
    connection = HTTPConnection("127.0.0.1", port, timeout=10.0)
    content = (
        None if body is None else body if isinstance(body, bytes) else json.dumps(body).encode()
    )
    given = {name.replace("_", "-"): value for name, value in headers.items()}
    connection.request(method, path, content, {"Content-Type": "application/json", **given})
    answer = connection.getresponse()
    return answer.status, answer.read()


def validate_schema(data: dict, schema: dict) -> None:
    """Check as UPISAS does: what its Strategy sends and gets has exactly the keys of the schema."""
    jsonschema.validate(data, schema)
    assert data.keys() == schema["properties"].keys()


class Strategy:
    """An adaptation loop as UPISAS has it: schemas first, then monitor, analyze, plan, execute,
    each validated.
    """

    def __init__(self, port: int) -> None:
        self.port, self.seen = port, b""
        schemas = {
            name: self.get(f"{name}_schema")
            for name in ("monitor", "execute", "adaptation_options")
        }
        for schema in schemas.values():
            jsonschema.Draft202012Validator.check_schema(schema)
        self.schemas = schemas
        self.options = self.get("adaptation_options")
        validate_schema(self.options, schemas["adaptation_options"])

    def get(self, path: str) -> dict:
        status, body = request(self.port, "GET", f"/{path}")
        assert status == 200
        self.seen += body
        return json.loads(body)

    def monitor(self) -> dict:
        found = self.get("monitor")
        validate_schema(found, self.schemas["monitor"])
        assert not any(isinstance(value, dict | list) for value in found.values())
        return found

    def execute(self, adaptation: dict) -> None:
        validate_schema(adaptation, self.schemas["execute"])
        status, body = request(self.port, "PUT", "/execute", adaptation)
        assert status == 200
        self.seen += body


def whole_mission(port: int, seed: int) -> tuple[bytes, dict]:
    request(port, "POST", "/start", {"seed": seed})
    strategy = Strategy(port)
    while not (found := strategy.monitor())["is_over"]:
        adaptation = {**dict.fromkeys(strategy.schemas["execute"]["properties"]), "advance_s": 4.0}
        if found["task"] == "search_pipeline":
            low, medium, high = strategy.options[SEARCH]
            visibility_m = found["water_visibility"] or 0.0
            adaptation[SEARCH] = (
                high if visibility_m >= 3.25 else medium if visibility_m >= 2.25 else low
            )
        strategy.execute(adaptation)
    return strategy.seen, json.loads(request(port, "GET", "/metrics")[1])


def test_a_client_goes_through_a_whole_mission(port):
    _, metrics = whole_mission(port, 3)
    assert metrics["adaptations"] > 3
    assert metrics["seed"] == 3


def test_all_answers_follow_from_the_seed():
    short = load_scenario("seams2023", values={"mission.time_limit_s": 60.0})
    with served(Simulator(short)) as port:
        (first, metrics), (other, _), again = (whole_mission(port, seed) for seed in (3, 4, 3))
    assert other != first
    assert again == (first, metrics)


def test_time_stands_still_until_a_client_says_so(port):
    assert request(port, "GET", "/monitor") == request(port, "GET", "/monitor")
    status, body = request(port, "POST", "/advance", {"advance_s": 2.5})
    assert status == 200 and json.loads(body)["time_s"] == 2.5


def test_thinking_time_that_a_client_tells_passes_before_its_request():
    values = {"metrics": ["reasoning_time_s"], "mission.time_limit_s": 60.0}
    with served(Simulator(load_scenario("seams2023", values=values))) as port:
        request(port, "PUT", "/execute", {"advance_s": 10.0})
        thought = {SEARCH: "fd_spiral_high", "latency_s": 3.0, "advance_s": 1.0}
        assert json.loads(request(port, "PUT", "/execute", thought)[1])["time_s"] == 14.0
        request(port, "PUT", "/execute", {"latency_s": 2.0, SEARCH: "fd_spiral_high"})  # no change
        request(port, "POST", "/advance", {"advance_s": 100.0})
        assert json.loads(request(port, "GET", "/metrics")[1])["reasoning_time_s"] == 3.0


def test_time_that_has_passed_by_itself_before_a_request_is_thinking_time():
    values = {"metrics": ["reasoning_time_s"], "mission.time_limit_s": 60.0}
    session = Session(Simulator(load_scenario("seams2023", values=values)), real_time_factor=100.0)
    session.answer("GET", "/monitor", None)
    time.sleep(0.05)
    session.answer("PUT", "/execute", {SEARCH: "fd_spiral_high"})
    session.answer("POST", "/advance", {"advance_s": 100.0})
    assert session.answer("GET", "/metrics", None)["reasoning_time_s"] >= 5.0


def test_time_may_pass_by_a_factor_of_real_time(simulator):
    session = Session(simulator, real_time_factor=1e6)
    time.sleep(0.01)
    assert session.answer("GET", "/monitor", None)["is_over"] is True
    session = Session(simulator, real_time_factor=10.0)
    then_s = session.answer("POST", "/advance", {"advance_s": 60.0})["time_s"]
    time.sleep(0.01)
    assert then_s + 0.1 <= session.answer("GET", "/monitor", None)["time_s"] < then_s + 60.0


UNUSABLE = (
    ("GET", "/nothing", None, 404, "there is no GET /nothing"),
    ("GET", "/execute", None, 405, "there is no GET /execute: it answers PUT"),
    ("DELETE", "/monitor", None, 405, "there is no DELETE /monitor: it answers GET"),
    ("OPTIONS", "/execute", None, 405, "it answers PUT"),
    ("BREW", "/monitor", None, 405, "Unsupported method ('BREW')"),
    ("PUT", "/execute", b"{", 400, "not JSON"),
    ("PUT", "/execute", b"\xff\xfe", 400, "not JSON"),
    ("PUT", "/execute", b"[" * 50_000, 400, "not JSON"),
    ("PUT", "/execute", [1], 400, "expected an object"),
    ("PUT", "/execute", {SEARCH: "fd_spiral_hihg"}, 400, "did you mean 'fd_spiral_high'"),
    ("PUT", "/execute", {"f_search": "x"}, 400, "unknown key 'f_search'"),
    ("PUT", "/execute", {SEARCH: ["x"]}, 400, "no mode"),
    ("PUT", "/execute", {"advance_s": -1}, 400, "is not a time in seconds"),
    ("PUT", "/execute", {"latency_s": True}, 400, "is not a time in seconds"),
    ("POST", "/advance", {}, 400, "is not a time in seconds"),
    ("POST", "/advance", {"by": 1}, 400, "unknown key"),
    ("POST", "/start", {"seed": -3}, 400, "seed"),
    ("PUT", "/execute", b" " * 100_001, 413, "more than 100,000 bytes"),
)
"""What a client may send, with the status and the words that it gets."""


@pytest.mark.parametrize(("method", "path", "body", "status", "words"), UNUSABLE)
def test_what_it_cannot_use_is_refused(port, method, path, body, status, words):
    found, answer = request(port, method, path, body)
    assert found == status
    assert words in json.loads(answer)["error"]


def test_what_it_cannot_use_changes_nothing(port):
    before = request(port, "GET", "/monitor")
    for method, path, body, _, _ in UNUSABLE:
        request(port, method, path, body)
        assert request(port, "GET", "/monitor") == before


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Host": "rebound.example:3000"}, 421),
        ({"Host": "rebound.example"}, 421),
        ({"Host": "[::1"}, 421),
        ({"Host": ""}, 421),
        ({"Origin": "http://evil.example"}, 403),
        ({"Origin": "http://localhost:1"}, 403),
        ({"Origin": "null"}, 403),
        ({"Content_Type": "text/plain"}, 415),
        ({"Content_Type": "application/x-www-form-urlencoded"}, 415),
    ],
)
def test_a_web_page_of_somebody_else_may_neither_read_nor_steer(port, headers, status):
    before = request(port, "GET", "/monitor")
    for method, path, body in (
        ("PUT", "/execute", {SEARCH: "fd_spiral_high"}),
        ("POST", "/start", {"seed": 7}),
    ):
        found, answer = request(port, method, path, body, **headers)
        assert found == status and "error" in json.loads(answer)
    if status != 415:  # a GET has no body
        assert request(port, "GET", "/monitor", **headers)[0] == status
    assert request(port, "GET", "/monitor") == before


@pytest.mark.parametrize("host", ["localhost", "localhost:3000", "127.0.0.1:80", "[::1]:3000"])
def test_it_may_be_called_by_the_names_of_this_machine(port, host):
    own = {
        "Host": host,
        "Origin": f"http://{host}",
        "Content_Type": "application/json; charset=utf-8",
    }
    assert request(port, "POST", "/advance", {"advance_s": 1}, **own)[0] == 200


def test_the_user_may_give_this_machine_a_further_name(simulator):
    with served(simulator, host_names=["suave"]) as port:
        assert request(port, "GET", "/monitor", Host="suave:3111")[0] == 200
        assert request(port, "GET", "/monitor", Host="Suave")[0] == 200
        assert request(port, "GET", "/monitor", Host="suave.example")[0] == 421


def test_why_a_request_was_refused_is_printed_once(port, capfd):
    for _ in range(3):
        request(port, "GET", "/monitor", Host="suave:3111")
    for number in range(50):
        request(port, "GET", "/monitor", Host=f"host{number}")
    lines = capfd.readouterr().err.splitlines()
    assert lines[0].startswith("a request was refused: Host 'suave:3111' is not this server's")
    assert lines.count(lines[0]) == 1 and "--host-name" in lines[0]
    assert len(lines) == 20  # no client can fill the terminal


def test_a_head_request_gets_no_body(port):
    assert request(port, "HEAD", "/monitor") == (405, b"")


def raw(port: int, head: str) -> bytes:
    with socket.create_connection(("127.0.0.1", port), timeout=10.0) as stream:
        stream.sendall(head.encode() + b"\r\nContent-Type: application/json\r\n\r\n")
        return stream.recv(1000)


@pytest.mark.parametrize(
    ("head", "status"),
    [
        ("Transfer-Encoding: chunked", b" 400 "),
        ("Content-Length: -1", b" 400 "),
        ("Content-Length: " + "0" * 20 + "99999999999", b" 413 "),
        ("Content-Length: " + "9" * 5000, b" 413 "),
    ],
)
def test_a_body_without_a_sensible_length_is_refused(port, head, status):
    assert status in raw(port, f"PUT /execute HTTP/1.1\r\nHost: localhost\r\n{head}")


def test_clients_that_leave_in_the_middle_are_not_reported(port, capfd):
    for _ in range(50):
        stream = socket.create_connection(("127.0.0.1", port), timeout=10.0)
        # leave with a reset
        stream.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        stream.sendall(b"PUT /execute HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9")
        stream.close()
    assert request(port, "GET", "/monitor")[0] == 200
    time.sleep(0.2)
    assert capfd.readouterr().err == ""


def test_several_clients_at_once_get_whole_answers(port):
    with ThreadPoolExecutor(8) as pool:
        answers = list(
            pool.map(lambda _: request(port, "POST", "/advance", {"advance_s": 0.5}), range(40))
        )
    times_s = sorted(json.loads(body)["time_s"] for _, body in answers)
    assert times_s == [0.5 * number for number in range(1, 41)]


def test_a_port_in_use_is_bad_input(port, simulator):
    with pytest.raises(InputError, match=f"{port} cannot be used"):
        Server(Session(simulator), port=port)


def test_monitor_shows_what_the_mission_shows(port, simulator):
    found = json.loads(request(port, "POST", "/advance", {"advance_s": 50})[1])
    mission = Mission(simulator)
    mission.advance(50.0)
    assert found["water_visibility"] == mission.measured("water_visibility")
    assert found["c_thruster_1"] == "FALSE" and found[SEARCH] == mission.current_mode(SEARCH)
    assert found["x_m"] == mission.pose.x_m


def test_it_lists_its_requests(simulator, port):
    status, answer = request(port, "GET", "/")
    assert status == 200
    assert sorted(json.loads(answer)) == sorted(Session(simulator)._answers)


def test_the_schema_says_what_each_name_of_the_monitor_means(port):
    properties = json.loads(request(port, "GET", "/monitor_schema")[1])["properties"]
    assert properties.keys() == json.loads(request(port, "GET", "/monitor")[1]).keys()
    assert all(each["description"] for each in properties.values())
    assert properties["water_visibility"]["type"] == ["number", "null"]
