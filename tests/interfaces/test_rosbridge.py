"""SUAVE's topics and services over the rosbridge protocol: what a manager written for SUAVE may expect,
and what a server may expect of clients.
"""

import json
import subprocess
import sys
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from http.client import HTTPConnection
from math import cos, sin
from pathlib import Path
from socket import SHUT_RDWR
from typing import Self

import pytest
from doc_blocks import ROOT, blocks_of
from scipy.spatial.transform import Rotation
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from suave_des import InputError, Mission
from suave_des.campaign.campaign import CampaignInterrupted, fly_campaign
from suave_des.campaign.missions import Campaign, Finished, MissionKey
from suave_des.errors import MissionError
from suave_des.interfaces.client import ClientManager
from suave_des.interfaces.rosbridge import TOPICS, Bridge
from suave_des.simulation.simulator import Simulator
from suave_des.vehicle.model import Pose
from tests.helpers.command import command_here, wait_until

SEARCH, MOTION = "f_generate_search_path", "f_maintain_motion"
ADVANCE = "/suave_des/advance"
SHORT = {"mission.time_limit_s": 60.0}
LOW, HIGH = "fd_spiral_low", "fd_spiral_high"


class Client:
    """A client that speaks the protocol plainly."""

    def __init__(self, port: int, **options: object) -> None:
        self.port, self._connecting = port, connect(f"ws://127.0.0.1:{port}", **options)
        self.published: list[dict] = []

    def __enter__(self) -> Self:
        self.socket = self._connecting.__enter__()
        return self

    def __exit__(self, *error: object) -> None:
        self._connecting.__exit__(*error)

    def send(self, op: str, **content: object) -> None:
        self.socket.send(json.dumps({"op": op, **content}))

    def receive(self, *ops: str) -> dict:
        """Return the next message that is one of these operations; keep what is published until
        then.
        """
        while True:
            message = json.loads(self.socket.recv(timeout=20.0))
            if message["op"] in ops:
                return message
            assert message["op"] == "publish"
            self.published.append(message)

    def answer(self, service: str, **arguments: object) -> dict:
        self.send("call_service", id="1", service=service, args=arguments)
        return self.receive("service_response")

    def call(self, service: str, **arguments: object) -> dict:
        answer = self.answer(service, **arguments)
        assert answer["result"], answer
        return answer["values"]

    def advance(self, seconds: float) -> dict:
        return self.call(ADVANCE, advance_s=seconds)

    def refusal(self, text: str | bytes) -> str:
        self.socket.send(text)
        status = self.receive("status")
        assert status["level"] == "error"
        return status["msg"]


class Served:
    """A campaign that is flown with clients, in a thread."""

    def __init__(self, factor: float, **options: object) -> None:
        self.factor, self.options = factor, options
        self.port, self.rows = 0, []
        self._is_open = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()
        assert self._is_open.wait(20.0)

    def _serve(self) -> None:
        given = {"scenario": "seams2023", "runs": 1, "seed": 8, **self.options}
        with Bridge(port=0, real_time_factor=self.factor) as bridge:
            self.port, self.bridge = bridge.port, bridge
            self._is_open.set()
            result = fly_campaign(bridge.outcomes, manager="client:test", time_out_s=1e6, **given)
        self.rows = [dict(zip(result.columns, row, strict=True)) for row in result.rows]

    def wait(self) -> None:
        """Wait until all missions are over, and the rows of their results are there."""
        self._thread.join(60.0)


@contextmanager
def served(factor: float = 0.0, **options: object) -> Iterator[tuple[Served, Client]]:
    """Serve missions, with a client that ends those that the test leaves."""
    server = Served(factor, **options)
    with Client(server.port) as client:
        yield server, client
        try:
            while True:
                client.advance(1e6)
        except ConnectionClosed:
            server.wait()


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    """A client of a mission whose time stands still, for tests that let it."""
    with served() as (_, client):
        client.advance(1.0)
        yield client


