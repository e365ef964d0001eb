"""Machine code that is kept is used only for what it was made from."""

import json
import os
import resource
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import suave_des
from tests.helpers.command import python

FOLDER = str(Path(suave_des.__file__).parents[1])
LOOP = """
import constants
from constants import DEPTH, FORMS
from halving import half
from suave_des.compiling import compiled

STEP = 1.0

@compiled
def total(n):
    s = 0.0
    for i in range(n):
        s += STEP + half(DEPTH) + constants.HEIGHT + FORMS[1][0]
    return s

if __name__ == "__main__":
    print(total(10), dict(total.stats.cache_hits) != {})
"""
CONSTANTS = "DEPTH, HEIGHT, FORMS = 4.0, 0.5, ((1, 2), (3, 4))\n"
HALVING = """
from suave_des.compiling import compiled

PART = 0.5

@compiled
def half(x):
    return PART * x
"""
Program = Callable[..., list[str]]


@pytest.fixture
def program(tmp_path: Path) -> Program:
    """Runs the program with a cache of its own."""
    return program_in(tmp_path)


def program_in(tmp_path: Path) -> Program:
    """Return what runs a program of three modules, some with other lines, as a process; that
    returns what its function gives, and whether its machine code was found.
    """
    (tmp_path / "code").mkdir()

    def run(old: str = "", new: str = "", **limits: int) -> list[str]:
        for name, text in (("loop", LOOP), ("constants", CONSTANTS), ("halving", HALVING)):
            (tmp_path / "code" / f"{name}.py").write_text(text.replace(old, new) if old else text)
        shutil.rmtree(tmp_path / "code" / "__pycache__", ignore_errors=True)
        largest = limits.get("largest_file", resource.RLIM_INFINITY)
        done = subprocess.run(
            [sys.executable, tmp_path / "code" / "loop.py"],
            env={**os.environ, "PYTHONPATH": FOLDER, "NUMBA_CACHE_DIR": str(tmp_path)},
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest)),
            capture_output=True,
            text=True,
            timeout=120,
        )
        assert done.stderr == ""
        return done.stdout.split()

    return run


def test_it_is_found_again(program):
    assert [program(), program()] == [["65.0", "False"], ["65.0", "True"]]


CHANGES = {
    "imported": ("DEPTH, HEIGHT, FORMS = 4.0", "DEPTH, HEIGHT, FORMS = 6.0"),
    "of module": ("0.5, ((1, 2)", "1.5, ((1, 2)"),
    "tuple": ("(3, 4)", "(4, 4)"),
    "own": ("STEP = 1.0", "STEP = 2.0"),
    "of callee": ("PART = 0.5", "PART = 1.0"),
    "callee": ("return PART * x", "return PART * x + 1.0"),
    "own code": ("s = 0.0", "s = 10.0"),
}
IN_TURN = """
import importlib, json, sys
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, ".")
for modules in json.load(sys.stdin):
    for name, text in modules.items():
        sys.modules.pop(name, None)
        Path(f"{name}.py").write_text(text)
    total = importlib.import_module("loop").total
    print(total(10), dict(total.stats.cache_hits) != {})
"""


@pytest.fixture(scope="module")
def in_turn(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[str]]:
    """What the program gives as it is, after each of the changes, and again as it is; one process
    loads its modules anew each time, as starting one takes longer than what it compiles.
    """
    folder = tmp_path_factory.mktemp("in_turn")
    texts = {"loop": LOOP, "constants": CONSTANTS, "halving": HALVING}
    programs = {"as it is": texts}
    for name, (old, new) in CHANGES.items():
        programs[name] = {module: text.replace(old, new) for module, text in texts.items()}
    done = subprocess.run(
        [sys.executable, "-c", IN_TURN],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": FOLDER, "NUMBA_CACHE_DIR": str(folder)},
        input=json.dumps([*programs.values(), texts]),
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.stderr == ""
    told = [line.split() for line in done.stdout.splitlines()]
    return dict(zip([*programs, "as it is again"], told, strict=True))


@pytest.mark.parametrize(
    ("changed", "total"),
    [
        ("as it is", "65.0"),
        ("imported", "75.0"),
        ("of module", "75.0"),
        ("tuple", "75.0"),
        ("own", "75.0"),
        ("of callee", "85.0"),
        ("callee", "75.0"),
        ("own code", "75.0"),
    ],
)
def test_of_what_has_changed_anywhere_it_is_made_anew(in_turn, changed, total):
    assert in_turn[changed] == [total, "False"]


def test_after_a_change_is_undone_it_is_found(in_turn):
    assert in_turn["as it is again"] == ["65.0", "True"]


@pytest.mark.slow
def test_after_a_change_whose_first_run_cannot_write_the_old_is_not_used(program):
    program()
    assert program("PART = 0.5", "PART = 1.0", largest_file=100)[0] == "85.0"
    assert [program("PART = 0.5", "PART = 1.0")[0] for _ in range(2)] == ["85.0", "85.0"]


@pytest.mark.slow
def test_files_under_each_other_s_names_are_not_used(program, tmp_path):
    program()
    program("PART = 0.5", "PART = 1.0")
    files = sorted(tmp_path.glob("*.nbc"))
    contents = [path.read_bytes() for path in files]
    assert len(files) >= 3
    for path, content in zip(files, [*contents[1:], contents[0]], strict=True):
        path.write_bytes(content)
    assert [program()[0], program("PART = 0.5", "PART = 1.0")[0]] == ["65.0", "85.0"]


MISSION = """
import gc
import suave_des
from numba.core.dispatcher import Dispatcher
suave_des.run_mission("seams2023", "random")
own = [each for each in gc.get_objects() if isinstance(each, Dispatcher) and each.overloads]
own = [each for each in own if each.py_func.__module__.startswith("suave_des.")]
print(bool(own), [each.py_func.__name__ for each in own if each.stats.cache_misses])
"""


CALLS = """
import math
import numpy
from suave_des.compiling import compiled

@compiled
def called(matrix, x, text):
    if x < 0.0:
        raise ValueError("negative")
    matrix[1] = numpy.sin(matrix[0, 0]) ** x
    return len(text) + math.gamma(x) + math.atan2(matrix[1, 0], numpy.rint(x)) + abs(complex(x, x) ** x)

print(called(numpy.array([[1.0, 2.0], [3.0, 5.0]]), 2.5, "ab"), dict(called.stats.cache_hits) != {})
try:
    called(numpy.zeros((2, 2)), -1.0, "ab")
except ValueError as error:
    print(error)
"""


def test_kept_code_finds_what_it_calls(tmp_path):
    first, second = (python("-c", CALLS, NUMBA_CACHE_DIR=str(tmp_path)) for _ in range(2))
    assert (first.returncode, second.returncode) == (0, 0), second.stderr
    assert second.stdout.split()[1:] == ["True", "negative"]
    assert second.stdout.split()[0] == first.stdout.split()[0]


def test_a_process_compiles_nothing_of_a_mission_that_another_has_flown():
    """With the cache of all tests, the first may be that process already."""
    assert any(python("-c", MISSION).stdout == "True []\n" for _ in range(2))


@pytest.mark.slow
def test_the_first_process_compiles_a_mission_for_the_second(tmp_path):
    first, second = (python("-c", MISSION, NUMBA_CACHE_DIR=str(tmp_path)) for _ in range(2))
    assert first.stdout != second.stdout == "True []\n"
