"""Write tests in YAML: of states that would cover more, and of the decisions of a recorded mission."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from suave_des.errors import InputError
from suave_des.knowledge.regions import regions_of
from suave_des.knowledge.state import KnowledgeState
from suave_des.resources import find, shipped_folder
from suave_des.workbench.knowledge_base import KnowledgeBase
from suave_des.workbench.prover import Prover, Situation
from suave_des.workbench.replay import mission_scenario
from suave_des.workbench.state_input import recorded_states, state_dict
from suave_des.workbench.testing.reading import TestedKnowledge


def tests_text(
    about: TestedKnowledge, prover: Prover, states: Iterable[tuple[str, KnowledgeState]], comment: str
) -> str:
    """Write tests that expect what follows in states now.

    Args:
        about: the knowledge base, as the file names it.
        prover: the same, in Pellet.
        states: each with the name of its test.
        comment: for the head of the file.

    Raises:
        KnowledgeError: the reasoner takes too long.
    """
    head = [f"# {comment}", f"scenario: {json.dumps(about.scenario)}"]
    for key in ("ontologies", "rules", "disabled_rules"):
        if names := getattr(about, key):
            head.append(f"{key}: {json.dumps(list(map(str, names)))}")
    lines = [*head, "tests:"]
    for name, state in states:
        lines += _test_lines(name, state, prover)
    return "\n".join(lines) + "\n"


def _test_lines(name: str, state: KnowledgeState, prover: Prover) -> Iterator[str]:
    outcome = prover.outcome(Situation(state))
    yield f"- name: {json.dumps(name, ensure_ascii=False)}"
    yield "  given:"
    for kind, content in state_dict(state).items():
        if content:
            yield f"    {kind}: {_flow(content)}"
    if outcome.conclusion is None:
        yield "  contradiction: true"
        return
    facts = sorted(map(str, outcome.inferred))
    if facts:
        yield "  follows:"
        yield from (f"  - {json.dumps(fact, ensure_ascii=False)}" for fact in facts)
    asked = [each.function for each in state.objectives]
    yield f"  decides: {_flow({function: outcome.choice(function) for function in asked})}"


def _flow(content: Mapping[str, Any]) -> str:
    """A mapping on one line; numbers that are text, so that they stay exact, are written as numbers."""
    return "{" + ", ".join(f"{name}: {_scalar(value)}" for name, value in content.items()) + "}"


def _scalar(value: Any) -> str:
    if value is None:
        return ""
    return value if value.replace(".", "", 1).replace("_", "").isalnum() else json.dumps(value, ensure_ascii=False)


def mission_states(folder: Path, bench: KnowledgeBase) -> Iterator[tuple[str, KnowledgeState]]:
    """Return the states of a recorded mission, named, one for each kind that the rules can tell apart.

    Raises:
        InputError: there is no recorded mission.
    """
    regions = regions_of(bench.base)
    seen = set()
    for record in recorded_states(folder):
        key = regions.key(record.state)
        if key not in seen:
            seen.add(key)
            yield f"{folder.name} at {record.t_s:.2f} s", record.state


def mission_knowledge(folder: Path) -> TestedKnowledge:
    """The knowledge base of a recorded mission, as a file of tests names it.

    Raises:
        InputError: there is no recorded mission.
    """
    scenario = mission_scenario(folder)
    knowledge = scenario.knowledge
    try:
        find(scenario.name, "scenarios")
        name = scenario.name
    except InputError:
        name = TestedKnowledge.scenario
    files = [find(each, "ontology") for each in knowledge.ontologies]
    shipped = shipped_folder("ontology")
    return TestedKnowledge(
        name,
        () if all(file.parent == shipped for file in files) else tuple(file.absolute() for file in files),
        tuple(find(each, "ontology").absolute() for each in knowledge.rules),
        tuple(knowledge.disabled_rules),
    )
