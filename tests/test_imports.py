"""Libraries are loaded without what is not used of them, which still works for whoever wants it."""

import ast
import os
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import suave_des
from suave_des.imports import hidden
from tests.helpers.command import python

COMPILING = """
import sys
import numba
import numpy
from suave_des.compiling import compiled

@compiled
def total(values):
    return values.sum()

print(total(numpy.ones(3)), "scipy.linalg" in sys.modules)

@numba.njit
def algebra(values):
    return numpy.dot(values, values)[0, 0], numpy.linalg.inv(values)[0, 0]

print(*algebra(numpy.array([[1.0, 2.0], [3.0, 5.0]])), "scipy.linalg" in sys.modules)

import scipy.linalg
print(scipy.linalg.det(numpy.eye(2)))

from numba.np import arraymath
print(arraymath._HAVE_BLAS)
"""


REASONING = """
import sys
from suave_des.knowledge.pellet import in_process as java
java.start()
print("numpy" in sys.modules)

import jpype, numpy
print(numpy.asarray(jpype.JArray(jpype.JDouble)(numpy.arange(3.0))))
"""


HEAVY = "numpy numba pandas scipy matplotlib simpy pydantic_core yaml owlready2 rdflib jpype multiprocessing"


@pytest.mark.parametrize(
    ("program", "unused"),
    [
        (
            "import suave_des\nassert not [name for name in sys.modules if name.startswith('suave_des.')]",
            HEAVY + " rich",
        ),
        (
            "import suave_des.cli.main as cli\ntry:\n    cli.main(['--help'])\nexcept SystemExit:\n    pass",
            HEAVY,
        ),
        (
            "import suave_des; suave_des.Mission('seams2023').advance(5.0)",
            "matplotlib plotly gymnasium http.server distributed pandas owlready2 jpype",
        ),
    ],
    ids=["package", "help", "mission"],
)
def test_what_is_not_used_is_not_loaded(program, unused):
    done = python(
        "-c", f"import sys\n{program}\nprint(sorted(set({unused.split()}) & set(sys.modules)))"
    )
    assert done.stdout.splitlines()[-1:] == ["[]"], done.stderr


def test_linear_algebra_is_loaded_by_what_uses_it_only():
    first, second, third, has_blas = python("-c", COMPILING).stdout.splitlines()
    assert first == "3.0 False"
    assert [round(float(number), 9) for number in second.split()[:2]] == [7.0, -5.0]
    assert second.endswith("True")
    assert (third, has_blas) == ("1.0", "True")


def test_java_starts_without_numpy_which_can_be_used_with_it():
    assert python("-c", REASONING).stdout.splitlines() == ["False", "[0. 1. 2.]"]


def test_what_is_hidden_cannot_be_imported():
    sys.modules.pop("this", None)
    with pytest.raises(ImportError), hidden("this"):
        __import__("this")
    assert "this" not in sys.modules


def test_what_is_hidden_can_be_imported_by_other_threads():
    sys.modules.pop("this", None)
    with hidden("this"), ThreadPoolExecutor(1) as other:
        found = other.submit(__import__, "this").result()
    assert found is sys.modules["this"]


def test_what_is_loaded_is_not_hidden():
    with hidden("os"):
        assert __import__("os") is os
    assert sys.modules["os"] is os


KNOWN_CIRCLES = ()
"""Circles that are there still; this list only gets shorter."""


def imported_by(file: Path, modules: set[str]) -> set[str]:
    """Modules that a file imports anywhere: in functions, and for types only, too."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    return found & modules


def test_no_modules_import_each_other_in_a_circle():
    package = Path(suave_des.__file__).parent
    # A package's __init__.py hands on names of modules below it, and is no part of a circle.
    files = {
        ".".join(file.relative_to(package.parent).with_suffix("").parts): file
        for file in package.rglob("*.py")
        if file.name != "__init__.py"
    }
    imports = {module: imported_by(file, set(files)) for module, file in files.items()}
    reached = {module: set(direct) for module, direct in imports.items()}
    for between in files:  # Warshall's closure
        for module in files:
            if between in reached[module]:
                reached[module] |= reached[between]
    circles = {frozenset(other for other in reached[one] if one in reached[other]) for one in files}
    shown = [
        sorted(module.removeprefix("suave_des.") for module in circle)
        for circle in circles
        if circle
    ]
    assert not [
        circle for circle in shown if not any(set(circle) <= known for known in KNOWN_CIRCLES)
    ]


def test_on_windows_it_says_where_it_runs():
    done = python("-c", "import os; os.name = 'nt'; import suave_des")
    assert done.returncode == 1
    told = done.stderr.splitlines()[-1]
    assert told.startswith("ImportError: suave-des runs on Linux and macOS") and "WSL" in told
