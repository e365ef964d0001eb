"""Managers that are programs of their own, in whatever language."""

import gc
import json
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from suave_des import Mission, Simulator, load_scenario, run_campaign, run_mission
from suave_des.campaign import campaign
from suave_des.errors import MissionError
from suave_des.interfaces import exec as programs
from tests.helpers.command import EXAMPLES, example_program, stopped_for, wait_until

HEAD = "import json, os, sys, time\nfor number, line in enumerate(sys.stdin):\n    message = json.loads(line)\n"


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    yield
    programs.end_programs()


def program(body: str) -> str:
    """Write a program whose loop over messages has a body; return the manager's name."""
    Path("program.py").write_text(HEAD + "".join(f"    {line}\n" for line in body.splitlines()))
    return f"exec:{sys.executable} program.py"


def failure(manager: str, **options: object) -> str:
    with pytest.warns(UserWarning, match="missions failed"):
        frame = run_campaign("seams2023", ["none", manager], runs=1, **options)  # type: ignore[arg-type]
    assert len(frame) == 1  # the other manager's mission is there
    return str(frame.attrs["failures"][0]["cause"])


EVERY_PERIOD = """
answer = {}
if message["type"] == "mission_started":
    answer = {"period_s": 2.0, "subscribes_to": ["component_status"]}
elif message["type"] == "adapt" and (message["measured"]["water_visibility"] or 0.0) >= 3.25:
    answer = {"modes": {"f_generate_search_path": "fd_spiral_high"}, "log": ["higher"]}
print(json.dumps(answer), flush=True)
"""


@pytest.mark.parametrize("language", EXAMPLES)
def test_the_examples_carry_out_the_same_missions(language, tmp_path):
    (tmp_path / "same.py").write_text(SAME)
    frame = run_campaign("seams2023", ["same:Same", f"exec:{example_program(language)}"], runs=5)
    one, other = (
        part.reset_index(drop=True) for _, part in frame.groupby("manager", observed=True)
    )
    assert (one["search_time_s"] == other["search_time_s"]).all()
    assert (one["distance_inspected_m"] == other["distance_inspected_m"]).all()


SAME = '''
from suave_des.managing.simple import Threshold

class Same(Threshold):
    """The examples, in this process."""
    def __init__(self, system):
        super().__init__(system)
        self.starts_s = 0.0
        self.thresholds_m, self.search_modes = (3.25, 2.25), ("fd_spiral_high", "fd_spiral_medium")

    def wanted(self, visibility_m):
        for function, mode in super().wanted(visibility_m or 0.0):
            is_low = function == "f_generate_search_path" and (visibility_m or 0.0) < 2.25
            yield function, "fd_spiral_low" if is_low else mode
'''


def test_what_it_says_stands_in_the_timeline():
    events = run_mission("seams2023", program(EVERY_PERIOD), 1, 1).events
    assert next(each.detail for each in events if each.event == "says") == "higher"


THINKS = """
answer = {}
if message["type"] == "mission_started":
    answer = {"period_s": 2.0, "starts_s": 1.0, "subscribes_to": ["component_status"]}
elif message["type"] == "adapt":
    answer = {"modes": {"f_generate_search_path": "fd_spiral_high"}, "latency_s": 3.0}
print(json.dumps(answer), flush=True)
"""


def requested_s(body: str) -> list[float]:
    """Return when a program requests to search high."""
    values = {"mission.time_limit_s": 20.0}
    return [
        each.t_s
        for each in run_mission("release15", program(body), 1, 1, values=values).events
        if each.event == "mode_requested" and each.detail == HIGHER
    ]


HIGHER = "f_generate_search_path -> fd_spiral_high"


def test_mission_time_passes_while_it_thinks():
    assert requested_s(THINKS) == [1.0 + 3.0]


def test_it_is_not_asked_to_adapt_while_it_thinks_of_it():
    requested_s("open('messages', 'a').write(line)\n" + THINKS)
    messages = [json.loads(line) for line in Path("messages").read_text().splitlines()]
    asked_s = [each["time_s"] for each in messages if each["type"] == "adapt"]
    assert asked_s[:3] == [1.0, 5.0, 9.0]


def test_it_thinks_of_one_message_after_the_other():
    first = THINKS.replace("answer = {}", 'answer = {"latency_s": 2.5}')
    assert requested_s(first) == [2.5 + 3.0]  # the task's request comes at t = 0


def test_thinking_before_adaptations_is_a_further_metric():
    values = {"metrics": ["reasoning_time_s"]}
    result = run_mission("seams2023", program(THINKS), 1, 1, values=values)
    changes = [each for each in result.events if each.detail == HIGHER]
    assert result.further["reasoning_time_s"] == 3.0 * len(changes) > 0.0


