"""The command line: exit statuses, one line for an error, and what each command prints and
writes.
"""

import io
import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from suave_des.cli.console import PlainConsole, print_timeline
from suave_des.kb.knowledge_base import KnowledgeBase
from suave_des.scenario.loader import load_scenario
from suave_des.simulation.simulator import Simulator
from tests.helpers import rows_of

FILE = "campaign: 1\nscenario: seams2023\nmanagers: [none]\n"

MANAGER = """
from suave_des.managing.simple import NoManager

class Mine(NoManager):
    def task_requested(self, task):
        self.system.log("thinking", f"about {task.name}")
        super().task_requested(task)

class Raises(NoManager):
    def task_requested(self, task):
        if task.name == "inspect_pipeline":
            raise RuntimeError("never seen a pipeline before")
        super().task_requested(task)
"""


@pytest.mark.parametrize(
    ("begun", "offered"),
    [
        ("suave-des run release", "release15"),
        ("suave-des campaign seams2023 --managers none,meta", "none,metacontrol"),
        ("suave-des compare out --metrics search", "search_time_s"),
    ],
)
def test_a_shell_completes_names(command, monkeypatch, begun, offered):
    monkeypatch.setenv("_SUAVE_DES_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", begun)
    monkeypatch.setenv("COMP_CWORD", str(len(begun.split()) - 1))
    assert command("").out.split() == [offered]


def test_names_with_a_blank_between_them_are_told_of_the_comma(command):
    ended = command("campaign", "seams2023", "--managers", "none", "metacontrol", "--out", "out")
    assert ended.status == 2 and "several names have commas between them" in ended.err


def test_a_folder_with_brackets_is_named_as_it_is(command):
    folder = "new[b] :car:"
    ended = command(
        "campaign",
        "seams2023",
        "--managers",
        "none",
        "--runs",
        "1",
        "--workers",
        "1",
        "--out",
        folder,
    )
    assert ended.out.endswith(f"\n1 mission is in {folder}/runs.csv\n")


@pytest.mark.parametrize("quiet", [(), ("--quiet",)])
@pytest.mark.parametrize(
    "arguments",
    [
        ("campaign", "seams2023", "--managers", "none", "--out", "out"),
        ("reproduce",),
        ("validate", "--managers", "none"),
    ],
    ids=lambda arguments: arguments[0],
)
def test_progress_is_on_stderr_unless_quiet(arguments, quiet, command, monkeypatch):
    monkeypatch.setattr("suave_des.campaign.progress._FIRST_LINE_S", 0.0)
    ended = command(*arguments, "--runs", "2", "--workers", "1", *quiet)
    assert ended.status == 0
    assert ("missions" in ended.err) == (not quiet)
    assert not re.search(r"\d of \d+ missions", ended.out)


def test_reproduce_shows_all_managers_that_were_written_for_the_exemplar(command):
    ended = command("reproduce", "--managers", "all", "--runs", "2", "--workers", "1", "--quiet")
    assert ended.status == 0
    (first,) = (
        number for number, line in enumerate(ended.out.splitlines()) if "missions  found" in line
    )
    rows = ended.out.splitlines()[first + 1 : first + 7]
    managers = ["none", "random", "metacontrol", "bt", "rosa", "planta"]
    assert [row.split()[:2] for row in rows] == [[name, "2"] for name in managers]


