"""Managers and functions by name: built in, registered by a package, or a user's own module:Class,
which is checked.

What users' code does wrong is told with its place in their code.
"""

from __future__ import annotations

import importlib
import inspect
import re
import sys
from collections.abc import Callable, Collection, Iterable, Mapping
from contextlib import suppress
from functools import cache
from importlib.metadata import entry_points
from itertools import chain, product
from math import inf, isnan
from numbers import Real
from pathlib import Path
from sysconfig import get_path
from traceback import FrameSummary, extract_tb
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeVar
from weakref import WeakSet

from suave_des import domain
from suave_des.errors import InputError, did_you_mean, nearest, shown, similar
from suave_des.imports import find_here
from suave_des.managing.base import Dependencies, ManagingSubsystem, System
from suave_des.monitor.diagnostics import Kind
from suave_des.scenario.loader import LoadedScenario

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
}
_FAMILIES = {
    "fixed": ("suave_des.managing.simple", "fixed_mode", "MODE"),
    "exec": ("suave_des.interfaces.exec", "exec_manager", "COMMAND"),
}
"""Managers with an argument after a colon: module and function that make the class, and what the
argument is.
"""
_OWN = Path(__file__).parent
_LIBRARY = re.compile(rf"{re.escape(get_path('stdlib'))}|.*/(site|dist)-packages/")
_MOST_SAID = 5_000  # characters of an exception's text
_MAY_YIELD = ("adapt", "input_files")
# a class that is kept would keep its module open at the end of a worker
_checked: WeakSet[type] = WeakSet()


def is_built_in(name: str) -> bool:
    """Whether a manager is the project's own code alone."""
    return name in _BUILT_IN or name.startswith("fixed:")


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
    scenario, registered = loaded.scenario, _registered(FUNCTION_GROUP)
    recharge = () if scenario.battery is None else (domain.GENERATE_RECHARGE_PATH,)
    built_in = (
        *domain.MISSION_FUNCTIONS,
        *recharge,
        *(() if scenario.leak is None else (domain.SURFACE,)),
    )
    types = {
        name: name for name in loaded.modes.functions if name in registered and name not in built_in
    }
    types |= {name: settings.node for name, settings in scenario.functions.items()}
    for name in scenario.needed_functions():
        if name not in built_in and name not in types:
            remedy = f"name its class: functions: {{{name}: {{node: module:Class}}}}, or install a package for it"
            remedy = "add battery: {}" if name == domain.GENERATE_RECHARGE_PATH else remedy
            raise loaded.layer.error(
                f"function {name} has no node", ("mission", "functions"), remedy
            )
    if not types:
        return {}
    from suave_des.managed.node import CustomFunction  # loads the vehicle

    found = {}
    for name, node in types.items():
        target = node if ":" in node else registered.get(node)
        if target is None:
            remedy = f"{did_you_mean(node, sorted(registered), 'registered')}; or give module:Class"
            raise InputError(f"function {name}: no package registers {node!r}", remedy=remedy)
        found[name] = _load(f"function {name}, {node!r}", target, CustomFunction)
    return found


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
    if not (isinstance(found, type) and issubclass(found, base)):
        classes = {
            name
            for name, each in vars(module).items()
            if isinstance(each, type) and issubclass(each, base)
        }
        problem = f"{what}: {module_name} has no subclass of {base.__name__} named {attribute!r}"
        here, imported = (
            Path(f"{module_name.replace('.', '/')}.py"),
            getattr(module, "__file__", ""),
        )
        if here.is_file() and not (imported and here.samefile(imported)):
            raise InputError(
                f"{problem}: it is {imported or 'a part of Python'}, not {here} in this folder",
                remedy="rename your file, as installed modules come first",
            )
        raise InputError(
            problem,
            remedy=nearest(attribute, classes) or f"derive it from suave_des.{base.__name__}",
        )
    if found not in _checked and not module_name.startswith("suave_des."):
        _check_hooks(what, found, base)
        subscribed: Any = getattr(found, "subscribes_to", ())
        are_kinds = isinstance(subscribed, Collection) and all(
            each in list(Kind) for each in subscribed
        )
        if not (are_kinds or isinstance(subscribed, property)):
            remedy = f"give a tuple of some of {', '.join(f'Kind.{known.name}' for known in Kind)}"
            raise InputError(f"{what}: subscribes_to is {shown(subscribed)}", remedy=remedy)
        _checked.add(found)
    return found


# Users' code.


def _imported(what: str, module: str) -> ModuleType:
    """Import a module of a user's; `what` names what it is imported for."""
    try:
        if (top := module.partition(".")[0]) not in sys.modules:
            find_here(top)  # in the current folder, too, which is not on the import path
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
        own = [
            each for each in extract_tb(error.__traceback__)[1:] if "importlib" not in each.filename
        ]
        own = [each for each in own if not _LIBRARY.match(each.filename)] or own
        if own:
            raise InputError(
                problem, file=own[-1].filename, place=f"line {own[-1].lineno}"
            ) from error
        remedy = (
            "module must be importable: installed, or in the current folder or one on PYTHONPATH"
        )
        raise InputError(problem, remedy=remedy) from error


