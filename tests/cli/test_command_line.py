"""The command line: exit statuses, one line for an error, and what each command prints and writes."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

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


class TestHelp:
    def test_names_every_command(self, command) -> None:
        ended = command("--help")
        assert ended.status == 0
        for name in ("run", "campaign", "reproduce", "figure", "scenarios", "schema"):
            assert f"  {name} " in ended.out

    @pytest.mark.parametrize("group", [(), ("kb",)])
    def test_summaries_are_whole(self, command, group: tuple[str, ...]) -> None:
        assert "..." not in command(*group, "--help").out.replace("[ARGS]...", "")

    def test_imports_nothing_heavy(self) -> None:
        code = (
            "import sys\n"
            "from suave_des.cli.main import main\n"
            "try:\n    main(['--help'])\nexcept SystemExit:\n    pass\n"
            "heavy = {'numpy', 'numba', 'pandas', 'scipy', 'matplotlib', 'simpy', 'pydantic_core', 'yaml',"
            " 'owlready2', 'rdflib', 'jpype', 'multiprocessing'}\n"
            "print(sorted(heavy & set(sys.modules)), file=sys.stderr)\n"
        )
        ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert ended.stderr.strip() == "[]"

    def test_without_arguments_it_prints_the_help(self, command) -> None:
        ended = command()
        assert (ended.status, ended.err) == (0, "")
        assert ended.out.startswith("Usage: suave-des")

    def test_version(self, command) -> None:
        from suave_des import __version__

        assert command("--version").out == f"suave-des {__version__}\n"


@pytest.mark.parametrize(
    ("begun", "offered"),
    [
        ("suave-des run release", "release15"),
        ("suave-des campaign seams2023 --managers none,meta", "none,metacontrol"),
        ("suave-des compare out --metrics search", "search_time_s"),
    ],
)
def test_a_shell_completes_names(command, monkeypatch: pytest.MonkeyPatch, begun: str, offered: str) -> None:
    monkeypatch.setenv("_SUAVE_DES_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", begun)
    monkeypatch.setenv("COMP_CWORD", str(len(begun.split()) - 1))
    assert command("").out.split() == [offered]


def test_a_folder_with_brackets_is_named_as_it_is(command) -> None:
    folder = "new[b] :car:"
    ended = command("campaign", "seams2023", "--managers", "none", "--runs", "1", "--workers", "1", "--out", folder)
    assert ended.out.endswith(f"\n1 mission is in {folder}/runs.csv\n")


class TestResume:
    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (("--resume", "out", "--seed", "0"), "--seed cannot be used with --resume"),
            (("seams2023", "--resume", "out"), "SCENARIO cannot be used with --resume"),
            (("--resume", "nowhere"), "nowhere: there is no campaign in it"),
            (("seams2023",), "--out DIR is missing"),
            (("--out", "out"), "SCENARIO is missing"),
        ],
    )
    def test_what_cannot_be_done_is_one_line(self, command, arguments: tuple[str, ...], words: str) -> None:
        ended = command("campaign", *arguments)
        assert (ended.status, ended.out) == (2, "")
        assert words in ended.err
        assert ended.err.count("\n") == 1


class TestProgress:
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
    def test_is_on_stderr_unless_quiet(
        self, arguments: tuple[str, ...], quiet: tuple[str, ...], command, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr("suave_des.campaign.progress._FIRST_LINE_S", 0.0)
        ended = command(*arguments, "--runs", "2", "--workers", "1", *quiet)
        assert ended.status == 0
        assert ("missions" in ended.err) == (not quiet)
        assert not re.search(r"\d of \d+ missions", ended.out)


class TestRun:
    def test_tells_the_mission_as_a_timeline(self, command) -> None:
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

    def test_writes_mission_events_and_trajectory(self, command, tmp_path: Path) -> None:
        assert command("run", "seams2023", "--manager", "random", "--seed", "7", "--out", "out").status == 0
        out = tmp_path / "out"
        assert sorted(path.name for path in out.iterdir()) == ["events.csv", "mission.json", "trajectory.csv"]
        events = rows_of(out / "events.csv")
        assert list(events[0]) == ["t_s", "source", "event", "detail"]
        times = [float(event["t_s"]) for event in events]
        assert times == sorted(times)
        trajectory = rows_of(out / "trajectory.csv")
        columns = "t_s,x_m,y_m,z_m,roll_rad,pitch_rad,yaw_rad,mode,visibility_m"
        assert ",".join(trajectory[0]) == columns
        assert float(trajectory[-1]["t_s"]) >= 300.0
        mission = json.loads((out / "mission.json").read_text())
        assert mission["metrics"]["manager"] == "random"
        assert mission["metrics"]["seed"] == 7
        recorded_y_m = mission["drawn"]["start.y_m"] + mission["drawn"]["calibration.drift_y_m"]
        assert recorded_y_m == pytest.approx(mission["metrics"]["initial_y_m"], abs=1e-6)
        assert mission["scenario"]["mission"]["time_limit_s"] == 300.0
        assert mission["command"][:3] == ["suave-des", "run", "seams2023"]

    def test_is_the_campaigns_mission_of_that_run_and_seed(self, command, tmp_path: Path) -> None:
        command("campaign", "seams2023", "--managers", "random", "--runs", "3", "--seed", "5", "--workers", "1", *OUT)
        command("run", "seams2023", "--manager", "random", "--seed", "5", "--run", "3", "--out", "mission")
        row = rows_of(tmp_path / "out" / "runs.csv")[2]
        metrics = json.loads((tmp_path / "mission" / "mission.json").read_text())["metrics"]
        assert {name: "" if value is None else str(value) for name, value in metrics.items()} == row

    def test_refuses_a_folder_with_results(self, command, tmp_path: Path) -> None:
        command("run", "seams2023", "--manager", "none", "--out", "out")
        again = command("run", "seams2023", "--manager", "none", "--out", "out")
        assert (again.status, again.out) == (2, "")
        assert again.err.startswith("suave-des: out: the output folder is not empty")
        assert command("run", "seams2023", "--manager", "none", "--out", "out", "--overwrite").status == 0

    def test_a_manager_of_ones_own_from_the_current_folder(self, command, tmp_path: Path) -> None:
        (tmp_path / "my_manager.py").write_text(MANAGER)
        ended = command("run", "seams2023", "--manager", "my_manager:Mine")
        assert ended.status == 0
        assert "about search_pipeline" in ended.out

    def test_a_manager_that_raises_ends_with_status_3_and_one_line(self, command, tmp_path: Path) -> None:
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


class TestBadInput:
    """Each is one line on the error stream, exit status 2, and no folder."""

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (["run", "nowhere.yaml", *OUT], "nowhere.yaml: no such file"),
            (["run", "seams2023", "--manager", "rondom", *OUT], "did you mean random?"),
            (["run", "seams2023", "--manager", "os:path", *OUT], "os"),
            (["run", "seams2023", "--reasoner", "hermit", *OUT], "hermit"),
            (["campaign", "seams2023", "--managers", "", *OUT], "managers: "),
            (["campaign", "seams2023", "--managers", "none,nome", *OUT], "'nome' (did you mean none?"),
            (["campaign", "seams2023", "--managers", "none,none", *OUT], "twice"),
            (["campaign", "seams2023", "--workers", "0", *OUT], "workers: 0 "),
            (["campaign", "seams2023", "--runs", "0", *OUT], "runs: 0 "),
            (["campaign", "seams2023", "--runs", "many", *OUT], "--runs"),
            (["campaign", "seams2023", "--format", "excel", *OUT], "--format"),
            (["figure", "nothing", "--out", "map.png"], "nothing: no such file"),
            (["figure", ".", "--out", "map.xyz"], "map.xyz: expected a picture, got .xyz"),
            (["campain"], "Did you mean 'campaign'?"),
            (["run", "seams2023", "--mangager", "none"], "--mangager"),
        ],
    )
    def test_is_told_in_one_line(self, arguments: list[str], words: str, command, tmp_path: Path) -> None:
        ended = command(*arguments)
        assert ended.status == 2
        assert ended.err.startswith("suave-des: ")
        assert ended.err.count("\n") == 1
        assert words in ended.err
        assert ended.out == ""
        assert list(tmp_path.iterdir()) == []

    def test_in_a_scenario_it_names_the_file_and_the_line(self, command, tmp_path: Path) -> None:
        (tmp_path / "mine.yaml").write_text("base: seams2023.yaml\nmission:\n  time_limit_m: 300\n")
        ended = command("run", "mine.yaml", *OUT)
        assert ended.status == 2
        assert _matches(ended.err, r"suave-des: mine\.yaml: line 3, .*time_limit_m.*did you mean '?time_limit_s")
        assert not (tmp_path / "out").exists()


class TestCampaign:
    def test_prints_a_summary_and_no_progress_bar(self, command, tmp_path: Path) -> None:
        ended = command("campaign", "seams2023", "--managers", "none,random", "--runs", "2", "--workers", "1", *OUT)
        assert (ended.status, ended.err) == (0, "")
        assert "\x1b" not in ended.out
        assert "4 missions are in out/runs.csv" in ended.out
        assert len(rows_of(tmp_path / "out" / "runs.csv")) == 4

    def test_lists_failures_keeps_the_others_and_ends_with_status_3(self, command, tmp_path: Path) -> None:
        (tmp_path / "clumsier.py").write_text(MANAGER)
        managers = "clumsier:Raises,none"
        arguments = ("--managers", managers, "--runs", "2", "--workers", "1", "--quiet", *OUT)
        ended = command("campaign", "seams2023", *arguments)
        assert ended.status == 3
        lines = ended.err.splitlines()
        assert lines[0].startswith("suave-des: failed: manager clumsier:Raises, run 1, mission time ")
        assert lines[0].endswith("(2 missions like this)")
        assert lines[-1] == "suave-des: 2 of 4 missions failed; the others are kept"
        rows = rows_of(tmp_path / "out" / "runs.csv")
        assert [row["run"] for row in rows if row["manager"] == "none"] == ["1", "2"]
        assert len(rows) == 2


class TestReproduce:
    def test_prints_the_papers_table_beside_ours_and_writes_it(self, command, tmp_path: Path) -> None:
        ended = command("reproduce", "--runs", "2", "--seed", "1", "--workers", "1", "--quiet", *OUT)
        assert (ended.status, ended.err) == (0, "")
        for figure in ("187.85", "42.40", "31.40", "13.00", "180.15", "82.05", "3.88", "3.19"):
            assert figure in ended.out
        for figure in ("106.95", "39.46", "51.15", "12.01"):
            assert figure in ended.out
        assert "Paper: 20 missions for each manager. Here: 2 missions for each manager." in ended.out
        assert max(map(len, ended.out.splitlines())) <= 100
        rows = rows_of(tmp_path / "out" / "runs.csv")
        assert [row["manager"] for row in rows] == ["none"] * 2 + ["random"] * 2 + ["metacontrol"] * 2
        table = (tmp_path / "out" / "paper_table.md").read_text(encoding="utf-8")
        mean = sum(float(row["search_time_s"]) for row in rows[:2]) / 2
        assert f"| {mean:.2f} |" in table and f"| {mean - 187.85:+.2f} |" in table


def test_scenarios_lists_what_is_shipped(command) -> None:
    ended = command("scenarios")
    assert ended.status == 0
    for name in ("seams2023", "release15", "paper_table_values", "suave_modes.yaml", "suave.owl"):
        assert name in ended.out


def test_schema_is_the_json_schema_of_scenarios(command) -> None:
    from suave_des.scenario.schema import scenario_schema

    assert json.loads(command("schema").out) == scenario_schema() == json.loads(command("schema", "scenario").out)
