"""What users' classes of managers and functions must be like: checked before missions run."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from functools import lru_cache
from math import inf, isnan
from numbers import Real

from suave_des import domain
from suave_des.errors import InputError, shown, similar
from suave_des.managing.base import Dependencies, ManagingSubsystem, System
from suave_des.monitor.diagnostics import Kind

LEAST_PERIOD_S = 0.001
"""Of a manager, as of what scenarios have happen periodically: a slip must not stop the clock."""
_MAY_YIELD = ("adapt", "input_files")


def check_class(what: str, kind: type, root: type) -> None:
    """Check that the hooks of a class, derived from `root`, can be called as they are called, that
    no method is most likely a misspelt one, and what it subscribes to.

    Raises:
        InputError: about `what`.
    """
    forms = _hooks_of(root)
    for hook, form in forms.items():
        if not _can_be_called(hook, getattr(kind, hook), getattr(root, hook)):
            raise InputError(
                f"{what}: {hook} cannot be called as a hook",
                remedy=f"write {form}; only adapt may yield",
            )
    for base in kind.__mro__[: kind.__mro__.index(root)]:
        if not base.__module__.startswith("suave_des."):
            _check_spelling(what, base, forms)
    subscribed: object = getattr(kind, "subscribes_to", ())
    if not (isinstance(subscribed, property) or _are_kinds(subscribed)):
        remedy = f"give a tuple of some of {', '.join(f'Kind.{known.name}' for known in Kind)}"
        raise InputError(f"{what}: subscribes_to is {shown(subscribed)}", remedy=remedy)


def _are_kinds(subscribed: object) -> bool:
    return isinstance(subscribed, Collection) and all(each in list(Kind) for each in subscribed)


def _hooks_of(root: type) -> dict[str, str]:
    """Return how each hook is defined, by its name."""
    routines = [
        name
        for base in root.__mro__[:-1]
        for name, each in vars(base).items()
        if inspect.isroutine(each)
    ]
    hooks = [name for name in routines if name == "__init__" or not name.startswith("_")]
    return {hook: _form(root, hook) for hook in hooks}


def _can_be_called(
    hook: str, function: Callable[..., object], expected: Callable[..., object]
) -> bool:
    if inspect.iscoroutinefunction(function) or inspect.isasyncgenfunction(function):
        return False
    if inspect.isgeneratorfunction(function) and hook not in _MAY_YIELD:
        return False
    try:
        inspect.signature(function).bind(*inspect.signature(expected).parameters)
    except TypeError:
        return False
    except ValueError:  # no signature: compiled
        return True
    return True


def _check_spelling(what: str, kind: type, forms: Mapping[str, str]) -> None:
    """Check that no method that nothing calls has nearly the name of a hook."""
    for name in sorted(name for name, member in vars(kind).items() if inspect.isfunction(member)):
        near = similar(name, forms, cutoff=0.8)
        if near is None or near in vars(kind):
            continue
        inherits = any(hasattr(parent, name) for parent in kind.__bases__)
        if not inherits and name not in names_in(kind):
            remedy = (
                f"did you mean {forms[near]}? give a method of your own a name that differs more"
            )
            raise InputError(f"{what}: {name} is not a hook, and nothing calls it", remedy=remedy)


def _form(root: type, hook: str) -> str:
    """Write how a hook is defined: def adapt(self)."""
    parameters = list(inspect.signature(getattr(root, hook)).parameters)
    if isinstance(inspect.getattr_static(root, hook), classmethod):
        return f"@classmethod def {hook}({', '.join(['cls', *parameters])})"
    return f"def {hook}({', '.join(parameters)})"


def times_of(manager: ManagingSubsystem) -> tuple[float, float] | None:
    """Return a manager's period and first time; None if it is not called periodically.

    Raises:
        ValueError: they are no such times.
    """
    period_s = manager.period_s
    starts_s = manager.starts_s
    if period_s is None:
        return None
    are_numbers = isinstance(period_s, Real) and isinstance(starts_s, Real)
    if not (are_numbers and LEAST_PERIOD_S <= period_s < inf and 0.0 <= starts_s < inf):
        problem = f"period_s is {period_s!r}, starts_s is {starts_s!r}"
        least = f"at least {LEAST_PERIOD_S:g} and 0"
        raise ValueError(f"{problem}; they must be numbers, {least}, or period_s None")
    return period_s, starts_s


def reading_time_of(manager: ManagingSubsystem) -> float:
    """Return for how long a call of `adapt` reads measured values.

    Raises:
        ValueError: it is no such time.
    """
    reads_for_s = manager.reads_for_s
    # float first: to ask the abstract class takes longer than all else here
    if isinstance(reads_for_s, float | Real) and reads_for_s >= 0.0:
        return float(reads_for_s)
    raise ValueError(f"reads_for_s is {shown(reads_for_s)}; it must be a number of at least 0")


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
        found = {name: _thresholds(tuple(map(float, each))) for name, each in declared.items()}
        if found.keys() <= known:
            return found
    form = f"{{'{domain.WATER_VISIBILITY}': (2.25, 3.25)}}"
    names = ", ".join(sorted(known))
    raise ValueError(
        f"depends_on is {shown(declared)}; it must be like {form}, of {names}, or None"
    )


@lru_cache(maxsize=64)
def _thresholds(numbers: tuple[float, ...]) -> tuple[float, ...]:
    """Put thresholds into ascending order; a ValueError if one is no number."""
    if any(map(isnan, numbers)):
        raise ValueError
    return tuple(sorted(numbers))


def measured_somewhere(system: System) -> set[str]:
    """What is measured, here or in some shipped scenario: a manager may be written for all of
    them.
    """
    return {*system.measurements, domain.WATER_VISIBILITY, domain.BATTERY_LEVEL}


def names_in(kind: type) -> set[str]:
    """Return the attributes and functions that the methods of a class name."""
    return {
        name
        for each in vars(kind).values()
        if inspect.isfunction(each)
        for name in each.__code__.co_names
    }
