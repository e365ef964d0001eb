"""Opens the knowledge base of a scenario, and checks that it fits the mission and the modes file."""

from __future__ import annotations

from decimal import Decimal
from functools import lru_cache
from pathlib import Path

from suave_des.domain import MISSION_FUNCTIONS
from suave_des.errors import InputError, KnowledgeError
from suave_des.knowledge.deliberation import Deliberation
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.reasoners import make_reasoner
from suave_des.scenario.loader import LoadedScenario


def open_base(loaded: LoadedScenario) -> Ontology:
    """The scenario's knowledge base with its values and rules, and no reasoner.

    Raises:
        KnowledgeError: the ontologies or rules cannot be read.
    """
    knowledge = loaded.scenario.knowledge
    try:
        return Ontology.load(
            loaded.ontologies,
            values={name: Decimal(repr(value)) for name, value in knowledge.values.items()},
            rules=loaded.rules,
            disabled_rules=knowledge.disabled_rules,
        )
    except KnowledgeError as error:
        raise loaded.located(error) from None


def open_knowledge(loaded: LoadedScenario) -> Deliberation:
    """The scenario's knowledge base with the reasoner that the scenario names.

    Raises:
        KnowledgeError: the ontologies cannot be read, or lack a design for a function of the mission.
        InputError: a function design of the knowledge base has no mode of its name in the modes file.
    """
    knowledge = loaded.scenario.knowledge
    values = tuple((name, Decimal(repr(value))) for name, value in sorted(knowledge.values.items()))
    try:
        deliberation = _open(
            loaded.ontologies,
            tuple(sorted(loaded.inputs.items())),
            values,
            loaded.rules,
            knowledge.disabled_rules,
            knowledge.reasoner,
        )
    except KnowledgeError as error:
        raise loaded.located(error) from None
    base = deliberation.base
    base.check(MISSION_FUNCTIONS)
    for function in MISSION_FUNCTIONS:
        for design in base.designs(function):
            if design not in loaded.modes.modes(function):
                raise InputError(
                    f"function {function} has no mode {design}, but the ontology has a function design of that name",
                    file=loaded.modes_path,
                    place=function,
                    remedy="add the mode, or remove the design from the ontology",
                )
    return deliberation


@lru_cache(maxsize=4)
def _open(
    ontologies: tuple[Path, ...],
    hashes: tuple[tuple[str, str], ...],
    values: tuple[tuple[str, Decimal], ...],
    rules: tuple[Path, ...],
    disabled_rules: tuple[str, ...],
    reasoner: str,
) -> Deliberation:
    """Kept between scenarios that differ in other things: what was inferred stays true while the files' hashes do."""
    base = Ontology.load(ontologies, values=dict(values), rules=rules, disabled_rules=disabled_rules)
    return Deliberation(base, make_reasoner(reasoner, base))