def test_wall_time_may_count_as_thinking():
    slow = EVERY_PERIOD.replace("answer = {}", "answer = {}; time.sleep(0.02)", 1)
    manager = program(slow)
    values = {"metrics": ["reasoning_time_s"], "mission.time_limit_s": 60.0}
    options = {"manager_options": {manager: {"real_thinking": 50.0}}}
    further = run_mission("seams2023", manager, 1, 8, values=values, **options).further
    assert further["reasoning_time_s"] >= 0.02 * 50.0


def test_it_is_told_what_happens():
    note = "open('messages', 'a').write(line)\n"
    run_mission("seams2023", program(note + EVERY_PERIOD), 1, 1)

    messages = [json.loads(line) for line in Path("messages").read_text().splitlines()]
    first, last = messages[0], messages[-1]
    assert first["type"] == "mission_started" and first["protocol"] == 1
    assert "fd_spiral_high" in first["functions"]["f_generate_search_path"]
    assert last["type"] == "mission_ended" and last["metrics"]["run"] == 1
    assert {"task_requested", "task_cancelled", "adapt", "diagnostic"} <= {
        each["type"] for each in messages
    }
    assert [each["time_s"] for each in messages] == sorted(each["time_s"] for each in messages)


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("time.sleep(60)", "gave no answer within 0.5 s"),
        (
            "print('{', end='', flush=True); time.sleep(60)",
            "gave no answer but half a line within 3 s",
        ),
        ("sys.exit(7)", "ProgramError: the program ended with status 7"),
        ("os.kill(os.getpid(), 9)", "ended with status -9"),
        ("sys.stdout.close(); os.close(1); time.sleep(60)", "closed its output"),
        ("print('good morning', flush=True)", "answered 'good morning', which is not JSON"),
        ("print('x' * 10_000_000, flush=True)", "line of more than 1,000,000 bytes"),
        ("print('{}\\n{}', flush=True)", "more than one line"),
        ("print('{\"mode\": {}}', flush=True)", "did you mean 'modes'"),
        ("print('{\"protocol\": 2}', flush=True)", "does not speak version 1"),
        ('print(\'{"period_s": "often"}\', flush=True)', "to mission_started"),
        ('print(\'{"subscribes_to": ["poses"]}\', flush=True)', "did you mean 'pose'"),
        ('print(\'{"period_s": 2, "starts_s": -50}\', flush=True)', "starts_s is -50.0"),
        ('print(\'{"depends_on": {"water_visibility": [NaN]}}\', flush=True)', "depends_on is"),
        (
            'print(\'{"modes": {"f_generate_search_path": "fd_spiral_hihg"}}\', flush=True)',
            "'fd_spiral_high'",
        ),
        ("print('{\"modes\": [1]}', flush=True)", "modes is an object"),
        ("print('{\"latency_s\": -1}', flush=True)", "a latency_s of -1"),
        ("print('{\"latency_s\": NaN}', flush=True)", "a latency_s of .nan"),
    ],
)
def test_a_program_that_misbehaves_ends_its_mission_with_a_clear_error(body, words):
    manager = program(body)
    told = re.search(r"within (\S+) s", words)
    # a busy machine takes its time to start a program
    time_out_s = float(told[1]) if told else 60.0
    assert words in failure(manager, manager_options={manager: {"time_out_s": time_out_s}})


def test_after_a_failure_the_next_mission_begins_with_a_new_program():
    once = "if not os.path.exists('once'):\n    open('once', 'w'); sys.exit(1)\n"
    with pytest.warns(UserWarning, match="1 of 3 missions failed"):
        frame = run_campaign("seams2023", [program(once + EVERY_PERIOD)], runs=3)
    assert frame["run"].tolist() == [2, 3]


WITH_A_CHILD = """
if number == 0:
    import subprocess
    child = subprocess.Popen(["sleep", "600"])
    with open("pids", "a") as pids:
        pids.write(f"{os.getpid()} {child.pid}\\n")
"""


def assert_all_ended() -> None:
    pids = Path("pids").read_text().split()
    wait_until(lambda: not any(Path("/proc", pid).exists() for pid in pids), 10.0)


@pytest.mark.usefixtures("quick_workers")
def test_all_processes_of_programs_end_with_the_campaign():
    run_campaign("seams2023", [program(WITH_A_CHILD + EVERY_PERIOD)], runs=2, workers=2)
    assert_all_ended()


def test_the_children_of_a_program_that_fails_end_with_its_mission():
    # A child that holds its output does not hide that the program has ended.
    assert "ended with status 1" in failure(program(WITH_A_CHILD + "sys.exit(1)\n"))
    assert_all_ended()