@pytest.fixture
def no_server(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have no server in this process, though one serves the tests before."""
    monkeypatch.setattr(ClientManager, "bridges", set())


def other(client: Client, **options: object) -> Client:
    return Client(client.port, **options)


def search(client: Client) -> None:
    """Fly a mission in steps of 4 s, as high as the last published visibility allows."""
    client.send("subscribe", topic="/diagnostics", type="diagnostic_msgs/msg/DiagnosticArray")
    is_over, visibility_m = False, 0.0
    while not is_over:
        is_over = client.advance(4.0)["is_over"]
        for message in client.published:
            (status,) = message["msg"]["status"]
            if status["message"] == "QA status":
                visibility_m = float(status["values"][0]["value"])
        client.published.clear()
        if not is_over:
            client.call(f"/{SEARCH}/change_mode", mode_name=HIGH if visibility_m >= 3.25 else LOW)


def test_an_unmodified_roslibpy_manager_flies_missions_to_their_end(tmp_path: Path):
    (script,) = (
        block.text
        for block in blocks_of(ROOT / "docs" / "guides" / "ros-managers.md")
        if block.marks.get("title") == "manager.py"
    )
    (tmp_path / "manager.py").write_text(script)
    server = Served(50.0, runs=2, values=SHORT, out=tmp_path / "out")
    command = [sys.executable, "manager.py", str(server.port)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.stdout == "last requested: fd_all_thrusters\n", done.stderr  # they are recovered
    server.wait()
    assert [(row["manager"], row["run"]) for row in server.rows] == [
        ("client:test", 1),
        ("client:test", 2),
    ]
    assert all(row["mean_reaction_time_s"] > 0.0 for row in server.rows)
    assert len((tmp_path / "out" / "runs.csv").read_text().splitlines()) == 3
    assert "do not repeat" in (tmp_path / "out" / "manifest.json").read_text()


def test_in_lock_step_it_is_the_mission_of_the_same_decisions_in_python():
    with served(values=SHORT) as (server, client):
        search(client)
    mission = Mission("seams2023", run=1, seed=8, values=SHORT)
    mission.advance(1e-6)
    while not mission.is_over:
        mission.advance(mission.now_s + 4.0)
        is_high = mission.measured("water_visibility", 0.0) >= 3.25
        if not mission.is_over:
            mission.change_mode(SEARCH, HIGH if is_high else LOW)
    (row,), metrics = server.rows, mission.metrics()
    assert row["adaptations"] == metrics.adaptations > 1
    assert row["search_time_s"] == metrics.search_time_s
    assert row["distance_inspected_m"] == pytest.approx(metrics.distance_inspected_m, rel=1e-6)


def test_diagnostics_are_those_of_the_exemplar_s_monitors():
    with served() as (_, client):
        client.send("subscribe", topic="/diagnostics", type="diagnostic_msgs/DiagnosticArray")
        client.advance(40.0)
        messages = [each["msg"] for each in client.published]
    statuses = [status for message in messages for status in message["status"]]
    measured = [each for each in statuses if each["message"] == "QA status"]
    assert len(measured) == pytest.approx(40.0 / 0.2, abs=2)  # repeated values, too
    assert measured[0]["values"] == [{"key": "water_visibility", "value": "3.75"}]
    assert measured[0] | {"values": []} == {
        "level": 0,
        "name": "",
        "message": "QA status",
        "hardware_id": "",
        "values": [],
    }
    (failure,) = (each for each in messages if each["status"][0]["message"] == "Component status")
    assert failure["status"][0]["values"] == [{"key": "c_thruster_1", "value": "FALSE"}]
    assert 35 <= failure["header"]["stamp"]["sec"] <= 37


@pytest.mark.parametrize(
    ("topic", "period_s"),
    [("/clock", 0.1), ("/mavros/local_position/pose", 0.25), ("/pipeline/detected", 1.0)],
)
def test_topics_have_their_rates_in_mission_time(client, topic, period_s):
    client.published.clear()
    client.send("subscribe", topic=topic, type=TOPICS[topic])
    client.advance(2.0)
    client.send("unsubscribe", topic=topic)
    assert len(client.published) == pytest.approx(2.0 / period_s, abs=1)


def test_all_that_a_long_step_publishes_arrives_before_its_answer():
    with served(values=SHORT) as (_, client):
        for topic in TOPICS:
            client.send("subscribe", topic=topic)
        client.advance(55.0)
        clocks = [each["msg"]["clock"] for each in client.published if each["topic"] == "/clock"]
    assert [each["sec"] * 10 + round(each["nanosec"] / 1e8) for each in clocks] == [*range(551)]


@pytest.fixture(scope="module")
def after_45_s() -> tuple[dict, dict]:
    """The last clock, and the last pose, that are published in a mission's first 45 s."""
    with served() as (_, client):
        client.send("subscribe", topic="/mavros/local_position/pose")
        client.send("subscribe", topic="clock", type="rosgraph_msgs/msg/Clock")
        client.advance(45.05)
        *_, clock = (each for each in client.published if each["topic"] == "clock")
        *_, posed = (each["msg"] for each in client.published if each["topic"] != "clock")
    return clock["msg"], posed


@pytest.fixture(scope="module")
def pose(simulator: Simulator) -> Pose:
    """The pose of that mission then."""
    mission = Mission(simulator, run=1, seed=8)
    mission.advance(45.0)
    return mission.pose


def test_the_clock_is_that_of_the_mission(after_45_s):
    clock, _ = after_45_s
    assert clock == {"clock": {"sec": 45, "nanosec": 0}}


def test_the_pose_has_the_mission_time(after_45_s):
    _, posed = after_45_s
    assert posed["header"] == {"stamp": {"sec": 45, "nanosec": 0}, "frame_id": "map"}


def test_the_position_is_that_of_the_mission(after_45_s, pose):
    _, posed = after_45_s
    assert [*posed["pose"]["position"].values()] == pytest.approx(pose[:3], abs=1e-6)


def test_the_orientation_is_that_of_the_mission(after_45_s, pose):
    _, posed = after_45_s
    turned = posed["pose"]["orientation"]
    ahead = Rotation.from_quat([turned[axis] for axis in "xyzw"]).apply([1.0, 0.0, 0.0])
    _, pitch_rad, yaw_rad = pose[3:]  # first roll, then pitch, then yaw (Fossen, 2.2)
    level = cos(pitch_rad)
    forwards = [cos(yaw_rad) * level, sin(yaw_rad) * level, -sin(pitch_rad)]
    assert ahead == pytest.approx(forwards, abs=1e-9)


def test_the_first_sight_of_the_pipeline_is_published_at_once():
    with served() as (server, client):
        for topic in ("/clock", "/pipeline/detected"):
            client.send("subscribe", topic=topic)
        client.advance(1e6)
        published = list(client.published)
    first = next(number for number, each in enumerate(published) if each["msg"].get("data"))
    *_, clock = (each["msg"]["clock"] for each in published[:first] if each["topic"] == "/clock")
    (row,) = server.rows
    assert clock["sec"] + clock["nanosec"] / 1e9 == pytest.approx(
        row["detection_time_s"], abs=0.1 + 1e-6
    )


def test_a_throttled_topic_is_dropped_or_kept_in_its_queue():
    with served() as (_, client):
        client.send("subscribe", topic="/clock", throttle_rate=300)
        client.send(
            "subscribe", topic="clock", type=TOPICS["/clock"], throttle_rate=300, queue_length=2
        )
        client.advance(5.0)
        client.send("unsubscribe", topic="/clock")
        time.sleep(0.7)
        client.advance(0.01)
        published = list(client.published)
    seconds = [(each["topic"], each["msg"]["clock"]["sec"]) for each in published]
    assert seconds[:2] == [("/clock", 0), ("clock", 0)]
    assert seconds[2:] == [("clock", 4), ("clock", 5)]


def test_services_answer_as_system_modes(client, simulator):
    modes = Mission(simulator).modes[SEARCH]
    found = client.call(f"/{SEARCH}/get_available_modes")
    assert found == {"available_modes": list(modes)}
    assert client.call(f"/{SEARCH}/change_mode", mode_name=HIGH) == {"success": True}
    assert client.call(f"/{SEARCH}/change_mode", mode_name="fd_spiral_hihg") == {"success": False}
    asked = client.call(f"/{SEARCH}/get_mode")
    assert asked["target_mode"] == HIGH
    client.advance(5.0)
    assert client.call(f"{SEARCH}/get_mode") == {"current_mode": HIGH, "target_mode": HIGH}


def test_where_nobody_offers_the_task_services_the_default_modes_are_set():
    with served(values=SHORT) as (_, client):
        client.advance(0.1)
        assert client.call(f"/{SEARCH}/get_mode")["target_mode"] == LOW


def test_a_client_that_offers_the_task_services_is_asked_instead():
    with served(values=SHORT) as (_, client):
        client.send("advertise_service", service="/task/request", type="suave_msgs/srv/Task")
        client.send("call_service", service=ADVANCE, args=[0.1])
        asked = client.receive("call_service")
        assert asked["service"] == "/task/request"
        assert asked["args"] == {"task_name": "search_pipeline"}
        client.receive("service_response")
        client.send(
            "service_response", service="/task/request", id=asked["id"], values={}, result=True
        )
        assert client.call(f"/{SEARCH}/get_mode")["target_mode"] == ""


def test_thinking_time_that_a_client_tells_passes_first():
    values = {"metrics": ["reasoning_time_s"]}
    with served(values=values) as (server, client):
        client.advance(10.0)
        client.call(f"/{SEARCH}/change_mode", mode_name=HIGH, latency_s=3.0)
        client.advance(2.9)
        assert client.call(f"/{SEARCH}/get_mode")["target_mode"] == LOW
        client.advance(0.2)
        assert client.call(f"/{SEARCH}/get_mode")["target_mode"] == HIGH
        client.advance(1e6)
    assert server.rows[0]["reasoning_time_s"] == 3.0


def test_in_real_time_a_mission_begins_when_a_client_takes_part():
    with served(20.0) as (_, client):
        time.sleep(0.3)
        client.send("subscribe", topic="/clock", throttle_rate=10)
        began_s = time.monotonic()
        times_s = []
        while len(times_s) < 2 or times_s[-1] < 10.0:
            clock = client.receive("publish")["msg"]["clock"]
            times_s.append(clock["sec"] + clock["nanosec"] / 1e9)
        assert times_s[0] == 0.0
        assert time.monotonic() - began_s >= 10.0 / 20.0


UNUSABLE = (
    ("{", "not JSON"),
    ("[" * 50_000, "not JSON"),
    (b"\xff\xfe", "not JSON"),
    ("[1]", "unknown operation nothing; known: advertise"),
    ('{"op": ["subscribe"]}', "unknown operation"),
    ('{"op": "auth", "mac": "x"}', "unknown operation 'auth'"),
    ('{"op": "subscribe"}', "topic is nothing"),
    ('{"op": "subscribe", "topic": "/diagnostic"}', "did you mean '/diagnostics'"),
    ('{"op": "subscribe", "topic": "/clock", "type": "std_msgs/Bool"}', "is of type rosgraph"),
    ('{"op": "subscribe", "topic": "/clock", "throttle_rate": NaN}', "throttle_rate is .nan"),
    ('{"op": "subscribe", "topic": "/clock", "queue_length": -1}', "queue_length is -1"),
    ('{"op": "subscribe", "topic": "/clock", "compression": "png"}', "no compression"),
    ('{"op": "publish", "topic": "/clock", "msg": {}}', "is published by the mission"),
    ('{"op": "advertise", "topic": "/mine"}', "type is nothing"),
    ('{"op": "advertise_service", "service": "/x", "type": "y"}', "nobody here would call"),
    ('{"op": "call_service"}', "service is nothing"),
    (
        '{"op": "set_level", "level": "errors"}',
        "there is no level 'errors' (did you mean 'error'",
    ),
)
"""Messages of a client, with the words that it gets."""


@pytest.mark.parametrize(("text", "words"), UNUSABLE)
def test_what_it_cannot_use_gets_a_status_message(client, text, words):
    assert words in client.refusal(text)


def test_what_it_cannot_use_changes_nothing(client):
    before = client.call(f"/{SEARCH}/get_mode")
    for text, _ in UNUSABLE:
        client.refusal(text)
        assert client.call(f"/{SEARCH}/get_mode") == before


@pytest.mark.parametrize(
    ("service", "arguments", "words"),
    [
        (f"/{SEARCH}/chnage_mode", {}, f"did you mean '/{SEARCH}/change_mode'"),
        ("/f_search/get_mode", {}, "there is no service '/f_search/get_mode'"),
        ("/rosapi/topics", {}, "there is no service"),
        (f"/{SEARCH}/change_mode", {}, "mode_name is nothing"),
        (f"/{SEARCH}/change_mode", {"mode": HIGH}, "did you mean 'mode_name'"),
        (f"/{SEARCH}/change_mode", {"mode_name": HIGH, "latency_s": -1}, "not a time in seconds"),
        (ADVANCE, {"advance_s": "2"}, "not a time in seconds"),
    ],
)
def test_a_call_that_cannot_be_answered_fails_with_its_reason(client, service, arguments, words):
    answer = client.answer(service, **arguments)
    assert answer["result"] is False and words in answer["values"] and answer["id"] == "1"


def test_a_client_that_wants_no_status_messages_gets_none(client):
    with other(client) as one:
        one.send("set_level", level="none")
        one.socket.send("{")
        assert one.call(f"/{MOTION}/get_mode")  # and no status before it


def test_a_thousand_subscriptions_are_too_many(client):
    with other(client) as one:
        for number in range(1000):
            one.send("subscribe", topic=f"/mine/{number}", type="std_msgs/Bool")
        for _ in range(900):
            assert "has 100 of them" in one.receive("status")["msg"]
        assert one.call(f"/{MOTION}/get_mode")


def test_a_message_of_a_megabyte_ends_its_connection_only(client):
    with other(client) as one, pytest.raises(ConnectionClosed) as closed:
        one.socket.send('{"op": "' + "x" * 1_000_000)
        one.receive("status")
    assert closed.value.rcvd.code == 1009  # message too big
    assert client.call(f"/{MOTION}/get_mode")


def test_a_client_may_leave_in_the_middle_of_a_call(client, capfd):
    for _ in range(20):
        with other(client) as one:
            one.send("subscribe", topic="/clock")
            one.send("call_service", service=f"/{MOTION}/get_mode")
            one.socket.socket.shutdown(SHUT_RDWR)
    client.advance(0.5)
    assert client.call(f"/{MOTION}/get_mode")
    assert capfd.readouterr().err == ""


def test_a_client_that_reads_nothing_holds_nobody_up():
    with served() as (_, client), other(client, max_queue=1, close_timeout=0.1) as one:
        one.send("subscribe", topic="/mavros/local_position/pose")
        client.advance(100.0)
        assert client.call(f"/{MOTION}/get_mode")


def test_a_client_that_never_reads_its_answers_is_forgotten_when_it_leaves():
    with served(values=SHORT) as (server, client):
        with other(client, max_queue=1, close_timeout=0.1) as one:
            for topic in ("/clock", "/large"):
                one.send("subscribe", topic=topic, type=TOPICS.get(topic, "std_msgs/String"))
            wait_until(lambda: any(each.subscriptions for each in server.bridge._clients))
            for _ in range(150):  # more than sockets hold
                client.send("publish", topic="/large", msg={"data": "x" * 90_000})
            client.advance(55.0)
            one.send("call_service", service=f"/{MOTION}/get_mode")
            time.sleep(0.1)
        wait_until(lambda: len(server.bridge._clients) == 1, 10.0)


def test_a_mission_goes_on_when_another_server_of_the_process_has_ended():
    with served() as (_, client):
        with served(values=SHORT):
            pass
        client.advance(1.0)
        client.call(f"/{SEARCH}/change_mode", mode_name=HIGH)
        client.advance(100.0)  # the pipeline is found at 81 s
        found = client.call("/f_follow_pipeline/get_mode")
        assert found["target_mode"] == "fd_follow_pipeline"


def test_clients_that_connect_twice_see_the_same_mission(client):
    with other(client) as one, other(client) as two:
        assert two.call(f"/{MOTION}/get_mode") == one.call(f"/{MOTION}/get_mode")


def test_a_client_gets_what_another_publishes(client):
    with other(client) as one, other(client) as two:
        one.send("advertise", topic="/plan", type="std_msgs/String")
        assert one.call(f"/{MOTION}/get_mode")
        two.send("subscribe", topic="/plan")
        assert two.call(f"/{MOTION}/get_mode")
        one.send("publish", topic="/plan", msg={"data": "higher"})
        message = {"op": "publish", "topic": "/plan", "msg": {"data": "higher"}}
        assert two.receive("publish") == message


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Host": "rebound.example:9090"}, 421),
        ({"Origin": "http://evil.example"}, 403),
        ({"Origin": "null"}, 403),
        ({}, 101),
    ],
)
def test_a_web_page_of_somebody_else_cannot_connect(client, headers, status):
    connection = HTTPConnection("127.0.0.1", client.port, timeout=10.0)
    upgrade = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13"}
    key = {"Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ=="}
    connection.request("GET", "/", headers={**upgrade, **key, **headers})
    assert connection.getresponse().status == status


