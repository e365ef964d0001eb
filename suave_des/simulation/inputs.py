"""The inputs of missions, checked before they run: what may be given, and which files decide
results.
"""

from __future__ import annotations

import logging
from collections.abc import Hashable, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

from suave_des.errors import MISTAKES_LOGGER, InputError, Level, ordered
from suave_des.files import LIMIT_BYTES, sha256_of
from suave_des.managing.base import ManagingSubsystem
from suave_des.registry import custom_functions, declared_files, manager_class
from suave_des.resources import hashes, shipped_folder
from suave_des.scenario.loader import LoadedScenario
from suave_des.tracebacks import cause_of
from suave_des.user_code import code_files, tell_code

if TYPE_CHECKING:  # owlready2 is loaded only when it is needed
    from suave_des.knowledge.ontology import Ontology

_told: set[Hashable] = set()
"""What this process has checked for mistakes, and reported: a script may run thousands of missions
with the same.
"""


def check_inputs(
    scenarios: Sequence[LoadedScenario], managers: Sequence[str], replacements: Mapping[str, Any]
) -> dict[str, str]:
    """Check the inputs of missions before they run: functions, knowledge base, managers and their
    files.

    The knowledge base is opened if a manager uses it or the user gave ontologies or rules.

    Args:
        scenarios: those of the missions; what differs between them is what managers and functions
            are set to.
        replacements: what the user gave instead of the scenario's own files, as of load_scenario.

    Returns:
        SHA-256 of each input file that is not among those of the scenario, by its name as shown to
        the user, or its place among modules: of ontologies that are imported, of code, and of files
        that managers declare.

    Raises:
        InputError: a function has no node; the knowledge base cannot be used; a manager refuses the
            scenario, or a file of it cannot be read.
    """
    for each in scenarios:
        tell_code(each.path, [settings.node for settings in each.scenario.functions.values()])
    kinds = {name: manager_class(name) for name in managers}
    given = any(replacements.get(name) for name in ("ontologies", "rules", "disabled_rules"))
    files = list[Path]()
    if given or any(kind.needs_knowledge for kind in kinds.values()):
        files += _check_knowledge(scenarios[0])
    for each, (manager, kind) in product(scenarios, kinds.items()):
        _check_manager(manager, kind, each)
    files += declared_files(scenarios, kinds).values()
    functions = [kind for each in scenarios for kind in custom_functions(each).values()]
    return _with_code(hashes(files, LIMIT_BYTES), code_files(managers, functions))


def _with_code(inputs: dict[str, str], code: Mapping[str, Path]) -> dict[str, str]:
    """Add the files of code to the hashes of input files, which may have the names of modules."""
    places = {place: f"module {place}" if place in inputs else place for place in code}
    return inputs | {places[place]: sha256_of(path) for place, path in code.items()}


def _check_manager(name: str, kind: type[ManagingSubsystem], loaded: LoadedScenario) -> None:
    """Have a manager check a scenario."""
    try:
        kind.check(loaded)
    except InputError:
        raise
    except Exception as error:  # whatever a manager's own code raises
        raise InputError(f"manager {name}: check raised {cause_of(error)}") from error


def _check_knowledge(loaded: LoadedScenario) -> Sequence[Path]:
    """Open a scenario's knowledge base and draw its first conclusion; return its files.

    What `kb check` would say without a reasoner is logged. That takes some 40 ms, and nothing if
    all files are the shipped ones, which have no mistakes.
    """
    from suave_des.knowledge.state import KnowledgeState
    from suave_des.scenario_knowledge import open_knowledge

    knowledge = open_knowledge(loaded)
    knowledge.analyze_and_plan(KnowledgeState())
    for assumption in knowledge.base.assumptions.values():
        logging.getLogger("suave_des").warning("note: %s", assumption)
    shipped = [shipped_folder(kind).resolve() for kind in ("ontology", "scenarios")]
    for path in (loaded.path, loaded.modes_path, *loaded.ontologies, *loaded.rules):
        if not any(path.resolve().is_relative_to(folder) for folder in shipped):
            _tell_mistakes(loaded, knowledge.base)
            break
    return knowledge.base.files


def _tell_mistakes(loaded: LoadedScenario, base: Ontology) -> None:
    """Log what is wrong with a scenario's knowledge base, errors and warnings, once for the same
    files.
    """
    from suave_des.knowledge.checks import findings_in
    from suave_des.scenario_knowledge import subject_of

    logger = logging.getLogger(MISTAKES_LOGGER)
    checked = (
        base.content_hash,
        loaded.scenario.model_dump_json(),
        *loaded.inputs.values(),
        *(loaded.path, loaded.modes_path, *loaded.ontologies, *loaded.rules),
    )
    if checked in _told or not logger.isEnabledFor(logging.WARNING):
        return
    _told.add(checked)
    findings = ordered(findings_in(base, subject_of(loaded)))
    mistakes = [each for each in findings if each.level is not Level.NOTE]
    for each in mistakes:
        logger.warning("%s", each)
    if mistakes:
        logger.warning(
            "note: suave-des kb check, with the same files, looks for contradictions, too"
        )