@pytest.mark.parametrize(
    ("workers", "number"),
    [
        (1, signal.SIGINT),
        pytest.param(2, signal.SIGINT, marks=pytest.mark.slow),
        pytest.param(1, signal.SIGKILL, marks=pytest.mark.slow),
    ],
)
def test_all_processes_of_programs_end_when_the_campaign_is_stopped(workers, number):
    manager = program(WITH_A_CHILD + "time.sleep(600)\n")
    options = (
        "--manager-option",
        "time_out_s=600",
        "--workers",
        str(workers),
        "--runs",
        "9",
        "--out",
        "out",
    )
    command = (
        sys.executable,
        "-m",
        "suave_des",
        "campaign",
        "seams2023",
        "--managers",
        manager,
        *options,
    )
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        wait_until(
            lambda: Path("pids").exists() and len(Path("pids").read_text().splitlines()) >= workers
        )
        process.send_signal(number)
    assert_all_ended()


def test_the_programs_files_are_hashed(tmp_path):
    run_campaign("seams2023", [program(EVERY_PERIOD)], runs=1, out=tmp_path / "out")
    assert '"program.py"' in (tmp_path / "out" / "manifest.json").read_text()


NOTES_ITS_RUN = """
seeds = globals().setdefault("seeds", [])
if message["type"] == "mission_started":
    seeds.append(message["seed"])
with open("heard", "a") as heard:
    heard.write(json.dumps([os.getpid(), len(seeds), message["type"], seeds[-1]]) + "\\n")
print("{}", flush=True)
"""


def heard() -> list[tuple[int, int, str, int]]:
    """What programs have heard: process, number of missions begun in it, message, seed."""
    return [tuple(json.loads(line)) for line in Path("heard").read_text().splitlines()]


def test_missions_under_way_at_a_time_have_a_program_each():
    manager = program(NOTES_ITS_RUN)
    one, other = (Mission("seams2023", manager, run=run) for run in (1, 2))
    for until_s in (10.0, 20.0):
        one.advance(until_s)
        other.advance(until_s)
    assert {begun for _, begun, _, _ in heard()} == {1}


def test_missions_one_after_the_other_have_the_same_program():
    run_campaign("seams2023", [program(NOTES_ITS_RUN)], runs=2)
    assert len({process for process, _, _, _ in heard()}) == 1


def test_a_mission_that_is_left_leaves_its_program_to_the_next():
    simulator, manager = Simulator(load_scenario("seams2023")), program(NOTES_ITS_RUN)
    for run in (1, 2):
        mission = Mission(simulator, manager, run=run)
        mission.advance(10.0)
        mission.close()
        del mission
        gc.collect()
    assert len({process for process, _, _, _ in heard()}) == 1


@pytest.mark.parametrize(
    ("body", "is_lasting"), [("sys.exit(7)", True), ("os.kill(os.getpid(), 9)", False)]
)
def test_that_a_program_was_killed_need_not_happen_again(body, is_lasting):
    result = campaign.run_campaign("seams2023", [program(body)], 1, 1)
    assert [each.lasting for each in result.failures] == [is_lasting]


ONCE_LATE = """
if not os.path.exists("late"):
    open("late", "w").close()
    time.sleep(60)
"""


def test_a_mission_whose_program_was_late_is_run_again_when_the_campaign_is_resumed(tmp_path):
    manager = program(ONCE_LATE + EVERY_PERIOD)
    options = {"manager_options": {manager: {"time_out_s": 3.0}}}
    first = campaign.run_campaign("seams2023", [manager], 1, 1, out=tmp_path / "out", **options)
    assert [each.lasting for each in first.failures] == [False]
    assert campaign.resume_campaign(tmp_path / "out").done == 1


def test_a_program_that_is_stopped_with_the_campaign_is_waited_for():
    Path("program.py").write_text(HEAD + "    time.sleep(0.2); print('{}', flush=True)\n")
    done = stopped_for(
        3.0,
        """
import sys
from suave_des.interfaces.exec import _Program

program = _Program((sys.executable, "program.py"))
program.ask({}, 60.0)
print(program._process.pid, flush=True)
program.ask({}, 2.0)
program.end()
""",
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_a_period_that_would_stop_the_clock_is_refused():
    answer = "answer = {'period_s': 1e-12} if message['type'] == 'mission_started' else {}"
    with pytest.raises(MissionError, match=r"period_s is 1e-12, .* at least 0\.001 and 0"):
        run_mission("seams2023", program(f"{answer}\nprint(json.dumps(answer), flush=True)"))
