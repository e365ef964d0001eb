"""What `suave-des bench` measures, tells and writes; how fast anything is plays no part here."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import asdict, replace
from io import StringIO
from pathlib import Path
from typing import ClassVar

import jsonschema
import numpy as np
import pytest

import suave_des
from suave_des.bench.bench import Bench, CampaignTime, goal_rows, in_words, is_busy, machine, programs
from suave_des.bench.programs import FinishedProgram, MeasurementError, run
from suave_des.bench.ratio import MANAGER, SCENARIO, SEED, KernelCall, Replay, record
from suave_des.bench.stock_reasoner import SEARCH, SEARCHING_HIGH, STATES, MissionState, StockReasoner
from suave_des.cli.main import main
from suave_des.interrupts import signals_raised
from suave_des.resources import shipped_folder
from suave_des.scenario.loader import load_scenario
from suave_des.simulation.simulator import Simulator

NUMBER = {"type": "number"}
CAMPAIGN = {
    "type": "object",
    "properties": {"wall_s": NUMBER, "missions_a_second": NUMBER, "workers": NUMBER, "missions": NUMBER},
    "required": ["missions", "workers", "wall_s", "cpu_s", "missions_a_second", "parent_mb", "worker_mb"],
}
SCHEMA = {
    "type": "object",
    "properties": {
        "format": {"const": 2},
        "command": {"type": "array", "items": {"type": "string"}},
        "machine": {"type": "object", "required": ["processor", "cores", "load", "system", "python", "simpy"]},
        "missions": {"const": 20},
        "took_s": NUMBER,
        "campaigns": {
            "type": "object",
            "additionalProperties": CAMPAIGN,
            "required": ["cold", "warm", "one_worker"],
        },
        "ratio": {"type": "object", "additionalProperties": NUMBER},
        "stock": {"type": "object", "additionalProperties": NUMBER},
        "rows": {"type": "array", "items": {"type": "object", "required": ["what", "goal", "value", "unit", "met"]}},
        "programs": {"type": "array", "items": {"type": "object", "required": ["what", "mission_s", "note"]}},
    },
    "additionalProperties": False,
}
SCHEMA["required"] = list(SCHEMA["properties"])


def started(*arguments: str, cwd: Path, temporary: Path) -> subprocess.Popen[str]:
    path = os.pathsep.join([str(Path(suave_des.__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    return subprocess.Popen(
        [sys.executable, "-m", "suave_des", "bench", *arguments],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": path, "TMPDIR": str(temporary)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def processes_in(folder: Path) -> dict[str, str]:
    """Command lines of the processes whose current folder is within one, by their numbers."""
    found = {}
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if (process / "cwd").readlink().is_relative_to(folder):
                found[process.name] = (process / "cmdline").read_bytes().replace(b"\0", b" ").decode()
        except OSError:
            continue
    return found


RATIO = {"mission_over_kernel": 2.0, "kernel_ns_a_substep": 70.0, "mission_wall_us": 1000.0}
RATIO |= {"mission_cpu_us": 990.0, "kernel_cpu_us": 495.0}
STOCK = {"inferences_measured": 2.0, "inferences_a_mission": 150.0, "mission_s": 300.0, "inference_s": 2.0}


def as_if_measured(arguments, folder, environment) -> FinishedProgram:
    """What the programs print that `bench` runs, without running them."""
    (folder / f"{arguments[0]}.txt").touch()
    figures = {"suave_des.bench.ratio": RATIO, "suave_des.bench.stock_reasoner": STOCK}.get(arguments[0], {})
    worker_mb = 200.0 if "2" in arguments else None
    return FinishedProgram(wall_s=4.0, cpu_s=6.0, out=json.dumps(figures), parent_mb=150.0, worker_mb=worker_mb)


@pytest.fixture(scope="module", params=["as if measured", pytest.param("measured", marks=pytest.mark.slow)])
def quick(request, tmp_path_factory):
    """A quick run: what it printed, what it said, its JSON file, and the folder for temporary files."""
    folder, temporary = tmp_path_factory.mktemp("bench"), tmp_path_factory.mktemp("temporary")
    words = ("--missions", "20", "--json", "figures.json")
    if request.param == "measured":
        process = started(*words, cwd=folder, temporary=temporary)
        out, err = process.communicate(timeout=600)
        assert process.returncode == 0, err
    else:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("suave_des.bench.bench.run", as_if_measured)
            patch.setattr("tempfile.tempdir", str(temporary))
            patch.chdir(folder)
            printed, said = StringIO(), StringIO()
            patch.setattr("sys.stdout", printed)
            patch.setattr("sys.stderr", said)
            with pytest.raises(SystemExit) as ended:
                main(["bench", *words])
            assert not ended.value.code
            out, err = printed.getvalue(), said.getvalue()
    return out, err, json.loads((folder / "figures.json").read_text()), temporary


@pytest.fixture(scope="module")
def simulator():
    return Simulator(load_scenario(SCENARIO))


class TestCommand:
    def test_tells_machine_goals_stand_ins_and_time(self, quick) -> None:
        out, _, figures, _ = quick
        assert out.splitlines()[0].startswith(figures["machine"]["processor"])
        for row in figures["rows"]:
            line = next(line for line in out.splitlines() if line.startswith(row["what"]))
            assert row["goal"] in line
        for program in ("suave-des, metacontrol", "stock owlready2 and Pellet"):
            assert program in out
        assert "extrapolated from" in out
        assert "measured in" in out
        assert out.endswith("The figures are in figures.json\n")

    def test_says_on_standard_error_what_it_is_at(self, quick) -> None:
        lines = [line for line in quick[1].splitlines() if line.startswith("measuring, ")]
        assert [line.split()[1] for line in lines] == ["1", "2", "3", "4", "5"]

    def test_writes_figures_of_one_form(self, quick) -> None:
        jsonschema.validate(quick[2], SCHEMA)

    def test_figures_agree_with_one_another(self, quick) -> None:
        figures = quick[2]
        for campaign in figures["campaigns"].values():
            assert campaign["missions"] / campaign["wall_s"] == pytest.approx(campaign["missions_a_second"])
        ratio = figures["ratio"]
        assert ratio["mission_over_kernel"] == pytest.approx(ratio["mission_cpu_us"] / ratio["kernel_cpu_us"])
        assert ratio["mission_over_kernel"] > 1

    @pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="this system does not tell")
    def test_measures_memory_of_parent_and_workers(self, quick) -> None:
        campaigns = quick[2]["campaigns"]
        assert all(campaign["parent_mb"] > 10 for campaign in campaigns.values())
        assert campaigns["warm"]["worker_mb"] > 10
        assert campaigns["one_worker"]["worker_mb"] is None

    def test_goals_for_more_missions_are_neither_met_nor_missed(self, quick) -> None:
        met = {row["what"]: row["met"] for row in quick[2]["rows"]}
        assert met["metacontrol missions a second, 2 workers, CSV written"] is None
        assert met["vehicle kernel, a 6-DOF substep"] is not None

    def test_leaves_no_temporary_files(self, quick) -> None:
        assert list(quick[3].iterdir()) == []

    @pytest.mark.skipif(not Path("/proc/self/cwd").exists(), reason="looks for processes in /proc")
    @pytest.mark.parametrize("moment_s", [0.0, pytest.param(2.5, marks=pytest.mark.slow)])
    def test_ctrl_c_ends_everything(self, tmp_path, moment_s) -> None:
        process = started("--json", "figures.json", cwd=tmp_path, temporary=tmp_path)
        said = process.stderr.readline()
        deadline_s = time.monotonic() + 60
        while len(processes_in(tmp_path)) < 2:  # bench itself, and a campaign
            assert time.monotonic() < deadline_s
            time.sleep(0.01)
        time.sleep(moment_s)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=120)
        assert said.startswith("measuring, 1 of ")
        assert process.returncode == 130
        *measured, last = err.splitlines()
        assert (out, last) == ("", "suave-des: interrupted")
        assert all(line.startswith("measuring, ") for line in measured)  # on a fast machine, some were
        assert list(tmp_path.iterdir()) == []
        deadline_s = time.monotonic() + 10  # Python's own helper of a campaign ends a moment after it
        while (left := processes_in(tmp_path)) and time.monotonic() < deadline_s:
            time.sleep(0.05)
        assert left == {}

    @pytest.mark.parametrize(
        ("arguments", "problem"),
        [
            (["--json", "nowhere/figures.json"], "no folder nowhere"),
            (["--json", "."], "is a folder"),
            (["--json", "there.json"], "exists already"),
            (["--missions", "1"], "--missions"),
            (["--missions", "many"], "valid integer"),
        ],
    )
    def test_bad_input_is_one_line_before_anything_is_measured(
        self, tmp_path, monkeypatch, capsys, arguments, problem
    ) -> None:
        monkeypatch.chdir(tmp_path)
        Path("there.json").write_text("kept")
        with pytest.raises(SystemExit) as ended:
            main(["bench", *arguments])
        captured = capsys.readouterr()
        assert ended.value.code == 2
        assert captured.out == ""
        assert len(captured.err.splitlines()) == 1
        assert problem in captured.err
        assert Path("there.json").read_text() == "kept"


class TestRatio:
    def test_recording_leaves_missions_as_they_are(self, simulator) -> None:
        before = simulator.run(MANAGER, 3, SEED).metrics
        replay = record(lambda: simulator.run(MANAGER, 3, SEED))
        assert simulator.run(MANAGER, 3, SEED).metrics == before
        assert len(record(lambda: simulator.run(MANAGER, 3, SEED)).calls) == len(replay.calls)

    def test_a_replay_computes_the_same_track_each_time(self, simulator) -> None:
        replay = record(lambda: simulator.run(MANAGER, 3, SEED))
        tracks = [np.zeros(replay.shape) for _ in range(2)]
        assert all(replay.cpu_ns(track) > 0 for track in tracks)
        assert np.array_equal(*tracks)
        assert np.count_nonzero(tracks[0].any(axis=1)) > 100 / 0.05  # rows of 0.05 s

    def test_a_call_that_was_not_recorded_is_an_error(self, simulator) -> None:
        replay = record(lambda: simulator.run(MANAGER, 3, SEED))
        track = np.zeros(replay.shape)
        replay.cpu_ns(track)
        Replay(replay.calls, track)
        with pytest.raises(RuntimeError, match="was not recorded"):
            Replay([replay.calls[0], *replay.calls[2:]], track)
        with pytest.raises(RuntimeError, match="do not give the mission's track"):
            Replay(replay.calls, track + 1.0)

    def test_a_mission_without_calls_is_an_error(self) -> None:
        with pytest.raises(RuntimeError, match="do not give the mission's track"):
            record(lambda: None)

    def test_a_substep_takes_some_time(self, simulator) -> None:
        replay = record(lambda: simulator.run(MANAGER, 3, SEED))
        assert isinstance(replay.calls[0], KernelCall)
        assert replay.ns_per_substep(np.zeros(replay.shape)) > 0


class TestStockReasoner:
    """It decides as it should, considering the thruster and the visibility."""

    @pytest.mark.parametrize(
        ("state", "designs"),
        [
            (MissionState(SEARCH, 3.5), SEARCHING_HIGH),
            (
                MissionState(SEARCH, 3.0, "FALSE", SEARCHING_HIGH),
                {"f_maintain_motion": "fd_recover_thrusters", "f_generate_search_path": "fd_spiral_medium"},
            ),
        ],
    )
    def test_decisions(self, state, designs) -> None:
        assert StockReasoner(shipped_folder("ontology")).plan(state) == designs

    def test_states_of_a_mission_are_different(self) -> None:
        assert len({json.dumps(asdict(state)) for state in STATES}) == len(STATES)


class TestGoals:
    CAMPAIGN: ClassVar = CampaignTime(10_000, 2, 5.0, 9.0, 2000.0, 200.0, 200.0)
    MUCH: ClassVar = {"memory of a worker, 10,000 missions", "  the same for few and many: worker"}

    def bench(self, **changed) -> Bench:
        campaigns = {
            "cold": replace(self.CAMPAIGN, wall_s=12.0),
            "warm": self.CAMPAIGN,
            "one_worker": replace(self.CAMPAIGN, wall_s=9.8),
            "small": replace(self.CAMPAIGN, missions=1000),
        }
        return replace(Bench({}, 10_000, 60.0, campaigns, RATIO, STOCK), **changed)

    def test_met(self) -> None:
        assert {row.met for row in goal_rows(self.bench())} == {True}

    @pytest.mark.parametrize(
        ("campaign", "key", "value", "missed"),
        [
            ("warm", "missions_a_second", 1499.0, {"metacontrol missions a second, 2 workers, CSV written"}),
            ("warm", "wall_s", 5.2, {"2 workers / 1 worker"}),
            ("warm", "wall_s", 8.1, {"2 workers / 1 worker", "10,000 missions, filled memory and caches"}),
            ("cold", "wall_s", 20.1, {"10,000 missions, cold start"}),
            ("small", "parent_mb", 150.0, {"  the same for few and many: parent"}),
            ("warm", "worker_mb", 401.0, MUCH),
        ],
    )
    def test_missed(self, campaign, key, value, missed) -> None:
        campaigns = dict(self.bench().campaigns)
        campaigns[campaign] = replace(campaigns[campaign], **{key: value})
        assert {row.what for row in goal_rows(self.bench(campaigns=campaigns)) if not row.met} == missed

    def test_memory_that_the_system_does_not_tell_is_left_open(self) -> None:
        unknown = {"parent_mb": None, "worker_mb": None}
        campaigns = {name: replace(found, **unknown) for name, found in self.bench().campaigns.items()}
        rows = [row for row in goal_rows(self.bench(campaigns=campaigns)) if "memory of" in row.what]
        assert rows and all(row.met is None and row.measured == "not reported by this system" for row in rows)

    def test_programs_are_compared_with_a_mission_here(self) -> None:
        assert [each.times_a_mission for each in programs(self.bench())] == [1.0, 300_000.0]

    def test_can_be_written_as_json(self) -> None:
        assert json.loads(json.dumps(asdict(self.bench())))["missions"] == 10_000


class TestMeasuredPrograms:
    @pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
    def test_interrupted_while_one_starts_it_has_ended(self, number, tmp_path, monkeypatch) -> None:
        """Python leaves a process behind that it was starting when an exception came."""
        started = []
        (tmp_path / "sleeper.py").write_text("import time\ntime.sleep(60)\n")

        class Starting(subprocess.Popen):
            def __init__(self, *arguments, **options) -> None:
                super().__init__(*arguments, **options)
                started.append(self)
                signal.raise_signal(number)

        monkeypatch.setattr(subprocess, "Popen", Starting)
        with signals_raised(), pytest.raises(KeyboardInterrupt):
            run(["sleeper"], tmp_path, {})
        (process,) = started
        assert process.returncode is not None
        assert not Path(f"/proc/{process.pid}").exists()

    def test_one_that_fails_is_told_with_what_it_said(self, tmp_path) -> None:
        with pytest.raises(
            MeasurementError, match=r"suave_des campaign nowhere --out o ended with status 2: .*no such file"
        ):
            run(["suave_des", "campaign", "nowhere", "--out", "o"], tmp_path, {})

    def test_what_it_prints_is_kept(self, tmp_path) -> None:
        ended = run(["suave_des", "--version"], tmp_path, {})
        assert 0 < ended.cpu_s < 60
        assert ended.out == f"suave-des {suave_des.__version__}\n"
        assert ended.worker_mb is None


def test_the_machine_is_told_in_one_line() -> None:
    found = machine()
    assert in_words(found).count("\n") == 0
    assert f"{found['cores']} cores" in in_words(found)
    assert json.loads(json.dumps(found)) == found


@pytest.mark.parametrize(("load", "busy"), [(0.1, False), (1.5, True)])
def test_a_busy_machine_is_reported(load, busy) -> None:
    assert is_busy({"load": [load, 0.0, 0.0], "cores": 2}) is busy
