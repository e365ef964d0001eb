"""The inputs of a campaign, which determine its results: scenario, variation, managers, files, code
and versions.

They are read first, which runs no code of the user's; then what they refer to may be trusted or
not; then they are checked, and every file that decides results is hashed.
"""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import json
import logging
import platform
import shlex
import sys
import sysconfig
from collections import Counter
from collections.abc import Collection, Hashable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from importlib.machinery import ModuleSpec
from itertools import product
from pathlib import Path
from typing import Any

import suave_des
from suave_des.caches import SharedEntries, private_cache
from suave_des.campaign.missions import Campaign
from suave_des.campaign.spec import CampaignFile, CampaignSpec
from suave_des.campaign.variation import check_drawn, read_ensemble, vary, with_ensemble
from suave_des.errors import MISTAKES_LOGGER, InputError, Level, ordered, relative_path, shown
from suave_des.files import LIMIT_BYTES, sha256_of
from suave_des.imports import find_here
from suave_des.learned import read_file
from suave_des.records.mission_folder import versions
from suave_des.registry import (
    custom_functions,
    declared_files,
    is_built_in,
    manager_class,
    takes_argument,
)
from suave_des.resources import hashes, shipped_folder, shown_name
from suave_des.scenario.loader import LoadedScenario, load_scenario
from suave_des.tracebacks import cause_of

_TIME_OUTS_S = {"owlready2": 1800.0}
"""Time that a mission may take with a reasoner, if not the default: owlready2 takes some two
minutes a mission.
"""
_told: set[Hashable] = set()
"""What this process has checked for mistakes, and reported: a script may run thousands of missions
with the same.
"""


def read_campaign(
    request: CampaignSpec, file: CampaignFile | None, loaded: LoadedScenario | None = None
) -> Campaign:
    """Read the scenario of a campaign, unless it is given, and what varies, without running any
    code of the user's.

    Raises:
        InputError: an input is invalid.
    """
    spec = request.with_file(file)
    loaded = load_scenario(
        loaded or (spec.scenario if file is None else file.scenario), **spec.replacements
    )
    with _located(file):
        loaded, variation = vary(loaded, spec.sweep, spec.perturbations, spec.runs_per_draw)
    inputs: dict[str, str] = {}
    if spec.ensemble is not None:
        ensemble, path, digest = read_ensemble(spec.ensemble)
        variation = with_ensemble(loaded, variation, ensemble, path)
        inputs = {shown_name(path): digest}
    if "time_out_s" not in spec.model_fields_set:
        time_out_s = _TIME_OUTS_S.get(loaded.scenario.knowledge.reasoner, spec.time_out_s)
        spec = spec.model_copy(update={"time_out_s": time_out_s})
    if spec.suave_format and variation.sweep.points > 1:
        remedy = "omit --format suave, or run a campaign for each point"
        raise InputError(
            "the exemplar's results file has no columns for swept values", remedy=remedy
        )
    return Campaign(request, spec, loaded, variation, file, inputs)


@contextmanager
def _located(file: CampaignFile | None) -> Iterator[None]:
    """Add file and line to errors about key paths of a campaign file."""
    try:
        yield
    except InputError as error:
        raise error if file is None else file.located(error) from None


def check_trusted(
    campaign: Campaign, named: Collection[str], folder: Path, *, confirmed: bool
) -> None:
    """Check that the user trusts the code that a campaign folder refers to; nothing is imported
    before that.

    He does if he has named or confirmed it, if it is imported already, as by a script that resumes
    its own campaign, or if he has begun the campaign himself.

    Raises:
        InputError: a manager or a class is neither.
    """

    def is_imported(name: str) -> bool:
        return ":" in name and not takes_argument(name) and name.partition(":")[0] in sys.modules

    unknown = [name for name in campaign.code() if name not in named and not is_imported(name)]
    begun = dict(_begun().read()) if unknown else {}
    if not confirmed and any(_note(folder, name) not in begun for name in unknown):
        problem = (
            f"the campaign would run the code of {', '.join(unknown)}, which this folder refers to"
        )
        remedy = f"if you trust it, give --managers {shlex.quote(','.join(unknown))} or --yes"
        raise InputError(problem, file=folder, remedy=remedy)


