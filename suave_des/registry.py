"""Managers and user-defined functions by name: built in, registered by another package, or given as module:Class."""

from __future__ import annotations

import importlib
import inspect
import re
import sys
from collections.abc import Callable, Collection, Iterator, Mapping
from difflib import get_close_matches
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeVar
from weakref import WeakSet

from suave_des.domain import MANAGER_GROUP
from suave_des.errors import InputError, did_you_mean, nearest, shown
from suave_des.managing.base import ManagingSubsystem
from suave_des.monitor.diagnostics import Kind

if TYPE_CHECKING:
    from suave_des.managed.custom import CustomFunction

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
    "threshold": "suave_des.managing.reference:Threshold",
    "oracle": "suave_des.managing.reference:Oracle",
}
_FAMILIES = {
    "fixed": ("suave_des.managing.reference:fixed_mode", "fixed:MODE"),
    "exec": ("suave_des.interfaces.exec:exec_manager", "exec:COMMAND"),
}
"""Managers that are named with an argument after a colon: what makes the class of one, and how it is written."""
_checked: WeakSet[type] = WeakSet()  # a class that is kept would keep its module open at the end of a worker


class _Hooks(NamedTuple):
    """The hooks of managers, or those of functions: their arguments, by name.

    Attributes:
        hooks: those of an instance.
        class_methods: what is asked of a class, before there is a mission.
        generators: those that may yield.
        lets_time_pass: says how mission time can pass.
    """

    hooks: Mapping[str, str]
    class_methods: Mapping[str, str]
    generators: Collection[str]
    lets_time_pass: str


_MANAGER_HOOKS = _Hooks(
    hooks={
        "__init__": "(self, system)",
        "mission_started": "(self)",
        "mission_ended": "(self, metrics)",
        "task_requested": "(self, task)",
        "task_cancelled": "(self, task)",
        "diagnostic": "(self, diagnostic)",
        "adapt": "(self)",
    },
    class_methods={"check": "(cls, loaded)", "input_files": "(cls, settings)"},
    generators=("adapt", "input_files"),
    lets_time_pass="adapt may let time pass: with yield self.system.env.timeout(seconds)",
)
_FUNCTION_HOOKS = _Hooks(
    hooks={
        "__init__": "(self, context)",
        "configure": "(self, mode)",
        "activated": "(self)",
        "deactivated": "(self)",
    },
    class_methods={},
    generators=(),
    lets_time_pass="what takes mission time is a process: self.env.process(self.another_method())",
)


def is_built_in(name: str) -> bool:
    """Whether a manager is the project's own code alone."""
    return name in _BUILT_IN or name.startswith("fixed:")


def takes_argument(name: str) -> bool:
    """Whether the part of a name before the colon is not a module, as in fixed:MODE."""
    return name.partition(":")[0] in _FAMILIES


def is_installed(name: str) -> bool:
    """Whether a manager is built in or registered by a package: code that somebody has installed on purpose."""
    return is_built_in(name) or name in _registered()


def manager_names() -> tuple[str, ...]:
    """Names that need no module:Class: built in first, then registered ones in alphabetical order."""
    return (*_BUILT_IN, *(name for name in sorted(_registered()) if name not in _BUILT_IN))


def name_of(manager: ManagerLike) -> str:
    """The name of a manager: that which it is registered by, or module:Class.

        name_of(Metacontrol)  # "metacontrol"

    Raises:
        InputError: it is not a manager, or a class that cannot be found by its name.
    """
    if isinstance(manager, str):
        return manager
    if not (isinstance(manager, type) and issubclass(manager, ManagingSubsystem)):
        problem = f"expected a manager, got {shown(manager)}"
        raise InputError(problem, remedy="give a name, or a subclass of suave_des.managing.base.ManagingSubsystem")
    target = f"{manager.__module__}:{manager.__qualname__}"
    if getattr(sys.modules.get(manager.__module__), manager.__qualname__, None) is not manager:
        problem = f"manager {target!r} cannot be found by its name"
        raise InputError(problem, remedy="define the class at the top level of a module, script or notebook cell")
    named = (name for name, known in (_BUILT_IN | _registered()).items() if known == target)
    return next(named, target)


