"""Managers and functions by name: built in, registered by a package, or a user's own module:Class,
which is checked.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from importlib.metadata import entry_points
from itertools import product
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, TypeGuard, TypeVar
from weakref import WeakSet

from suave_des import domain
from suave_des.errors import InputError, did_you_mean, nearest, shown
from suave_des.hooks import check_class
from suave_des.imports import find_here
from suave_des.managing.base import ManagingSubsystem
from suave_des.scenario.loader import LoadedScenario
from suave_des.scenario.models import Scenario
from suave_des.tracebacks import import_place_of

if TYPE_CHECKING:  # or looking a manager up would load the vehicle and the compiler
    from suave_des.managed.node import CustomFunction

_Base = TypeVar("_Base")
ManagerLike = str | type[ManagingSubsystem]
"""A manager's name, module:Class, or its class."""

FUNCTION_GROUP = "suave_des.functions"
_BUILT_IN = {
    "none": "suave_des.managing.simple:NoManager",
    "random": "suave_des.managing.simple:RandomManager",
    "metacontrol": "suave_des.managing.metacontrol:Metacontrol",
    "bt": "suave_des.managing.bt:BehaviourTree",
    "bt_extended": "suave_des.managing.bt:ExtendedBehaviourTree",
    "threshold": "suave_des.managing.simple:Threshold",
    "oracle": "suave_des.managing.simple:Oracle",
    "rosa": "suave_des.interfaces.table:Rosa",
    "planta": "suave_des.interfaces.table:Planta",
}
_FAMILIES = {
    "fixed": ("suave_des.managing.simple", "fixed_mode", "MODE"),
    "exec": ("suave_des.interfaces.exec", "exec_manager", "COMMAND"),
    "client": ("suave_des.interfaces.client", "client_manager", "NAME"),
    "table": ("suave_des.interfaces.table", "table_manager", "FILE.csv"),
}
"""Managers with an argument after a colon: module and function that make the class, and what the
argument is.
"""
# a class that is kept would keep its module open at the end of a worker
_checked: WeakSet[type] = WeakSet()


def is_built_in(name: str) -> bool:
    """Whether a manager is the project's own code alone, in this process."""
    return name in _BUILT_IN or name.startswith(("fixed:", "client:", "table:"))


def is_client(name: str) -> bool:
    """Whether a manager is a client of `suave-des serve`."""
    return name.startswith("client:")


def takes_argument(name: str) -> bool:
    """Whether the part of a name before the colon is not a module, as in fixed:MODE."""
    return name.partition(":")[0] in _FAMILIES


def is_installed(name: str) -> bool:
    """Whether a manager is built in or registered by a package: code that somebody has installed on
    purpose.
    """
    return is_built_in(name) or name in _registered()


def manager_names() -> tuple[str, ...]:
    """Names that need no module:Class: built in first, then registered ones in alphabetical
    order.
    """
    return (*_BUILT_IN, *(name for name in sorted(_registered()) if name not in _BUILT_IN))


def name_of(manager: ManagerLike) -> str:
    """The name of a manager: that which it is registered by, or module:Class.

    Raises:
        InputError: it is not a manager, or a class that cannot be found by its name.
    """
    if isinstance(manager, str):
        return manager
    if not (isinstance(manager, type) and issubclass(manager, ManagingSubsystem)):
        problem = f"expected a manager, got {shown(manager)}"
        raise InputError(
            problem, remedy="give a name, or a subclass of suave_des.ManagingSubsystem"
        )
    target = f"{manager.__module__}:{manager.__qualname__}"
    if getattr(sys.modules.get(manager.__module__), manager.__qualname__, None) is not manager:
        remedy = "define the class at the top level of a module, script or notebook cell"
        raise InputError(f"manager {target!r} cannot be found by its name", remedy=remedy)
    return next(
        (name for name, known in (_BUILT_IN | _registered()).items() if known == target), target
    )


def manager_class(name: str) -> type[ManagingSubsystem]:
    """The class of a manager.

    Raises:
        InputError: there is no such manager, or what the name leads to is no subclass of
            ManagingSubsystem, or has a hook that cannot be called.
    """
    family, _, argument = name.partition(":")
    if family in _FAMILIES:
        module, function, wanted = _FAMILIES[family]
        if not argument.strip():
            raise InputError(f"there is no manager {family!r}", remedy=f"write {family}:{wanted}")
        make: Callable[[str], type[ManagingSubsystem]] = getattr(
            importlib.import_module(module), function
        )
        return make(argument)
    if name in _BUILT_IN:
        return _built_in(name)
    target = name if ":" in name else _registered().get(name)
    if target is None:
        hint = nearest(name, manager_names()) or f"known: {', '.join(manager_names())}"
        raise InputError(
            f"there is no manager {name!r}",
            remedy=f"{hint}; your own is given as package.module:Class",
        )
    return _load(f"manager {name!r}", target, ManagingSubsystem)


@cache
def _built_in(name: str) -> type[ManagingSubsystem]:
    return _load(f"manager {name!r}", _BUILT_IN[name], ManagingSubsystem)


