"""Report mistakes in the user's ontologies, rules and scenarios before missions run, as `kb check` does."""

from __future__ import annotations

import logging
from typing import Final

from suave_des.errors import MISTAKES_LOGGER
from suave_des.knowledge.checks.findings import Level, ordered
from suave_des.knowledge.checks.static import static_findings
from suave_des.knowledge.ontology import Ontology
from suave_des.resources import shipped_folder
from suave_des.scenario.loader import LoadedScenario
from suave_des.scenario_knowledge import subject_of

SHOWN: Final = 10
"""Mistakes that are reported one by one."""
_reported: set[tuple[str, tuple[str, ...]]] = set()
"""What this process has already reported, of which knowledge base."""
_checked: set[int] = set()
"""Hashes of what this process has already checked: a script may run thousands of missions with the same files."""


def report_mistakes(loaded: LoadedScenario, base: Ontology) -> None:
    """Log the errors and warnings that `kb check` has without a reasoner, as it words them; once for the same files.

    This takes some 40 ms, and nothing if all files are the shipped ones, which have no mistakes.

    Args:
        loaded: the scenario with its files.
        base: its knowledge base.
    """
    logger = logging.getLogger(MISTAKES_LOGGER)
    if not logger.isEnabledFor(logging.WARNING) or not _has_own_files(loaded):
        return
    files = tuple(sorted(loaded.inputs.items())), loaded.ontologies, loaded.rules
    checked = hash((base.content_hash, loaded.scenario.model_dump_json(), files))
    if checked in _checked:
        return
    _checked.add(checked)
    findings = static_findings(subject_of(loaded), base.sources).findings
    lines = [str(each) for each in ordered(findings) if each.level is not Level.INFO]
    known = base.content_hash, tuple(lines)
    if not lines or known in _reported:
        return
    _reported.add(known)
    for line in lines[:SHOWN]:
        logger.warning("%s", line)
    more = f"{len(lines) - SHOWN} more; " if len(lines) > SHOWN else ""
    logger.warning("note: %ssuave-des kb check, with the same files, looks for contradictions, too", more)


def _has_own_files(loaded: LoadedScenario) -> bool:
    shipped = [shipped_folder(kind).resolve() for kind in ("ontology", "scenarios")]
    files = (loaded.path, loaded.modes_path, *loaded.ontologies, *loaded.rules)
    return any(not any(path.resolve().is_relative_to(folder) for folder in shipped) for path in files)
