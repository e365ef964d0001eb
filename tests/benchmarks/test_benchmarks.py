"""The programs in benchmarks/ run, and measure what they say."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import typer

from benchmarks import commands
from benchmarks.kernel import MANAGER, SCENARIO, SEED, Replay, record
from benchmarks.stock_reasoner import SEARCH, SEARCHING_HIGH, MissionState, StockReasoner
from suave_des.cli.main import app
from suave_des.cli.options import CommandsUnderHeadings
from suave_des.resources import shipped_folder
from suave_des.scenario.loader import load_scenario
from suave_des.simulation.simulator import Simulator

ROOT = Path(__file__).parents[2]


def run(name: str, *arguments: object, folder: Path) -> subprocess.CompletedProcess[str]:
    words = [sys.executable, str(ROOT / "benchmarks" / name), *map(str, arguments)]
    return subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=600, check=False)


def test_two_installations_are_compared_by_scenario_and_manager(tmp_path: Path) -> None:
    few = ("--missions", 2, "--rounds", 1, "--scenarios", "seams2023", "--managers", "none,random")
    ended = run("versions.py", ROOT, ROOT, *few, folder=tmp_path)
    assert ended.returncode == 0, ended.stderr
    _, _, *rows = ended.stdout.splitlines()
    assert [row.split()[:2] for row in rows] == [["seams2023", "none"], ["seams2023", "random"]]
    for row in rows:
        before_ms, after_ms, ratio = map(float, row.split()[2:])
        assert ratio == pytest.approx(after_ms / before_ms, rel=0.01)


def test_what_is_no_installation_is_refused(tmp_path: Path) -> None:
    ended = run("versions.py", ROOT, tmp_path, folder=tmp_path)
    assert (ended.returncode, "neither a virtual environment nor a checkout" in ended.stderr) == (1, True)


def test_a_command_s_time_and_memory_are_measured(tmp_path: Path) -> None:
    found = commands.measure("scenarios", tmp_path, tmp_path / "cache")
    assert 0.05 < found.cpu_s < found.wall_s * 4.0
    assert 10.0 < found.memory_mb < 2000.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "arguments", "said"),
    [
        ("interfaces.py", ("--windows", 1), "gym, another action after 1 steps"),
        ("chaos.py", ("--kills", 1, "--runs", 200), "the bytes are the same"),
        ("kernel.py", (3, 1), "mission_over_kernel"),
        ("stock_reasoner.py", (1,), "inference_s"),
        ("reasoning.py", ("--help",), "over the same random states"),
    ],
)
def test_each_program_runs(tmp_path: Path, name: str, arguments: tuple, said: str) -> None:
    ended = run(name, *arguments, folder=tmp_path)
    assert (ended.returncode, said in ended.stdout) == (0, True), ended.stderr


@pytest.mark.slow
def test_the_table_of_commands_has_their_times(tmp_path: Path) -> None:
    ended = run("commands.py", "--only", "kb rules", "--rounds", 1, folder=tmp_path)
    assert re.match(r"\| `kb rules` \| [\d.]+ \| [\d.]+ \| \d+ \|  from", ended.stdout), ended.stderr


def test_every_command_is_measured_or_is_like_one_that_is() -> None:
    likewise = {"serve", "import-config", "kb remove-rule", "kb enable-rule", "kb disable-rule"}
    top = typer.main.get_command(app)
    assert isinstance(top, CommandsUnderHeadings)
    below = top.get_command(None, "kb")
    names = {*top.commands, *(f"kb {name}" for name in below.commands)} - {"kb"}
    measured = {" ".join(words.split()[: 1 + words.startswith("kb ")]) for words in commands.COMMANDS} - {"--help"}
    assert measured | likewise == names


@pytest.mark.parametrize("words", [words for words in commands.COMMANDS if words != "--help"])
def test_measured_commands_have_the_options_that_they_are_given(words: str) -> None:
    command, arguments = typer.main.get_command(app), shlex.split(words)
    context = None
    while hasattr(command, "get_command"):
        command = command.get_command(context, arguments.pop(0))
    command.make_context("suave-des", arguments)  # an unknown option is an error


@pytest.fixture(scope="module")
def replay() -> tuple[Replay, np.ndarray]:
    simulator = Simulator(load_scenario(SCENARIO))
    found = record(lambda: simulator.run(MANAGER, 3, SEED))
    return found, np.zeros(found.shape)


def test_recorded_calls_of_the_kernel_give_the_mission_s_track_again(replay: tuple[Replay, np.ndarray]) -> None:
    found, track = replay
    assert found.cpu_ns(track) > 0
    before = track.copy()
    found.cpu_ns(track)
    assert np.array_equal(track, before)
    assert np.count_nonzero(track.any(axis=1)) > 100 / 0.05  # rows of 0.05 s
    assert found.ns_per_substep(np.zeros(found.shape)) > 0


def test_a_call_of_the_kernel_that_was_not_recorded_is_an_error(replay: tuple[Replay, np.ndarray]) -> None:
    found, track = replay
    found.cpu_ns(track)
    with pytest.raises(RuntimeError, match="was not recorded"):
        Replay([found.calls[0], *found.calls[2:]], track)
    with pytest.raises(RuntimeError, match="do not give the mission's track"):
        record(lambda: None)


def test_the_stock_reasoner_considers_thruster_and_visibility() -> None:
    state = MissionState(SEARCH, 3.0, "FALSE", SEARCHING_HIGH)
    wanted = {"f_maintain_motion": "fd_recover_thrusters", "f_generate_search_path": "fd_spiral_medium"}
    assert StockReasoner(shipped_folder("ontology")).plan(state) == wanted