def manager_class(name: str) -> type[ManagingSubsystem]:
    """The class of a manager.

    Raises:
        InputError: there is no such manager, or what the name leads to is no subclass of ManagingSubsystem.
    """
    family, _, argument = name.partition(":")
    if family in _FAMILIES:
        return _member(family, argument)
    target = name if ":" in name else _BUILT_IN.get(name) or _registered().get(name)
    if target is None:
        hint = nearest(name, manager_names()) or f"known: {', '.join(manager_names())}"
        raise InputError(f"there is no manager {name!r}", remedy=f"{hint}; your own is given as package.module:Class")
    found = _load(f"manager {name!r}", target, ManagingSubsystem)
    if not is_built_in(name) and found not in _checked:
        _check_hooks(f"manager {name!r}", found, ManagingSubsystem, _MANAGER_HOOKS)
        _check_subscriptions(name, found)
        _checked.add(found)
    return found


def _member(family: str, argument: str) -> type[ManagingSubsystem]:
    target, form = _FAMILIES[family]
    if not argument.strip():
        raise InputError(f"there is no manager {family!r}", remedy=f"write {form}")
    module, _, function = target.partition(":")
    make: Callable[[str], type[ManagingSubsystem]] = getattr(importlib.import_module(module), function)
    return make(argument)


def _check_hooks(what: str, kind: type, root: type, expected: _Hooks) -> None:
    """Check that each hook that a class has can be called as hooks are called.

    Args:
        what: names the class in errors.
        kind: the class.
        root: its base that defines the hooks.
        expected: the hooks.

    Raises:
        InputError: one takes other arguments, or would only make a generator or coroutine; or none is there, but
            something that resembles one.
    """

    def wrong(problem: str, remedy: str) -> InputError:
        return InputError(f"{what}{problem}", remedy=remedy)

    hooks, class_methods, generators, lets_time_pass = expected
    for hook, form in (*hooks.items(), *class_methods.items()):
        function = getattr(kind, hook)
        arguments = [object()] * (form.count(",") + form.startswith("(self"))
        if not callable(function):
            raise wrong(f": {hook} is not a method", f"write def {hook}{form}")
        try:
            inspect.signature(function).bind(*arguments)
        except TypeError as error:
            problem = f": {hook}{inspect.signature(function)} cannot be called as a hook: {error}"
            decorator = "@classmethod " if hook in class_methods else ""
            raise wrong(problem, f"write {decorator}def {hook}{form}") from None
        except ValueError:  # no signature: compiled
            continue
        if inspect.iscoroutinefunction(function) or inspect.isasyncgenfunction(function):
            raise wrong(f": {hook} is async, and nothing would run it", f"write def {hook}{form}; {lets_time_pass}")
        if inspect.isgeneratorfunction(function) and hook not in generators:
            raise wrong(f": {hook} yields, and nothing would run it", f"return from {hook} at once; {lets_time_pass}")
    own = {each for base in kind.__mro__[: kind.__mro__.index(root)] for each in vars(base)}
    if not own & hooks.keys():
        resembling = {each: near for each in own for near in get_close_matches(each, hooks, n=1, cutoff=0.75)}
        for each, hook in sorted(resembling.items()):
            raise wrong(f" has no hook, but {each}", f"did you mean {hook}{hooks[hook]}?")
    for each, hook in _misspelt_hooks(kind, root, hooks):
        remedy = f"did you mean {hook}{hooks[hook]}? give a method of your own a name that differs more"
        raise wrong(f": {each} is not a hook, and nothing calls it", remedy)


def _check_subscriptions(name: str, kind: type[ManagingSubsystem]) -> None:
    """Check what a manager subscribes to.

    Raises:
        InputError: it is no kind of diagnostics.
    """
    subscribed = kind.subscribes_to
    is_collection = isinstance(subscribed, Collection) and not isinstance(subscribed, str)
    unknown = [each for each in subscribed if each not in list(Kind)] if is_collection else []
    if unknown or not (is_collection or isinstance(subscribed, property)):
        remedy = f"give a tuple of some of {', '.join(f'Kind.{known.name}' for known in Kind)}"
        what = f"has {shown(unknown[0])}" if unknown else f"is {shown(subscribed)}"
        raise InputError(f"manager {name!r}: subscribes_to {what}", remedy=remedy)


