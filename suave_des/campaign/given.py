"""What callers may give in place of plain names and lists: classes of managers, arrays and ranges of values."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from suave_des.errors import InputError, shown
from suave_des.managing.base import ManagingSubsystem
from suave_des.registry import registered_name

ManagerLike = str | type[ManagingSubsystem]
"""A manager's name, module:Class, or its class."""
SWEEP_FORMS = ("grid", "zip")
_MOST_VALUES = 1_000_000


def manager_name(manager: ManagerLike) -> str:
    """Return the name of a manager: that which it is registered by, or module:Class.

        manager_name(Metacontrol)  # "metacontrol"

    Raises:
        InputError: it is no manager, or a class that cannot be found by its name.
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
    return registered_name(target) or target


def manager_names(managers: ManagerLike | Iterable[ManagerLike] | None) -> tuple[str, ...] | None:
    """Return the names of managers: of one, or of several; None stays None.

    Raises:
        InputError: as manager_name.
    """
    if managers is None:
        return None
    several = [managers] if isinstance(managers, str | type) else list(managers)
    return tuple(map(manager_name, several))


def plain_sweep(sweep: Mapping[str, Any] | None) -> dict[str, Any] | None:
    """Return a sweep with lists of plain values, where arrays, ranges, series and the like were given.

    Example:
        >>> plain_sweep({"thruster_events.0.time_s": range(20, 50, 10)})
        {'thruster_events.0.time_s': [20, 30, 40]}

    Raises:
        InputError: a range is without end, or very long.
    """
    if sweep is None:
        return None
    plain: dict[str, Any] = {}
    for name, values in sweep.items():
        if name in SWEEP_FORMS and isinstance(values, Mapping):
            plain[name] = {key: _listed(f"{name}.{key}", each) for key, each in values.items()}
        elif isinstance(values, Mapping):  # a sampled design
            plain[name] = {key: _plain(each) for key, each in values.items()}
        else:
            plain[name] = _listed(name, values)
    return plain


def _listed(name: str, values: Any) -> Any:
    """Return what can be iterated as a list; the rest is for the sweep to judge."""
    if isinstance(values, str | bytes | Mapping) or not isinstance(values, Iterable):
        return _plain(values)
    plain: list[Any] = []
    for value in values:
        if len(plain) >= _MOST_VALUES:
            raise InputError(f"sweep.{name} has more than {_MOST_VALUES:,} values", remedy="give fewer")
        plain.append(_plain(value))
    return plain


def _plain(value: Any) -> Any:
    """Return a number of numpy or pandas as Python's own, and what contains some likewise."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, Mapping):
        return {key: _plain(each) for key, each in value.items()}
    return [_plain(each) for each in value] if isinstance(value, Sequence) and not isinstance(value, str) else value
