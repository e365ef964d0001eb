"""Managers, and functions of one's own, by name: built in, registered by another package, or given as module:Class."""

from __future__ import annotations

import importlib
import sys
from difflib import get_close_matches
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from suave_des.errors import InputError, did_you_mean
from suave_des.managing.base import ManagingSubsystem

if TYPE_CHECKING:
    from suave_des.managed.own import OwnFunction

_Base = TypeVar("_Base")

ENTRY_POINT_GROUP = "suave_des.managers"
FUNCTION_GROUP = "suave_des.functions"
_BUILT_IN = {
    "none": "suave_des.managing.simple:NoManager",
    "random": "suave_des.managing.simple:RandomManager",
    "metacontrol": "suave_des.managing.metacontrol:Metacontrol",
    "bt": "suave_des.managing.bt:BehaviourTree",
    "bt_extended": "suave_des.managing.bt:ExtendedBehaviourTree",
}


def is_built_in(name: str) -> bool:
    """Whether a manager is the project's own."""
    return name in _BUILT_IN


def manager_names() -> tuple[str, ...]:
    """Names that need no module:Class: built in first, then registered ones in alphabetical order."""
    return (*_BUILT_IN, *(name for name in sorted(_registered()) if name not in _BUILT_IN))


def registered_name(target: str) -> str | None:
    """The name that stands for a class given as module:Class; None if there is none."""
    return next((name for name, known in (_BUILT_IN | _registered()).items() if known == target), None)


def manager_class(name: str) -> type[ManagingSubsystem]:
    """The class of a manager.

    Raises:
        InputError: there is no such manager, or what the name leads to is no subclass of ManagingSubsystem.
    """
    target = name if ":" in name else _BUILT_IN.get(name) or _registered().get(name)
    if target is None:
        close = get_close_matches(name, manager_names(), n=1)
        hint = f"did you mean {close[0]}?" if close else f"known: {', '.join(manager_names())}"
        raise InputError(f"there is no manager {name!r}", remedy=f"{hint}; your own is given as package.module:Class")
    return _load(f"manager {name!r}", target, ManagingSubsystem)


def registered_functions() -> tuple[str, ...]:
    """Names of the functions that other packages register, in alphabetical order."""
    return tuple(sorted(_registered(FUNCTION_GROUP)))


def function_class(function: str, name: str) -> type[OwnFunction]:
    """The class of a function of one's own.

    Args:
        function: name of the function, for errors.
        name: module:Class, or a registered name.

    Raises:
        InputError: there is no such class, or it is no subclass of OwnFunction.
    """
    from suave_des.managed.own import OwnFunction  # loads the vehicle

    target = name if ":" in name else _registered(FUNCTION_GROUP).get(name)
    if target is None:
        hint = did_you_mean(name, registered_functions(), "registered")
        raise InputError(f"function {function}: no package registers {name!r}", remedy=f"{hint}; or give module:Class")
    return _load(f"function {function}, {name!r}", target, OwnFunction)


@cache
def _registered(group: str = ENTRY_POINT_GROUP) -> dict[str, str]:
    return {point.name: point.value for point in entry_points(group=group)}


def _load(what: str, target: str, base: type[_Base]) -> type[_Base]:
    module_name, _, attribute = target.partition(":")
    try:
        if module_name not in sys.modules:
            _look_here()
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
        raise InputError(
            f"{what}: {module_name} has no subclass of {base.__name__} named {attribute!r}",
            remedy=f"derive your class from {base.__module__}.{base.__name__}",
        )
    return found


def _look_here() -> None:
    here = str(Path.cwd())
    if here not in sys.path:  # where `python` would find a module of one's own, but an installed command would not
        sys.path.append(here)
