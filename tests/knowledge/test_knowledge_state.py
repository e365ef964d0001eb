"""States are exact, sorted and hashable."""

from __future__ import annotations

import subprocess
import sys
from decimal import Decimal

import pytest

from suave_des.errors import KnowledgeError
from suave_des.knowledge.state import KnowledgeState, ObjectiveState, exact
from tests.helpers.knowledge_states import SEARCH


@pytest.mark.parametrize(
    ("number", "text"),
    [(0.1, "0.1"), (2.50, "2.5"), (1e-5, "0.00001"), (1e16, "10000000000000000"), (3, "3"), ("1.20", "1.2")],
)
def test_a_float_becomes_the_decimal_that_its_shortest_text_denotes(number: float | str, text: str) -> None:
    assert str(exact(number)) == text


@pytest.mark.parametrize("number", [float("nan"), float("inf"), "fast", Decimal("1e100000")])
def test_what_is_no_ordinary_number_is_refused(number: float | str) -> None:
    with pytest.raises(KnowledgeError, match="number"):
        exact(number)


def test_the_order_in_which_a_state_is_given_does_not_matter() -> None:
    objectives = [ObjectiveState("f_b"), ObjectiveState("f_a", "UNGROUNDED")]
    one = KnowledgeState.of(objectives, measurements={"x": 1.0, "w": 2}, components={"c2": "FALSE", "c1": "OK"})
    other = KnowledgeState.of(
        reversed(objectives), measurements={"w": 2.0, "x": 1}, components={"c1": "OK", "c2": "FALSE"}
    )
    assert one == other
    assert hash(one) == hash(other)


def test_a_function_has_one_objective() -> None:
    with pytest.raises(KnowledgeError, match=f"{SEARCH} has two objectives"):
        KnowledgeState.of([ObjectiveState(SEARCH), ObjectiveState(SEARCH, "UNGROUNDED")])


def test_importing_the_room_starts_and_loads_nothing() -> None:
    code = (
        "import sys, suave_des.knowledge, suave_des.knowledge.state\n"
        "print([name for name in ('jpype', 'owlready2', 'rdflib') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
    code = (
        "import jpype, suave_des.knowledge.reasoner\n"
        "from suave_des.knowledge.pellet import in_process, stock\n"
        "print(jpype.isJVMStarted())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
