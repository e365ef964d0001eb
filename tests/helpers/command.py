"""Runs the command line: as users do, in a process of its own, or in this one, which is quicker."""

from __future__ import annotations

import contextlib
import io
import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

import suave_des
from suave_des.cli.main import main
from suave_des.imports import _Beside
from tests.helpers.needed import need

_PACKAGE_PARENT = str(Path(suave_des.__file__).resolve().parents[1])


EXAMPLES = ("perl", "node", "c")
"""Languages of the managers in docs/examples/exec."""


def example_program(language: str) -> str:
    """The command that runs the example of a manager in a language; C is compiled into the current
    folder.
    """
    folder = Path(__file__).resolve().parents[2] / "docs" / "examples" / "exec"
    needed, command = {
        "perl": ("perl with JSON::PP", f"perl {shlex.quote(str(folder / 'manager.pl'))}"),
        "node": ("node", f"node {shlex.quote(str(folder / 'manager.js'))}"),
        "c": ("gcc", "./manager"),
    }[language]
    need(needed)
    if language == "c":
        subprocess.run(["gcc", "-O2", "-o", "manager", folder / "manager.c"], check=True)
    return command


def python(
    *arguments: str, cwd: Path | None = None, **environment: str
) -> subprocess.CompletedProcess[str]:
    """Run `python ARGUMENTS` in a folder, with the package that is under test."""
    path = os.pathsep.join(filter(None, [_PACKAGE_PARENT, os.environ.get("PYTHONPATH")]))
    environment = {**os.environ, "PYTHONPATH": path, **environment}
    command = [sys.executable, *map(str, arguments)]
    return subprocess.run(
        command, cwd=cwd, env=environment, capture_output=True, text=True, timeout=300, check=False
    )


def suave_des_command(
    *arguments: str, cwd: Path, **environment: str
) -> subprocess.CompletedProcess[str]:
    """Run `suave-des ARGUMENTS` in a folder, with the package that is under test."""
    return python("-m", "suave_des", *arguments, cwd=cwd, **environment)


def command_here(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Run `suave-des ARGUMENTS` in a folder, in this process; modules of that folder are forgotten
    at the end.
    """
    path, out, err = list(sys.path), io.StringIO(), io.StringIO()
    finders = list(sys.meta_path)
    with contextlib.chdir(cwd), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main(arguments)
        except SystemExit as end:
            status = int(end.code or 0)
        finally:
            sys.path[:] = path
            # Others may have been added or changed by libraries that were imported meanwhile.
            own = [
                each for each in sys.meta_path if isinstance(each, _Beside) and each not in finders
            ]
            for each in own:
                sys.meta_path.remove(each)
            for name, module in list(sys.modules.items()):
                if str(getattr(module, "__file__", None) or "").startswith(str(cwd)):
                    del sys.modules[name]
    return subprocess.CompletedProcess(arguments, status, out.getvalue(), err.getvalue())


def wait_until(is_so: Callable[[], object], longest_s: float = 120.0) -> None:
    """Wait for something, and fail if it does not come."""
    end_s = time.monotonic() + longest_s
    while not is_so():
        assert time.monotonic() < end_s
        time.sleep(0.005)


def has_size(path: Path, size: int) -> bool:
    """Whether a file is there and has that size, in bytes."""
    return path.exists() and path.stat().st_size >= size


class Ended(NamedTuple):
    """What a command has left."""

    status: int
    out: str
    err: str


@pytest.fixture
def command(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> Callable[..., Ended]:
    """Runs the command line in this process, in the current folder."""
    monkeypatch.setattr(sys, "path", list(sys.path))

    def run(*arguments: object) -> Ended:
        with pytest.raises(SystemExit) as ended:
            main(list(map(str, arguments)))
        return Ended(int(ended.value.code or 0), *capsys.readouterr())

    return run


@contextlib.contextmanager
def ends_within(seconds: int) -> Iterator[None]:
    """Fail a block that takes longer."""

    def late(*_: object) -> None:
        raise AssertionError(f"not done after {seconds} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def stopped_for(seconds: float, program: str, *also: str) -> subprocess.CompletedProcess[str]:
    """Run a Python program, and stop it for a while, as Ctrl-Z does, from its first line of output
    on.

    With it the processes are stopped whose numbers that line has.
    """
    path = os.pathsep.join(filter(None, [_PACKAGE_PARENT, os.environ.get("PYTHONPATH")]))
    with subprocess.Popen(
        [sys.executable, "-c", program, *also],
        env={**os.environ, "PYTHONPATH": path},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        others = [int(word) for word in process.stdout.readline().split() if word.isdigit()]
        for number in (process.pid, *others):
            os.kill(number, signal.SIGSTOP)
        time.sleep(seconds)
        for number in (process.pid, *others):
            os.kill(number, signal.SIGCONT)
        out, err = process.communicate(timeout=120.0)
    return subprocess.CompletedProcess(process.args, process.returncode, out, err)
