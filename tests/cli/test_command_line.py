"""The command line: exit statuses, one line for an error, and what each command prints and
writes.
"""

import io
import json
import re
from dataclasses import replace
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import pytest

from suave_des.cli.console import PlainConsole, print_timeline
from suave_des.kb.knowledge_base import KnowledgeBase
from suave_des.scenario.loader import load_scenario
from suave_des.simulation.simulator import Simulator
from tests.helpers import rows_of
from tests.helpers.command import command_here

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


@pytest.fixture(scope="module")
def out_of_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a mission."""
    folder = tmp_path_factory.mktemp("run")
    asked = ("run", "seams2023", "--manager", "random", "--seed", "7", "--out", "out")
    assert command_here(*asked, cwd=folder).returncode == 0
    return folder / "out"


@pytest.fixture(scope="module")
def told_of_run(out_of_run: Path) -> dict[str, Any]:
    """What mission.json says."""
    return json.loads((out_of_run / "mission.json").read_text())


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

    def test_writes_three_files(self, out_of_run):
        names = ["events.csv", "mission.json", "trajectory.csv"]
        assert sorted(path.name for path in out_of_run.iterdir()) == names

    def test_writes_events_in_the_order_of_time(self, out_of_run):
        events = rows_of(out_of_run / "events.csv")
        assert list(events[0]) == ["t_s", "source", "event", "detail"]
        times = [float(event["t_s"]) for event in events]
        assert times == sorted(times)

    def test_writes_the_trajectory_until_the_mission_is_over(self, out_of_run):
        trajectory = rows_of(out_of_run / "trajectory.csv")
        assert (
            ",".join(trajectory[0])
            == "t_s,x_m,y_m,z_m,roll_rad,pitch_rad,yaw_rad,mode,visibility_m"
        )
        assert float(trajectory[-1]["t_s"]) >= 300.0

    def test_writes_the_mission_that_was_asked_for(self, told_of_run):
        assert told_of_run["metrics"]["manager"] == "random"
        assert told_of_run["metrics"]["seed"] == 7
        assert told_of_run["scenario"]["mission"]["time_limit_s"] == 300.0
        assert told_of_run["command"][:3] == ["suave-des", "run", "seams2023"]

    def test_writes_what_was_drawn_for_the_mission(self, told_of_run):
        recorded_y_m = (
            told_of_run["drawn"]["start.y_m"] + told_of_run["drawn"]["calibration.drift_y_m"]
        )
        assert recorded_y_m == pytest.approx(told_of_run["metrics"]["initial_y_m"], abs=1e-6)

    def test_is_the_same_mission_as_in_a_campaign(self, command, tmp_path):
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


OUT = ("--out", "out")


@pytest.fixture(scope="module")
def clumsy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a manager that raises."""
    folder = tmp_path_factory.mktemp("raises")
    (folder / "clumsy.py").write_text(MANAGER)
    return folder


@pytest.fixture(scope="module")
def failed_mission(clumsy: Path) -> CompletedProcess[str]:
    """A mission of its own."""
    asked = ("run", "seams2023", "--manager", "clumsy:Raises", "--out", "mission")
    return command_here(*asked, cwd=clumsy)


@pytest.fixture(scope="module")
def failed_campaign(clumsy: Path) -> CompletedProcess[str]:
    """A campaign with another manager."""
    managers = ("--managers", "clumsy:Raises,none", "--runs", "2", "--workers", "1")
    return command_here("campaign", "seams2023", *managers, "--quiet", *OUT, cwd=clumsy)


class TestManagerThatRaises:
    @pytest.mark.parametrize("kind", ["failed_mission", "failed_campaign"])
    def test_the_command_ends_with_status_3(self, kind, request):
        assert request.getfixturevalue(kind).returncode == 3

    def test_a_mission_tells_its_run_with_time_in_one_line(self, failed_mission):
        line = r"suave-des: manager clumsy:Raises, run 1, mission time \d+\.\d\d s: RuntimeError: never seen a pipeline"
        assert failed_mission.stderr.count("\n") == 1, failed_mission.stderr
        assert re.match(line, failed_mission.stderr)

    def test_a_mission_leaves_no_folder(self, failed_mission, clumsy):
        assert not (clumsy / "mission").exists()

    def test_a_campaign_lists_what_failed_with_its_number(self, failed_campaign):
        first, *_, last = failed_campaign.stderr.splitlines()
        assert first.startswith("suave-des: failed: manager clumsy:Raises, run 1, mission time ")
        assert first.endswith("(2 missions like this)")
        assert last == "suave-des: 2 of 4 missions failed, see manifest.json"

    def test_a_campaign_keeps_the_missions_of_others(self, failed_campaign, clumsy):
        rows = rows_of(clumsy / "out" / "runs.csv")
        assert [(row["manager"], row["run"]) for row in rows] == [("none", "1"), ("none", "2")]


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


@pytest.fixture(scope="module", params=[(40, 40), (41, 39), (57, 39)], ids=str)
def swept(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[int, int, list[str], Path]:
    """Numbers of points and of rows to show, what a campaign printed, and its folder."""
    points, shown = request.param
    folder = tmp_path_factory.mktemp("sweep")
    (folder / "short.yaml").write_text(SHORT)
    periods_s = ", ".join(str(40 + number) for number in range(points))
    (folder / "sweep.yaml").write_text(HEAD + PERIODS.format(periods_s))
    asked = ("campaign", "sweep.yaml", "--out", "out", "--workers", "1", "--quiet")
    return points, shown, command_here(*asked, cwd=folder).stdout.splitlines(), folder / "out"


class TestSweep:
    def test_a_long_one_has_its_first_rows(self, swept):
        _, shown, lines, _ = swept
        rows = [line.split()[0] for line in lines if line.split()[1:2] == ["none"]]
        assert rows == [str(40 + number) for number in range(shown)]

    def test_a_long_one_says_where_the_other_rows_are(self, swept):
        points, shown, lines, _ = swept
        more = [line for line in lines if "rows more" in line]
        if shown == points:
            assert more == []
        else:
            assert more == [f"... and {points - shown} rows more, all in out/summary.csv"]

    def test_all_rows_are_in_its_file(self, swept):
        points, _, _, out = swept
        assert len(rows_of(out / "summary.csv")) == points


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


def test_from_python_values_are_an_argument():
    base = KnowledgeBase.load(values={IMPROVES: False})
    assert KnowledgeBase.load().settings.improves_exceeded and not base.settings.improves_exceeded