def _misspelt_hooks(kind: type, root: type, hooks: Collection[str]) -> Iterator[tuple[str, str]]:
    """Yield methods that are most likely misspelt hooks, each with the hook.

    The name of such a method is very similar to a hook that its class lacks; the method overrides nothing, and its name
    occurs nowhere else in its module.
    """
    classes = kind.__mro__[: kind.__mro__.index(root)]
    for base in (each for each in classes if not each.__module__.startswith("suave_des.")):
        for each in sorted(name for name, member in vars(base).items() if inspect.isfunction(member)):
            near = get_close_matches(each, hooks, n=1, cutoff=0.8)
            inherits = any(hasattr(parent, each) for parent in base.__bases__)
            if near and near[0] not in vars(base) and not inherits and not is_named_elsewhere(each, base):
                yield each, near[0]


@cache
def is_named_elsewhere(method: str, kind: type) -> bool:
    """Return whether a method's name occurs in its module besides its definition; True if there is no source.

    Imports do not count: a manager that imports from suave_des.monitor.diagnostics does not call its `diagnostics`.
    """
    try:
        source = inspect.getsource(sys.modules[kind.__module__])
    except (OSError, TypeError, KeyError):
        return True
    source = re.sub(r"^\s*(from|import) .*$", "", source, flags=re.MULTILINE)
    return re.search(rf"(?<!def )\b{re.escape(method)}\b", source) is not None


def registered_functions() -> tuple[str, ...]:
    """Names of the functions that other packages register, in alphabetical order."""
    return tuple(sorted(_registered(FUNCTION_GROUP)))


def function_class(function: str, name: str) -> type[CustomFunction]:
    """Find the class of a user-defined function.

    Args:
        function: name of the function, for errors.
        name: module:Class, or a registered name.

    Raises:
        InputError: there is no such class, it is no subclass of CustomFunction, or a hook is wrong.
    """
    from suave_des.managed.custom import CustomFunction  # loads the vehicle

    target = name if ":" in name else _registered(FUNCTION_GROUP).get(name)
    if target is None:
        hint = did_you_mean(name, registered_functions(), "registered")
        raise InputError(f"function {function}: no package registers {name!r}", remedy=f"{hint}; or give module:Class")
    what = f"function {function}, {name!r}"
    found = _load(what, target, CustomFunction)
    if found not in _checked:
        _check_hooks(what, found, CustomFunction, _FUNCTION_HOOKS)
        _checked.add(found)
    return found


@cache
def _registered(group: str = MANAGER_GROUP) -> dict[str, str]:
    return {point.name: point.value for point in entry_points(group=group)}


def _load(what: str, target: str, base: type[_Base]) -> type[_Base]:
    module_name, _, attribute = target.partition(":")
    try:
        if module_name not in sys.modules and (here := str(Path.cwd())) not in sys.path:
            sys.path.append(here)  # where `python` would find it, but an installed command would not
        module = importlib.import_module(module_name)
    except (Exception, SystemExit) as error:  # whatever the module's own code raises on import
        if isinstance(error.__cause__, KeyboardInterrupt):  # Python 3.11 wraps it while a class is made
            raise error.__cause__ from None
        raise InputError(
            f"{what}: {type(error).__name__}: {error}",
            remedy="module must be importable: installed, or in the current folder or one on PYTHONPATH",
        ) from error
    found = getattr(module, attribute, None)
    if not (isinstance(found, type) and issubclass(found, base)):
        classes = {name for name, each in vars(module).items() if isinstance(each, type) and issubclass(each, base)}
        raise InputError(
            f"{what}: {module_name} has no subclass of {base.__name__} named {attribute!r}",
            remedy=(nearest(attribute, classes) if found is None else None)
            or f"derive your class from {base.__module__}.{base.__name__}",
        )
    return found
