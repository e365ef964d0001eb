"""Remarks for a manager's author: probable mistakes that are no errors, found by running a mission."""

from collections.abc import Iterable, Iterator

from suave_des.domain import BATTERY_LEVEL, WATER_VISIBILITY
from suave_des.errors import did_you_mean, shown
from suave_des.managing.base import ManagedSystem, ManagingSubsystem
from suave_des.registry import is_named_elsewhere

_MEASURED_SOMEWHERE = (WATER_VISIBILITY, BATTERY_LEVEL)
"""Attributes that some shipped scenario measures: a manager may be written for all of them."""


def remarks_at_start(manager: ManagingSubsystem, declared: Iterable[str]) -> tuple[str, ...]:
    """Check what a manager declares.

    Args:
        manager: that was just made.
        declared: the quality attributes in its `depends_on`.
    """
    unmeasured = _unmeasured("depends_on has {}, which nothing measures", declared, manager.system)
    return *unmeasured, *_uncalled_adapt(manager)


def remarks_at_end(system: ManagedSystem) -> tuple[str, ...]:
    """Check what a manager has looked up in a mission."""
    return tuple(_unmeasured("measured({}) is always None: nothing measures it", system.unmeasured, system))


def _unmeasured(text: str, names: Iterable[str], system: ManagedSystem) -> Iterator[str]:
    """Yield a remark, in which the name replaces {}, for each name that nothing measures."""
    known = sorted({*system.measurements, *_MEASURED_SOMEWHERE})
    for name in sorted(set(names).difference(known), key=str):
        yield f"{text.format(shown(name))} ({did_you_mean(name, known)})"


def _uncalled_adapt(manager: ManagingSubsystem) -> Iterator[str]:
    """Yield a remark if the manager's author has written an `adapt` that nothing calls."""
    author = next(base for base in type(manager).__mro__ if "adapt" in vars(base))
    is_shipped = author.__module__.startswith("suave_des.")
    if not is_shipped and manager.period_s is None and not is_named_elsewhere("adapt", author):
        yield "adapt is never called: period_s is None (set it in the class, such as period_s = 2.0)"