def note_own(campaign: Campaign, folder: Path) -> None:
    """Note, outside of its folder, that this user has begun a campaign with its code, see
    `check_trusted`.
    """
    for name in campaign.code():
        _begun().add(_note(folder, name), True)


def _begun() -> SharedEntries:
    return SharedEntries(private_cache("campaigns"), "begun")


def _note(folder: Path, name: str) -> str:
    """Return the note that this user has run code of this name from here, for this very folder.

    A folder from elsewhere has another number, and cannot bring such a note along.
    """
    found = folder.stat()
    place = json.dumps([str(folder.resolve()), found.st_dev, found.st_ino, str(Path.cwd()), name])
    return hashlib.sha256(place.encode(errors="replace")).hexdigest()


def check_campaign(campaign: Campaign) -> dict[str, str]:
    """Check the inputs of a campaign as check_inputs does, and return the SHA-256 of each further
    file that decides.
    """
    spec = campaign.spec
    with _located(campaign.file):
        check_drawn(campaign.loaded, campaign.variation)
    points = sorted(set(campaign.variation.sweep.each_value()))
    scenarios = (campaign.variation.scenario(campaign.loaded, point).scenario for point in points)
    for words, number in Counter(
        words for each in scenarios for words in each.without_effect()
    ).items():
        where = f", at {number} of {len(points)} swept values" if len(points) > 1 else ""
        logging.getLogger(MISTAKES_LOGGER).warning("note: %s%s", words, where)
    return {
        **campaign.inputs,
        **check_inputs(tuple(campaign.scenarios()), spec.managers, spec.replacements),
    }


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
    files, kinds = list[Path](), {name: manager_class(name) for name in managers}
    given = any(replacements.get(name) for name in ("ontologies", "rules", "disabled_rules"))
    if given or any(kind.needs_knowledge for kind in kinds.values()):
        files += _check_knowledge(scenarios[0])
    functions = [kind for each in scenarios for kind in custom_functions(each).values()]
    code = user_modules(managers, functions)
    # of a class that a package has installed, its module
    for module in _defining(managers, functions):
        path = Path(getattr(sys.modules[module], "__file__", None) or "")
        if path.is_file() and path not in code.values():
            code[f"{module.replace('.', '/')}{path.suffix}"] = path
    for each, (manager, kind) in product(scenarios, kinds.items()):
        try:
            kind.check(each)
        except InputError:
            raise
        except Exception as error:  # whatever a manager's own code raises
            raise InputError(f"manager {manager}: check raised {cause_of(error)}") from error
    files += declared_files(scenarios, kinds).values()
    inputs = hashes(files, LIMIT_BYTES)
    code = {
        place if place not in inputs else f"module {place}": path for place, path in code.items()
    }
    return inputs | {place: sha256_of(path) for place, path in code.items()}


def tell_code(file: Path, names: Iterable[str]) -> None:
    """Say, before it is run, that a file names code, and where that is; once in a process."""
    for name in sorted(names):
        if (file, name) in _told or ":" not in name or is_built_in(name):
            continue
        _told.add((file, name))
        kind, _, command = name.partition(":")
        what = f"the command {shown(command)}"
        if not takes_argument(name):
            spec = _spec(kind.partition(".")[0])
            place = None if spec is None else spec.origin or kind
            what = f"the code of {name}" + (f" ({relative_path(place)})" if place else "")
        logging.getLogger("suave_des").warning("note: %s has %s run", shown_name(file), what)