class TestRun:
    def test_tells_the_mission_as_a_timeline(self, command):
        ended = command("run", "seams2023", "--manager", "none", "--seed", "1")
        assert ended.status == 0
        assert ended.err == ""
        assert "seams2023, manager none, run 1, seed 1" in ended.out
        told: dict[str, float] = {}  # when something was told first
        for line in ended.out.splitlines():
            if line.split() and line.split()[0].replace(".", "").isdigit():
                told.setdefault(line.split("  ")[-1].strip(), float(line.split()[0]))
        assert told["search_pipeline"] <= told["f_generate_search_path = fd_spiral_low"]
        assert 35.0 <= told["c_thruster_1 FALSE"] < 36.0
        assert any(text.startswith("falls below 3.25 m") for text in told)
        assert told["time limit"] >= 300.0
        for metric in ("search time", "distance inspected", "mean reaction time", "adaptations"):
            assert f"\n{metric} " in ended.out
        assert "\x1b" not in ended.out  # plain text, as this is no terminal
        assert all(line == line.rstrip() for line in ended.out.splitlines())

    def test_writes_mission_events_and_trajectory(self, command, tmp_path):
        assert (
            command("run", "seams2023", "--manager", "random", "--seed", "7", "--out", "out").status
            == 0
        )
        out = tmp_path / "out"
        assert sorted(path.name for path in out.iterdir()) == [
            "events.csv",
            "mission.json",
            "trajectory.csv",
        ]
        events = rows_of(out / "events.csv")
        assert list(events[0]) == ["t_s", "source", "event", "detail"]
        times = [float(event["t_s"]) for event in events]
        assert times == sorted(times)
        trajectory = rows_of(out / "trajectory.csv")
        assert (
            ",".join(trajectory[0])
            == "t_s,x_m,y_m,z_m,roll_rad,pitch_rad,yaw_rad,mode,visibility_m"
        )
        assert float(trajectory[-1]["t_s"]) >= 300.0
        mission = json.loads((out / "mission.json").read_text())
        assert mission["metrics"]["manager"] == "random"
        assert mission["metrics"]["seed"] == 7
        recorded_y_m = mission["drawn"]["start.y_m"] + mission["drawn"]["calibration.drift_y_m"]
        assert recorded_y_m == pytest.approx(mission["metrics"]["initial_y_m"], abs=1e-6)
        assert mission["scenario"]["mission"]["time_limit_s"] == 300.0
        assert mission["command"][:3] == ["suave-des", "run", "seams2023"]

    def test_is_the_campaigns_mission_of_that_run_and_seed(self, command, tmp_path):
        command(
            "campaign",
            "seams2023",
            "--managers",
            "random",
            "--runs",
            "3",
            "--seed",
            "5",
            "--workers",
            "1",
            *OUT,
        )
        command(
            "run",
            "seams2023",
            "--manager",
            "random",
            "--seed",
            "5",
            "--run",
            "3",
            "--out",
            "mission",
        )
        row = rows_of(tmp_path / "out" / "runs.csv")[2]
        metrics = json.loads((tmp_path / "mission" / "mission.json").read_text())["metrics"]
        assert {name: "" if value is None else str(value) for name, value in metrics.items()} == row

    def test_a_manager_that_raises_ends_with_status_3_and_one_line(self, command, tmp_path):
        (tmp_path / "clumsy.py").write_text(MANAGER)
        ended = command("run", "seams2023", "--manager", "clumsy:Raises", "--out", "out")
        assert ended.status == 3
        line = r"suave-des: manager clumsy:Raises, run 1, mission time \d+\.\d\d s: RuntimeError: never seen a pipeline"
        assert _matches(ended.err, line)
        assert not (tmp_path / "out").exists()


OUT = ("--out", "out")


def _matches(text: str, pattern: str) -> bool:
    assert text.count("\n") == 1, text
    return re.match(pattern, text) is not None


def test_a_campaign_lists_failures_keeps_the_others_and_ends_with_status_3(command, tmp_path):
    (tmp_path / "clumsier.py").write_text(MANAGER)
    managers = "clumsier:Raises,none"
    arguments = ("--managers", managers, "--runs", "2", "--workers", "1", "--quiet", *OUT)
    ended = command("campaign", "seams2023", *arguments)
    assert ended.status == 3
    lines = ended.err.splitlines()
    assert lines[0].startswith("suave-des: failed: manager clumsier:Raises, run 1, mission time ")
    assert lines[0].endswith("(2 missions like this)")
    assert lines[-1] == "suave-des: 2 of 4 missions failed, see manifest.json"
    rows = rows_of(tmp_path / "out" / "runs.csv")
    assert [row["run"] for row in rows if row["manager"] == "none"] == ["1", "2"]
    assert len(rows) == 2