def custom_functions(loaded: LoadedScenario) -> dict[str, type[CustomFunction]]:
    """Find the classes of a scenario's further functions, by the name of the function.

    They are named under `functions:`; one that a package registers under the function's own name
    needs no entry.

    Raises:
        InputError: a function that the mission needs has no node, or a class cannot be used.
    """
    nodes = _nodes(loaded)
    if not nodes:
        return {}
    from suave_des.managed.node import CustomFunction  # loads the vehicle

    registered = _registered(FUNCTION_GROUP)
    found = {}
    for name, node in nodes.items():
        target = node if ":" in node else registered.get(node)
        if target is None:
            remedy = f"{did_you_mean(node, sorted(registered), 'registered')}; or give module:Class"
            raise InputError(f"function {name}: no package registers {node!r}", remedy=remedy)
        found[name] = _load(f"function {name}, {node!r}", target, CustomFunction)
    return found


def _nodes(loaded: LoadedScenario) -> dict[str, str]:
    """Return the class of each further function, as it is named; check that none is missing."""
    scenario = loaded.scenario
    built_in = _built_in_functions(scenario)
    own = [name for name in loaded.modes.functions if name not in built_in]
    nodes = {name: name for name in own if name in _registered(FUNCTION_GROUP)}
    nodes |= {name: settings.node for name, settings in scenario.functions.items()}
    for name in scenario.needed_functions():
        if name not in built_in and name not in nodes:
            remedy = f"name its class: functions: {{{name}: {{node: module:Class}}}}, or install a package for it"
            if name == domain.GENERATE_RECHARGE_PATH:
                remedy = "add battery: {}"
            problem = f"function {name} has no node"
            raise loaded.layer.error(problem, ("mission", "functions"), remedy)
    return nodes


def _built_in_functions(scenario: Scenario) -> list[str]:
    functions = [*domain.MISSION_FUNCTIONS]
    if scenario.battery is not None:
        functions.append(domain.GENERATE_RECHARGE_PATH)
    if scenario.leak is not None:
        functions.append(domain.SURFACE)
    return functions


def declared_files(
    scenarios: Iterable[LoadedScenario], managers: Mapping[str, type[ManagingSubsystem]]
) -> dict[tuple[str, str], Path]:
    """Locate the files that managers declare by their hook `input_files`, by manager and their
    names as given.

    Raises:
        InputError: a file does not exist, or a class does not declare a list of names.
    """
    found = dict[tuple[str, str], Path]()
    for loaded, (manager, kind) in product(scenarios, managers.items()):
        try:
            names = kind.input_files(loaded.manager_settings(manager))
            names = names if isinstance(names, str) else tuple(names)
        except InputError:
            raise
        except Exception as error:
            problem = f"manager {manager}: input_files raised {type(error).__name__}: {error}"
            raise InputError(
                problem, remedy="give its settings by --manager-option NAME=VALUE"
            ) from error
        if isinstance(names, str) or not all(isinstance(name, str) for name in names):
            problem = f"manager {manager}: input_files gave {shown(names)}"
            raise InputError(problem, remedy="return a list of file names as text")
        found |= {(manager, name): loaded.manager_file(manager, name) for name in names}
    return found


@cache
def _registered(group: str = domain.MANAGER_GROUP) -> dict[str, str]:
    return {point.name: point.value for point in entry_points(group=group)}


def _load(what: str, target: str, base: type[_Base]) -> type[_Base]:
    module_name, _, attribute = target.partition(":")
    module = _imported(what, module_name)
    found = getattr(module, attribute, None)
    if not _is_derived(found, base):
        problem = f"{what}: {module_name} has no subclass of {base.__name__} named {attribute!r}"
        _check_not_hidden(problem, module)
        classes = [name for name, each in vars(module).items() if _is_derived(each, base)]
        remedy = nearest(attribute, classes) or f"derive it from suave_des.{base.__name__}"
        raise InputError(problem, remedy=remedy)
    if found not in _checked and not module_name.startswith("suave_des."):
        check_class(what, found, base)
        _checked.add(found)
    return found


def _check_not_hidden(problem: str, module: ModuleType) -> None:
    """Raise an InputError with that problem if a file in this folder is hidden by a module of its
    name.
    """
    file = getattr(module, "__file__", None)
    here = Path(f"{module.__name__.replace('.', '/')}.py")
    if here.is_file() and not (file and here.samefile(file)):
        raise InputError(
            f"{problem}: it is {file or 'a part of Python'}, not {here} in this folder",
            remedy="rename your file, as installed modules come first",
        )


def _is_derived(found: object, base: type[_Base]) -> TypeGuard[type[_Base]]:
    return isinstance(found, type) and issubclass(found, base)


def _imported(what: str, module: str) -> ModuleType:
    """Import a module of a user's; `what` names what it is imported for."""
    try:
        top = module.partition(".")[0]
        if top not in sys.modules:
            find_here(top)  # in folders, too, which are not on the import path
        return importlib.import_module(module)
    except SyntaxError as error:
        raise InputError(
            f"{what}: {error.msg}", file=error.filename, place=f"line {error.lineno}"
        ) from error
    except (Exception, SystemExit) as error:  # whatever the module's own code raises
        # Python 3.11 wraps it while a class is made
        if isinstance(error.__cause__, KeyboardInterrupt):
            raise error.__cause__ from None
        problem = f"{what}: {type(error).__name__}: {error}"
        place = import_place_of(error)
        if place is not None:
            raise InputError(problem, file=place.filename, place=f"line {place.lineno}") from error
        remedy = (
            "module must be importable: installed, in the current folder or one on PYTHONPATH, or"
            " beside the campaign file that names it"
        )
        raise InputError(problem, remedy=remedy) from error