def _check_knowledge(loaded: LoadedScenario) -> Sequence[Path]:
    """Open a scenario's knowledge base and draw its first conclusion; return its files.

    What `kb check` would say without a reasoner is logged, errors and warnings, once for the same
    files. That takes some 40 ms, and nothing if all files are the shipped ones, which have no
    mistakes.
    """
    from suave_des.knowledge.checks import findings_in
    from suave_des.knowledge.state import KnowledgeState
    from suave_des.scenario_knowledge import open_knowledge, subject_of

    knowledge = open_knowledge(loaded)
    knowledge.analyze_and_plan(KnowledgeState())
    base = knowledge.base
    for assumption in base.assumptions.values():
        logging.getLogger("suave_des").warning("note: %s", assumption)
    logger = logging.getLogger(MISTAKES_LOGGER)
    shipped = [shipped_folder(kind).resolve() for kind in ("ontology", "scenarios")]
    files = (loaded.path, loaded.modes_path, *loaded.ontologies, *loaded.rules)
    if all(any(path.resolve().is_relative_to(folder) for folder in shipped) for path in files):
        return base.files
    checked = base.content_hash, loaded.scenario.model_dump_json(), *loaded.inputs.values(), files
    if checked in _told or not logger.isEnabledFor(logging.WARNING):
        return base.files
    _told.add(checked)
    subject = subject_of(loaded)
    findings = [
        each for each in ordered(findings_in(base, subject)) if each.level is not Level.NOTE
    ]
    for each in findings:
        logger.warning("%s", each)
    if findings:
        logger.warning(
            "note: suave-des kb check, with the same files, looks for contradictions, too"
        )
    return base.files


def trained_on(campaign: Campaign) -> Iterator[str]:
    """Yield a remark for each manager that was trained on missions of the campaign: its results say
    little.
    """
    own = campaign.loaded.scenario.name, campaign.spec.seed
    for manager in campaign.spec.managers:
        settings = [
            (each, each.manager_settings(manager).get("learned")) for each in campaign.scenarios()
        ]
        files = {
            each.manager_file(manager, str(name)) for each, name in settings if name is not None
        }
        trainings = [read_file(path) for path in files]
        if seen := [each.missions for each in trainings if (each.scenario, each.seed) == own]:
            last = min(campaign.spec.runs, max(seen))
            yield f"{manager}: runs 1 to {last} are missions that it was trained on; give a different --seed"


# The code of users' managers and functions: it decides results, and is sent to other machines.

_DECIDING = {
    "managers",
    "runs",
    "seed",
    "time_out_s",
    "sweep",
    "perturbations",
    "runs_per_draw",
    "record_knowledge",
}
"""Fields of the specification that determine results as they are."""
MAIN = "__main__.py"
"""Place of a script that defines a class itself."""
_INSTALLED = (
    *(
        Path(sysconfig.get_path(kind)).resolve()
        for kind in ("stdlib", "platstdlib", "purelib", "platlib")
    ),
    Path(suave_des.__file__).resolve().parent,
)


def _defining(managers: Iterable[str], functions: Iterable[type]) -> list[str]:
    """Return the modules that managers are named with, and those in which they and functions are
    defined.
    """
    modules = [kind.__module__ for kind in functions]
    for manager in managers:
        if not is_built_in(manager) and not takes_argument(manager):
            modules += [manager.partition(":")[0]] if ":" in manager else []
            modules.append(manager_class(manager).__module__)
    return list(dict.fromkeys(modules))


def user_modules(managers: Iterable[str], functions: Iterable[type]) -> dict[str, Path]:
    """Find the files that define managers and functions, and what these import: all that no package
    manager installed.

    Imports are read from the source, so that one inside a function counts too; one by a computed
    name does not.

    Returns:
        Each file by its place below a folder of modules, such as "package/module.py"; a script is
        at MAIN.
    """
    found: dict[str, Path] = {}
    names = _defining(managers, functions)
    if "__main__" in names:
        names.remove("__main__")
        script = Path(getattr(sys.modules["__main__"], "__file__", None) or "")
        if script.is_file():  # and no notebook
            found[MAIN] = script
            names += _imports(script, "")
    for name in names:  # it grows
        parts = name.split(".")
        for depth in range(1, len(parts) + 1):
            within = ".".join(parts[:depth])
            spec = _spec(within)
            if spec is None or not _is_users(spec):
                break
            if not spec.has_location or spec.origin is None:
                continue  # a folder without __init__.py
            path, is_package = Path(spec.origin), spec.submodule_search_locations is not None
            place = "/".join(parts[:depth]) + (
                f"/__init__{path.suffix}" if is_package else path.suffix
            )
            if place not in found:
                found[place] = path
                names += _imports(path, within if is_package else within.rpartition(".")[0])
    return found


