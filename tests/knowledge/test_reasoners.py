"""Reasoners by name, their Java, their memory, and their behaviour in worker processes."""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

import suave_des
from suave_des.errors import InputError, KnowledgeError
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet import java
from suave_des.knowledge.reasoners import BACKENDS, CACHED_STATES, Reasoner, make_reasoner
from tests.helpers.knowledge_states import SEARCH, searching


def test_an_unknown_reasoner_is_told_with_those_known(kb: Ontology) -> None:
    with pytest.raises(InputError, match=r"there is no reasoner 'hermit' \(one of cached, owlready2, pellet\)"):
        make_reasoner("hermit", kb)
    assert all(make_reasoner(name, kb).name == name for name in BACKENDS)


def test_the_same_state_is_reasoned_on_once(pellet: Reasoner) -> None:
    assert pellet.infer(searching("fd_spiral_low", 1.30)) is pellet.infer(searching("fd_spiral_low", "1.3"))


def test_the_memory_of_states_is_bounded(kb: Ontology, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("suave_des.knowledge.reasoners.CACHED_STATES", 2)
    reasoner = make_reasoner("pellet", kb)
    first = reasoner.infer(searching("fd_spiral_low", 1))
    for visibility in (2, 3):
        reasoner.infer(searching("fd_spiral_low", visibility))
    again = reasoner.infer(searching("fd_spiral_low", 1))
    assert again == first
    assert again is not first
    assert CACHED_STATES >= 1000


def fake_java(folder: Path, says: str) -> Path:
    program = folder / "bin" / "java"
    program.parent.mkdir(parents=True)
    program.write_text(f"#!/bin/sh\necho '{says}' >&2\n")
    program.chmod(0o755)
    return folder


@pytest.mark.parametrize(
    ("says", "found"),
    [('openjdk version "17.0.9" 2023-10-17', "17"), ('java version "1.8.0_392"', "8"), ('x version "24-ea"', "24")],
)
def test_a_java_that_is_too_old_is_told_with_both_versions(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kb: Ontology, says: str, found: str
) -> None:
    monkeypatch.setenv("JAVA_HOME", str(fake_java(tmp_path / "jdk", says)))
    with pytest.raises(InputError, match=f"has Java {found}, but Java 25 is needed"):
        java.java_home()


def test_a_java_home_without_java_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("JAVA_HOME", str(tmp_path))
    with pytest.raises(InputError, match="there is no Java that runs in it"):
        java.java_home()
    monkeypatch.setenv("JAVA_HOME", str(fake_java(tmp_path / "jdk", "hello")))
    with pytest.raises(InputError, match="does not report its version"):
        java.java_home()


def test_a_java_home_that_is_new_enough_is_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    home = fake_java(tmp_path / "jdk", 'openjdk version "26" 2026-03-17')
    monkeypatch.setenv("JAVA_HOME", str(home))
    assert java.java_executable() == home / "bin" / "java"
    with pytest.raises(InputError, match="no server library"):
        java.java_library()
    monkeypatch.delenv("JAVA_HOME")
    assert java.java_library().is_file()


@pytest.mark.parametrize("visibility", [3.0, 4.0])
def test_owlready2_leaves_no_temporary_file_behind(
    kb: Ontology, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, visibility: float
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    reasoner = make_reasoner("owlready2", kb)
    state = searching("fd_spiral_high", visibility, status="UNGROUNDED")
    if visibility < 3.25:
        with pytest.raises(KnowledgeError, match="contradiction"):
            reasoner.infer(state)
    else:
        reasoner.infer(state)
    assert not [path for path in tmp_path.iterdir() if path.is_file()]


def infer_in_worker(design: str) -> tuple[int, str | None]:
    reasoner = make_reasoner("pellet", Ontology.load())
    return os.getpid(), reasoner.infer(searching(design, 2.0)).objective_status(SEARCH)


def test_spawned_workers_reason_each_with_a_java_of_its_own(pellet: Reasoner) -> None:
    pellet.infer(searching("fd_spiral_high", 2.0))
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        done = pool.map(infer_in_worker, ["fd_spiral_high", "fd_spiral_low"], chunksize=1)
    assert [status for _, status in done] == ["IN_ERROR_NFR", None]
    assert os.getpid() not in {pid for pid, _ in done}


#: Reasons, is interrupted, and forks; a line of its own tells one from the next.
PROGRAM = """
import os, signal, time
from suave_des.errors import InputError
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.reasoners import make_reasoner
from tests.helpers.knowledge_states import searching

reasoner = make_reasoner("pellet", Ontology.load())
reasoner.infer(searching("fd_spiral_high", 2.0))
print("--", flush=True)
try:
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(5)
except KeyboardInterrupt:
    print("interrupted")
print("--", flush=True)
if os.fork() == 0:
    try:
        reasoner.infer(searching("fd_spiral_high", 2.5))
    except InputError as error:
        os.write(1, str(error).encode())
    os._exit(0)
os.wait()
"""


@pytest.fixture(scope="module")
def program() -> subprocess.CompletedProcess[str]:
    """A process of its own with Java in it."""
    environment = {**os.environ, "PYTHONPATH": str(Path(suave_des.__file__).parents[1])}
    return subprocess.run(
        [sys.executable, "-c", PROGRAM], env=environment, capture_output=True, text=True, timeout=120, check=False
    )


def test_reasoning_prints_nothing(program: subprocess.CompletedProcess[str]) -> None:
    assert (program.returncode, program.stderr) == (0, "")
    assert program.stdout.startswith("--\n")


def test_ctrl_c_reaches_python_while_java_runs(program: subprocess.CompletedProcess[str]) -> None:
    assert program.stdout.split("--\n")[1] == "interrupted\n"


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_process_forked_after_java_has_started_is_told_instead_of_hanging(
    program: subprocess.CompletedProcess[str],
) -> None:
    assert "Java was started before this process was forked" in program.stdout.split("--\n")[2]
