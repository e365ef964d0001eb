"""The programs in benchmarks/ run, and measure what they say."""

import re
import shlex
import subprocess
from pathlib import Path

import pytest
import typer

from benchmarks import commands
from benchmarks.stock_reasoner import SEARCH, SEARCHING_HIGH, MissionState, StockReasoner
from suave_des.cli.main import app
from suave_des.cli.options import CommandsUnderHeadings
from suave_des.resources import shipped_folder
from tests.helpers.command import python

ROOT = Path(__file__).parents[2]


def run(name: str, *arguments: object, folder: Path) -> subprocess.CompletedProcess[str]:
    return python(ROOT / "benchmarks" / name, *arguments, cwd=folder)


@pytest.fixture(scope="module")
def compared(tmp_path_factory) -> list[str]:
    """Rows of a comparison of this installation with itself."""
    few = ("--missions", 2, "--rounds", 1, "--scenarios", "seams2023", "--managers", "none,random")
    ended = run("versions.py", ROOT, ROOT, *few, folder=tmp_path_factory.mktemp("versions"))
    assert ended.returncode == 0, ended.stderr
    return ended.stdout.splitlines()[2:]


@pytest.mark.slow
def test_two_installations_are_compared_under_each_manager(compared):
    assert [row.split()[:2] for row in compared] == [["seams2023", "none"], ["seams2023", "random"]]


@pytest.mark.slow
def test_the_ratio_of_two_installations_is_that_of_their_times(compared):
    for row in compared:
        before_ms, after_ms, ratio = map(float, row.split()[2:])
        assert ratio == pytest.approx(after_ms / before_ms, rel=0.01)


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    folder = tmp_path_factory.mktemp("measured")
    return commands.measure("scenarios", folder, folder / "cache")


def test_a_command_s_time_is_measured(measured):
    assert 0.05 < measured.cpu_s < measured.wall_s * 4.0


def test_a_command_s_memory_is_measured(measured):
    assert 10.0 < measured.memory_mb < 2000.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "arguments", "said"),
    [
        ("interfaces.py", ("--windows", 1), "gym, another action after 1 steps"),
        ("chaos.py", ("--kills", 1, "--runs", 200), "the bytes are the same"),
        ("kernel.py", (3, 1), "mission_over_flight"),
        ("stock_reasoner.py", (1,), "inference_s"),
        ("reasoning.py", ("--help",), "over the same random states"),
    ],
)
def test_each_program_runs(tmp_path, name, arguments, said):
    ended = run(name, *arguments, folder=tmp_path)
    assert (ended.returncode, said in ended.stdout) == (0, True), ended.stderr


@pytest.mark.slow
def test_the_table_of_commands_has_their_times(tmp_path):
    ended = run("commands.py", "--only", "kb rules", "--rounds", 1, folder=tmp_path)
    assert re.match(r"\| `kb rules` \| [\d.]+ \| [\d.]+ \| \d+ \|  from", ended.stdout), (
        ended.stderr
    )


def test_every_command_is_measured_or_is_like_one_that_is():
    likewise = {"serve", "import-config", "kb remove-rule", "kb enable-rule", "kb disable-rule"}
    top = typer.main.get_command(app)
    assert isinstance(top, CommandsUnderHeadings)
    below = top.get_command(None, "kb")
    names = {*top.commands, *(f"kb {name}" for name in below.commands)} - {"kb"}
    measured = {
        " ".join(words.split()[: 1 + words.startswith("kb ")]) for words in commands.COMMANDS
    } - {"--help"}
    assert measured | likewise == names


@pytest.mark.parametrize("words", [words for words in commands.COMMANDS if words != "--help"])
def test_measured_commands_have_the_options_that_they_are_given(words):
    command, arguments = typer.main.get_command(app), shlex.split(words)
    context = None
    while hasattr(command, "get_command"):
        command = command.get_command(context, arguments.pop(0))
    command.make_context("suave-des", arguments)  # an unknown option is an error


@pytest.fixture(scope="module")
def planned() -> dict[str, str]:
    """What the stock reasoner plans where a thruster has failed and the water is less clear."""
    state = MissionState(SEARCH, 3.0, "FALSE", SEARCHING_HIGH)
    plan = StockReasoner(shipped_folder("ontology")).plan(state)
    assert plan.keys() == {"f_maintain_motion", "f_generate_search_path"}
    return plan


def test_the_stock_reasoner_considers_the_thruster(planned):
    assert planned["f_maintain_motion"] == "fd_recover_thrusters"


def test_the_stock_reasoner_considers_the_visibility(planned):
    assert planned["f_generate_search_path"] == "fd_spiral_medium"