def _check_hooks(what: str, kind: type, root: type) -> None:
    """Check that hooks can be called as hooks are called, and that no method is most likely a
    misspelt one.
    """
    own = {
        name: each
        for base in root.__mro__[:-1]
        for name, each in vars(base).items()
        if inspect.isroutine(each)
    }
    forms = {
        name: _form(root, name) for name in own if name == "__init__" or not name.startswith("_")
    }
    for hook, form in forms.items():
        function = getattr(kind, hook)
        never_runs = inspect.iscoroutinefunction(function) or inspect.isasyncgenfunction(function)
        try:
            inspect.signature(function).bind(*inspect.signature(getattr(root, hook)).parameters)
        except TypeError:
            never_runs = True
        except ValueError:  # no signature: compiled
            continue
        if never_runs or (inspect.isgeneratorfunction(function) and hook not in _MAY_YIELD):
            raise InputError(
                f"{what}: {hook} cannot be called as a hook",
                remedy=f"write {form}; only adapt may yield",
            )
    classes = kind.__mro__[: kind.__mro__.index(root)]
    for base in (each for each in classes if not each.__module__.startswith("suave_des.")):
        for each in sorted(
            name for name, member in vars(base).items() if inspect.isfunction(member)
        ):
            near = similar(each, forms, cutoff=0.8)
            inherits = any(hasattr(parent, each) for parent in base.__bases__)
            if (
                near is not None
                and near not in vars(base)
                and not inherits
                and each not in names_in(base)
            ):
                remedy = f"did you mean {forms[near]}? give a method of your own a name that differs more"
                raise InputError(
                    f"{what}: {each} is not a hook, and nothing calls it", remedy=remedy
                )


def _form(root: type, hook: str) -> str:
    """Write how a hook is defined: def adapt(self)."""
    is_of_class = isinstance(inspect.getattr_static(root, hook), classmethod)
    parameters = list(inspect.signature(getattr(root, hook)).parameters)
    arguments = ", ".join(["cls", *parameters] if is_of_class else parameters)
    return f"{'@classmethod ' if is_of_class else ''}def {hook}({arguments})"


def times_of(manager: ManagingSubsystem) -> tuple[float, float] | None:
    """Return a manager's period and first time; None if it is not called periodically.

    Raises:
        ValueError: they are no such times.
    """
    period_s, starts_s = manager.period_s, manager.starts_s
    if period_s is None:
        return None
    are_numbers = isinstance(period_s, Real) and isinstance(starts_s, Real)
    if not (are_numbers and 0.0 < period_s < inf and 0.0 <= starts_s < inf):
        problem = f"period_s is {period_s!r}, starts_s is {starts_s!r}"
        raise ValueError(f"{problem}; they must be numbers, above 0 and from 0, or period_s None")
    return period_s, starts_s


def dependencies_of(manager: ManagingSubsystem) -> Dependencies | None:
    """Return what a manager's class itself declares to depend on: one derived from it may depend on
    more.

    Raises:
        ValueError: it is no mapping from measured quality attributes to numbers.
    """
    declared = manager.depends_on if "depends_on" in vars(type(manager)) else None
    if declared is None:
        return None
    known = measured_somewhere(manager.system)
    with suppress(AttributeError, TypeError, ValueError):
        found = {name: tuple(sorted(map(float, each))) for name, each in declared.items()}
        if found.keys() <= set(known) and not any(map(isnan, chain(*found.values()))):
            return found
    form = f"{{'{domain.WATER_VISIBILITY}': (2.25, 3.25)}}"
    raise ValueError(
        f"depends_on is {shown(declared)}; it must be like {form}, of {', '.join(known)}, or None"
    )


def measured_somewhere(system: System) -> list[str]:
    """List what is measured, here or in some shipped scenario: a manager may be written for all of
    them.
    """
    return sorted({*system.measurements, domain.WATER_VISIBILITY, domain.BATTERY_LEVEL})


def names_in(kind: type) -> set[str]:
    """Return the attributes and functions that the methods of a class name."""
    return {
        name
        for each in vars(kind).values()
        if inspect.isfunction(each)
        for name in each.__code__.co_names
    }


def cause_of(error: BaseException, function: str = "") -> str:
    """Say what was raised, in which function, and where in the user's code: "ValueError: no plan
    (mine.py, line 7)".

    The text is the same in each run: it has no memory addresses.
    `function` is the user-defined one that raised it.
    """
    of = f"function {function}: " if function else ""
    said = "its text cannot be made"
    with suppress(Exception):
        said = str(error)
    text = re.sub(r" at 0x[0-9a-f]+", "", f"{of}{type(error).__name__}: {said[:_MOST_SAID]}")
    frames = _users_frames(error)
    return f"{text} ({_line(frames[-1])})" if frames else text


def place_of(error: BaseException) -> str:
    """Say which hook of a user's class an exception came from, and from which line: "adapt
    (mine.py, line 7)".
    """
    frames = _users_frames(error)
    return f"{frames[0].name} ({_line(frames[-1])})" if frames else ""


def _users_frames(error: BaseException) -> list[FrameSummary]:
    """Return what ran outside the project when an exception was raised, outermost first; libraries
    if nothing else.
    """
    while error.__cause__ is not None and repr(error.__cause__) == repr(error):
        error = error.__cause__  # SimPy raises a copy of what a process has raised
    frames = [
        each
        for each in extract_tb(error.__traceback__)
        if not Path(each.filename).is_relative_to(_OWN)
    ]
    return [each for each in frames if not _LIBRARY.match(each.filename)] or frames


def _line(frame: FrameSummary) -> str:
    file = Path(frame.filename)
    return f"{f'{file.name}, ' if file.is_file() else ''}line {frame.lineno}"