def test_there_is_an_end_to_clients(client):
    with ExitStack() as stack:
        for _ in range(31):
            stack.enter_context(other(client))
        with pytest.raises(InvalidStatus) as refused:
            stack.enter_context(other(client))
    assert refused.value.response.status_code == 503
    assert client.call(f"/{MOTION}/get_mode")


def test_a_port_in_use_is_bad_input(client):
    with (
        pytest.raises(InputError, match="cannot be used"),
        Bridge(port=client.port),
    ):
        pass


@pytest.mark.usefixtures("no_server")
@pytest.mark.parametrize(
    "words",
    [
        ("campaign", "seams2023", "--managers", "client:x", "--out", "x"),
        ("run", "seams2023", "--manager", "client:x"),
    ],
)
def test_without_a_server_a_command_says_what_flies_its_missions(words, tmp_path):
    done = command_here(*words, cwd=tmp_path)
    assert done.returncode == 2 and "suave-des serve SCENARIO --rosbridge" in done.stderr


def test_the_rest_of_an_interrupted_campaign_is_not_said_to_be_for_another_command(tmp_path):
    def interrupted(
        campaign: Campaign, missions: Iterable[MissionKey], total: int
    ) -> Iterator[list[Finished]]:
        yield [campaign.failed(next(iter(missions)), "the client left")]
        raise KeyboardInterrupt

    with Bridge(port=0), pytest.raises(CampaignInterrupted) as raised:
        fly_campaign(interrupted, "seams2023", "client:mine", runs=2, out=tmp_path / "out")
    assert "0 of 2 missions" in str(raised.value)
    assert "--resume" not in str(raised.value)


@pytest.mark.usefixtures("no_server")
def test_without_a_server_a_mission_has_no_client():
    with pytest.raises(MissionError, match="are clients of a server"):
        Mission("seams2023", "client:x").advance(10.0)


def test_without_websockets_it_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "suave_des.interfaces.rosbridge", None)
    done = command_here("serve", "seams2023", "--rosbridge", cwd=tmp_path)
    assert done.returncode == 2 and "pip install 'suave-des[rosbridge]'" in done.stderr


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (["--runs", "2"], "--runs cannot be used without --rosbridge"),
        (["--rosbridge", "--run", "2"], "--run cannot be used with --rosbridge"),
        (["--rosbridge", "--real-time-factor", "-1"], "real-time factor: -1 is out of range"),
    ],
)
def test_options_of_the_other_form_are_refused(words, problem, tmp_path):
    done = command_here("serve", "seams2023", *words, cwd=tmp_path)
    assert done.returncode == 2 and problem in done.stderr
