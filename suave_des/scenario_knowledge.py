"""Opens the knowledge base of a scenario, and checks that it fits the mission and the modes
file.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING

from suave_des.domain import BATTERY_LEVEL, THRUSTER_NAMES
from suave_des.errors import InputError, KnowledgeError
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.reasoner import Reasoner
from suave_des.monitor.diagnostics import FAILED, HULL, LEAK, RECOVERED
from suave_des.resources import find
from suave_des.scenario.loader import LoadedScenario
from suave_des.scenario.models import Scenario

if TYPE_CHECKING:
    from suave_des.knowledge.checks import Subject

REPORTED_STATUSES = {**dict.fromkeys(THRUSTER_NAMES, (FAILED, RECOVERED)), HULL: (LEAK,)}
"""The statuses that monitors report of each component."""
OPENED = 4
_opened: dict[Hashable, Reasoner] = {}
"""Knowledge bases that are kept open, the oldest first."""


def open_base(loaded: LoadedScenario) -> Ontology:
    """The scenario's knowledge base with its values and rules, and no reasoner.

    Raises:
        KnowledgeError: the ontologies or rules cannot be read.
    """
    from suave_des.knowledge.checks import check_revision

    scenario = loaded.scenario
    try:
        base = read_base(scenario, loaded.ontologies, loaded.rules)
        check_revision(base, measured_attributes(scenario), scenario.revision.name)
        return base
    except KnowledgeError as error:
        part, _, name = (error.place or "").partition(".")
        if error.file is not None or part not in ("values", "disabled_rules"):
            raise
        # A name that the scenario or the command line gives, and that only the ontology could
        # check.
        in_file = loaded.layer.data.get("knowledge", {}).get(part, ())
        if name not in in_file:
            raise InputError(error.problem, place="--disable-rule", remedy=error.remedy) from None
        key = name if part == "values" else in_file.index(name)
        raise loaded.layer.error(error.problem, ("knowledge", part, key), error.remedy) from None


def read_base(
    scenario: Scenario,
    ontologies: Sequence[Path] | None = None,
    rules: Sequence[Path] | None = None,
) -> Ontology:
    """Read ontologies and files of rules as open_base does, by default those that a scenario
    names.
    """
    knowledge = scenario.knowledge
    values = _values(scenario)
    named = (
        [find(each, "ontology") for each in knowledge.ontologies]
        if ontologies is None
        else ontologies
    )
    texts = [find(each, "ontology") for each in knowledge.rules] if rules is None else rules
    return Ontology.load(
        named,
        values=values,
        rules=texts,
        disabled_rules=knowledge.disabled_rules,
        operators=scenario.revision.comparison_operators,
    )


def measured_attributes(scenario: Scenario) -> tuple[str, ...]:
    """Return the quality attributes that a scenario's monitors measure, sorted."""
    return tuple(
        sorted({*scenario.signals, *(() if scenario.battery is None else (BATTERY_LEVEL,))})
    )


def subject_of(loaded: LoadedScenario) -> Subject:
    """Return what `kb check` checks of a scenario: its knowledge base, and what missions have to do
    with it.
    """
    from suave_des.knowledge.checks import Subject  # which missions do not need

    knowledge = loaded.scenario.knowledge
    return Subject(
        ontologies=loaded.ontologies,
        rules=loaded.rules,
        disabled_rules=knowledge.disabled_rules,
        values=_values(loaded.scenario),
        modes={name: loaded.modes.modes(name) for name in loaded.modes.functions},
        needed=loaded.scenario.needed_functions(),
        revision=loaded.scenario.revision.name,
        operators=loaded.scenario.revision.comparison_operators,
        reported=REPORTED_STATUSES,
        measured=measured_attributes(loaded.scenario),
        reaction_thresholds_m=loaded.scenario.reaction_metric.visibility_thresholds_m,
    )


def _values(scenario: Scenario) -> dict[str, Decimal]:
    return {name: Decimal(repr(value)) for name, value in scenario.knowledge.values.items()}


def open_knowledge(loaded: LoadedScenario) -> Reasoner:
    """The scenario's knowledge base with the reasoner that the scenario names.

    Raises:
        KnowledgeError: the ontologies cannot be read, or lack a design for a function of the
            mission.
        InputError: a function design of the knowledge base has no mode of its name in the modes
            file.
    """
    # What was inferred stays true in scenarios that differ in other things, while the files' hashes
    # are the same.
    knowledge = loaded.scenario.knowledge.model_dump_json(), tuple(sorted(loaded.inputs.items()))
    operators = tuple(sorted(loaded.scenario.revision.comparison_operators.items()))
    same = *knowledge, loaded.ontologies, loaded.rules, operators
    reasoner = _opened.get(same)
    if reasoner is None:
        opened = open_base(loaded)
        reasoner = Reasoner(opened, loaded.scenario.knowledge.reasoner)
        if len(_opened) >= OPENED:
            del _opened[next(iter(_opened))]
        _opened[same] = reasoner
    base = reasoner.base
    functions = loaded.scenario.needed_functions()
    base.check(functions)
    for function in functions:
        if missing := [
            each for each in base.designs(function) if each not in loaded.modes.modes(function)
        ]:
            problem = (
                f"function {function} has no mode {missing[0]}, but the ontology has such a design"
            )
            remedy = "add the mode, or remove the design from the ontology"
            raise InputError(problem, file=loaded.modes_path, place=function, remedy=remedy)
    return reasoner