def _spec(name: str) -> ModuleSpec | None:
    loaded = sys.modules.get(name)
    try:
        if loaded is not None:
            return loaded.__spec__
        return importlib.util.find_spec(name) if "." in name else find_here(name)
    except (ImportError, AttributeError, ValueError):  # a name in a module rather than a module
        return None


def _is_users(spec: ModuleSpec) -> bool:
    places = (
        [spec.origin]
        if spec.has_location and spec.origin
        else spec.submodule_search_locations or ()
    )
    paths = [Path(place).resolve() for place in places]
    return bool(paths) and not any(
        {"site-packages", "dist-packages"} & {*path.parts}
        or any(map(path.is_relative_to, _INSTALLED))
        for path in paths
    )


def _imports(path: Path, package: str) -> Iterator[str]:
    """Yield the names that a file imports; some of them may be names in modules."""
    try:
        tree = ast.parse(path.read_bytes())
    # compiled, or an import that is not reached, or it would have been raised
    except (
        SyntaxError,
        ValueError,
    ):
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = (
                package.split(".")[: len(package.split(".")) + 1 - node.level] if node.level else []
            )
            name = ".".join([*above, *([node.module] if node.module else [])])
            yield name
            yield from (f"{name}.{alias.name}" for alias in node.names)


# What results were made from, and whether a resumed campaign would go on with the same.


@cache
def code_versions() -> dict[str, str]:
    """Return what must be equal on all machines of a campaign: versions, the code of suave-des
    itself, and the kind.
    """
    total, folder = hashlib.sha256(), Path(suave_des.__file__).parent
    for path in sorted(folder.rglob("*.py")):
        total.update(f"{path.relative_to(folder)}\n".encode() + path.read_bytes())
    return {**versions(), "suave-des code": total.hexdigest()[:12], "machine": platform.machine()}


def deciding(campaign: Campaign, inputs: Mapping[str, str]) -> dict[str, Any]:
    """Return everything that determines a campaign's results, as plain data; `inputs` are those of
    check_campaign.
    """
    spec, loaded = campaign.spec, campaign.loaded
    # The scenario's own files are compared by their content: another comment in them decides
    # nothing.
    modes = shown_name(loaded.modes_path)
    files = {
        name: digest
        for name, digest in loaded.inputs.items()
        if name == modes or not name.endswith((".yaml", ".yml"))
    }
    return {
        "versions": versions(),
        "machine": platform.machine(),
        **spec.model_dump(mode="json", include=_DECIDING),
        "ensemble": campaign.variation.ensemble and campaign.variation.ensemble.name,
        "scenario": loaded.scenario.model_dump(mode="json"),
        "files_sha256": dict(sorted({**files, **inputs}.items())),
    }


def identity(decides: Mapping[str, Any]) -> str:
    """Return the identity of a campaign, which added runs do not change, to tell it from others in
    its folder.
    """
    same = {name: value for name, value in decides.items() if name != "runs"}
    return hashlib.sha256(json.dumps(same, sort_keys=True).encode()).hexdigest()


def check_same(before: Mapping[str, Any], now: Mapping[str, Any], folder: Path) -> None:
    """Check that everything that determines results is unchanged, except for added runs, so that a
    campaign can resume.

    Raises:
        InputError: something differs, with its name and both values.
    """
    for place, old, new in _differences(before, now, ""):
        if place == "runs" and new >= old:
            continue
        problem = (
            f"the campaign cannot be resumed: {place} was {shown(old)}, and is now {shown(new)}"
        )
        remedy = "undo that, or start a new campaign in another folder or with --overwrite"
        raise InputError(problem, file=folder, remedy=remedy)


def _differences(before: Any, now: Any, place: str) -> Iterator[tuple[str, Any, Any]]:
    if isinstance(before, Mapping) and isinstance(now, Mapping):
        for key in {**before, **now}:
            yield from _differences(
                before.get(key), now.get(key), f"{place}.{key}" if place else str(key)
            )
    elif (
        isinstance(before, list)
        and isinstance(now, list)
        and len(before) == len(now)
        and place != "managers"
    ):
        for index, (old, new) in enumerate(zip(before, now, strict=True)):
            yield from _differences(old, new, f"{place}[{index}]")
    elif before != now:
        yield place, before, now
