"""Machine code that is kept is used only for what it was made from."""

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


@pytest.fixture(scope="module")
def known_program(tmp_path_factory: pytest.TempPathFactory) -> Program:
    """Runs the program with a cache in which its machine code is."""
    program = program_in(tmp_path_factory.mktemp("known"))
    program()
    return program


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


@pytest.mark.parametrize(
    ("old", "new", "total"),
    [
        ("DEPTH, HEIGHT, FORMS = 4.0", "DEPTH, HEIGHT, FORMS = 6.0", "75.0"),
        ("0.5, ((1, 2)", "1.5, ((1, 2)", "75.0"),
        ("(3, 4)", "(4, 4)", "75.0"),
        ("STEP = 1.0", "STEP = 2.0", "75.0"),
        ("PART = 0.5", "PART = 1.0", "85.0"),
        ("return PART * x", "return PART * x + 1.0", "75.0"),
        ("s = 0.0", "s = 10.0", "75.0"),
    ],
    ids=["imported", "of module", "tuple", "own", "of callee", "callee", "own code"],
)
def test_of_what_has_changed_anywhere_it_is_made_anew(known_program, old, new, total):
    assert known_program(old, new) == [total, "False"]


def test_after_a_change_is_undone_it_is_found(known_program):
    known_program("STEP = 1.0", "STEP = 3.0")
    assert known_program() == ["65.0", "True"]


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


def test_a_second_process_compiles_nothing_of_a_mission(tmp_path):
    first, second = (python("-c", MISSION, NUMBA_CACHE_DIR=str(tmp_path)) for _ in range(2))
    assert first.stdout != second.stdout == "True []\n"
