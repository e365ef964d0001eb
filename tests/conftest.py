"""Settings of all tests: property tests draw the same examples on every machine, and are not timed
in any way.

Cached inferences are kept in a folder of the test run, away from the user's, which all its
processes share.
"""

import functools
import gc
import importlib.metadata
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from importlib.util import cache_from_source, find_spec
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from benchmarks import chaos
from suave_des.caches import private_cache
from suave_des.resources import find
from tests.helpers.command import command
from tests.helpers.owl_text import suave_copy
from tests.helpers.quick_workers import _warm_process, quick_campaigns, quick_workers

__all__ = ["_warm_process", "command", "quick_campaigns", "quick_workers", "suave_copy"]

settings.register_profile(
    "repeatable", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("repeatable")

# What is installed stays the same: each campaign asks for nine versions, whose files take ten
# milliseconds to read.
importlib.metadata.version = functools.cache(importlib.metadata.version)

# Modules and tests are a million objects, which Python's search for cycles would go through again
# and again: it was a fifth of the tests' time. What has been imported is left out of it; of the
# rest, half a million come before a search.
gc.disable()
_searched_without = 0

# Machine code is the same for all: it is kept where it always is, so that each run of the tests
# need not make it anew. So are compiled modules, whatever the environment says: hundreds of
# processes start.
os.environ.setdefault("NUMBA_CACHE_DIR", str(private_cache("numba")))
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
users_environment = dict(os.environ)
if "PYTEST_XDIST_WORKER" not in os.environ:  # such a process has inherited the setting
    os.environ["SUAVE_DES_CACHE_DIR"] = tempfile.mkdtemp(prefix="suave-des-tests-")

# which several test processes at once are given, as if there were a terminal
os.environ.pop("COLUMNS", None)

# A shell that runs tests in the background has them ignore Ctrl-C: those that press it, and their
# children, need it.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_setupnodes(config: pytest.Config, specs: list[object]) -> None:
    """In a new checkout or environment, make once what each process would make otherwise, or do
    without.

    That is compiled modules, and machine code of inner loops.
    """
    if len(specs) < 2:
        return
    sources = [Path(find_spec(name).origin) for name in ("pandas", "suave_des.simulation.mission")]
    programs = []
    if not all(Path(cache_from_source(source)).exists() for source in sources):
        programs += [
            ("-m", "tests.helpers.warm_worker"),
            ("-m", "pytest", "--collect-only", "-n", "0", *config.args),
        ]
    silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "env": users_environment}
    for process in [
        subprocess.Popen([sys.executable, *program], cwd=Path(__file__).parents[1], **silent)
        for program in programs
    ]:
        process.wait()


def pytest_collection_finish() -> None:
    """Search for cycles from now on, but not among what the collection of tests has imported."""
    _leave_out_of_the_search()
    gc.set_threshold(500_000, 10, 10)
    gc.enable()


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> None:
    """Leave out of the search what a test has imported, and what a module of tests has left, if it
    is much.

    Java has Python search for cycles in all that is not left out, whenever it collects its own
    garbage.
    """
    if nextitem is not None and nextitem.path != item.path and len(gc.get_objects()) > 40_000:
        gc.collect()
        _leave_out_of_the_search()
    elif len(sys.modules) > _searched_without + 50:
        _leave_out_of_the_search()


def _leave_out_of_the_search() -> None:
    global _searched_without
    gc.freeze()
    _searched_without = len(sys.modules)


def pytest_unconfigure(config: pytest.Config) -> None:
    """Remove the folder of cached inferences when the run is over."""
    if not hasattr(config, "workerinput"):
        shutil.rmtree(os.environ["SUAVE_DES_CACHE_DIR"], ignore_errors=True)


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Path]:
    """Writes a file in a fresh current folder and returns its path, relative as a user would give
    it.
    """
    monkeypatch.chdir(tmp_path)

    def write_file(name: str, content: str | bytes) -> Path:
        path = Path(name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write_file


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    """A scenario of short missions."""
    path = tmp_path / "short.yaml"
    path.write_text(chaos.SHORT)
    return path


@pytest.fixture(scope="session")
def shipped_modes() -> str:
    """Text of the shipped modes file."""
    return find("suave_modes.yaml", "scenarios").read_text(encoding="utf-8")