@pytest.mark.parametrize("terminal", [False, True])
def test_each_event_is_one_line_whatever_its_detail_has(terminal):
    result = Simulator(load_scenario("seams2023")).run("metacontrol", 1, 8, record=True)
    first = replace(result.events[0], detail="first\nsecond\r\nthird")
    file = io.StringIO()
    console = PlainConsole(file=file, width=80, force_terminal=terminal, color_system=None)
    print_timeline(console, replace(result, events=(first, *result.events[1:])))
    lines = file.getvalue().splitlines()
    details = ["first second third", *(event.detail for event in result.events[1:])]
    assert all(
        line.endswith(detail)
        for line, detail in zip(lines[3 : 3 + len(details)], details, strict=True)
    )
    assert lines[-1].split()[-2:] == ["300.1", "s"]


HEAD = "campaign: 1\nscenario: short.yaml\nmanagers: [none]\nruns: 1\n"
SHORT = "base: seams2023.yaml\nmission: {time_limit_s: 2}\n"
PERIODS = "sweep:\n  visibility.period_s: [{}]\n"


@pytest.mark.parametrize(("points", "shown"), [(40, 40), (41, 39), (57, 39)])
def test_a_long_sweep_has_its_first_rows_and_where_the_others_are(points, shown, command):
    Path("short.yaml").write_text(SHORT)
    Path("sweep.yaml").write_text(
        HEAD + PERIODS.format(", ".join(str(40 + number) for number in range(points)))
    )
    lines = command(
        "campaign", "sweep.yaml", "--out", "out", "--workers", "1", "--quiet"
    ).out.splitlines()
    rows = [line.split()[0] for line in lines if line.split()[1:2] == ["none"]]
    assert rows == [str(40 + number) for number in range(shown)]
    more = [line for line in lines if "rows more" in line]
    if shown == points:
        assert more == []
    else:
        assert more == [f"... and {points - shown} rows more, all in out/summary.csv"]
    assert len(rows_of(Path("out/summary.csv"))) == points


IMPROVES = "revision.metacontrol.improve_when_exceeded"
STATE = ("--at", "f_generate_search_path=fd_spiral_low", "--at", "water_visibility=4")


@pytest.mark.parametrize(
    ("improves", "functions"), [("true", ["f_generate_search_path"]), ("false", [])]
)
def test_infer_decides_with_the_values_that_are_set(command, improves, functions):
    _, out, _ = command("kb", "infer", *STATE, "--set", f"{IMPROVES}={improves}")
    planned = out.partition("plan\n")[2]
    assert [function for function in functions if function in planned] == functions
    assert functions or planned == "  nothing to adapt\n"


def test_missions_that_diff_runs_have_the_values_that_are_set(command):
    options = ("--missions", "1", "--quiet", "--max-failed", "0")
    means = []
    for limit_s in (20, 60):
        _, out, _ = command(
            "kb",
            "diff",
            "suave.owl",
            "suave.owl",
            *options,
            "--set",
            f"mission.time_limit_s={limit_s}",
        )
        (row,) = (line for line in out.splitlines() if line.startswith("search time, s"))
        means.append(float(row.split()[3]))
    assert means[0] <= 21.0 < means[1]


def test_tests_that_are_written_cannot_have_values_that_are_set(command):
    status, _, err = command(
        "kb", "test", "--coverage", "--write", "new.yaml", "--set", "knowledge.reasoner=pellet"
    )
    assert status == 2 and "name it with --scenario" in err
    assert not Path("new.yaml").exists()


def test_from_python_values_are_an_argument():
    base = KnowledgeBase.load(values={IMPROVES: False})
    assert KnowledgeBase.load().settings.improves_exceeded and not base.settings.improves_exceeded
