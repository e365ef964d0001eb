"""What happens in a mission, as its record keeps it: events whose details have fields are made into
text, and read from it, here alone.
"""

import re
from collections.abc import Callable
from typing import NamedTuple, TypeVar


class ModeRequested(NamedTuple):
    """A mode is requested that differs from the one before."""

    function: str
    mode: str


class ModeRefused(NamedTuple):
    """A mode is requested that the function does not have."""

    function: str
    mode: str


class ModeSet(NamedTuple):
    """A mode takes effect."""

    function: str
    mode: str


class ComponentStatus(NamedTuple):
    """A monitor reports a component's status."""

    component: str
    status: str


class PipelineDetected(NamedTuple):
    """A point of the pipeline is seen, whose number is this, from 0."""

    point: int


class VisibilityCrossing(NamedTuple):
    """The measured visibility reaches a limit or falls below it, in words; and its value."""

    change: str
    measured: str


class BatteryCrossing(NamedTuple):
    """The battery's measured level does."""

    change: str
    measured: str


class Said(NamedTuple):
    """Any other event, whose detail is text alone."""

    event: str
    detail: str


Log = Callable[[str, NamedTuple], None]
"""Adds to the record what happens somewhere: in a node, a monitor, the manager."""
_Kind = TypeVar("_Kind", bound=NamedTuple)

_FORMS: dict[type[NamedTuple], tuple[str, str]] = {
    ModeRequested: ("mode_requested", "{} -> {}"),
    ModeRefused: ("refused", "{} -> {}"),
    ModeSet: ("mode_set", "{} = {}"),
    ComponentStatus: ("component_status", "{} {}"),
    PipelineDetected: ("pipeline_detected", "point {}"),
    VisibilityCrossing: ("visibility_crossing", "{} ({})"),
    BatteryCrossing: ("battery_crossing", "{} ({})"),
}
_PATTERNS = {str: "(.+?)", int: "([0-9]{1,9})"}


def texts_of(happening: NamedTuple) -> tuple[str, str]:
    """Return the event's name and its detail, as in events.csv."""
    if isinstance(happening, Said):
        return happening
    name, form = _FORMS[type(happening)]
    return name, form.format(*happening)


def name_of(kind: type[NamedTuple]) -> str:
    """Return the name of the events of a kind."""
    return _FORMS[kind][0]


def read(kind: type[_Kind], detail: str) -> _Kind | None:
    """Read the fields of a detail; None if it is not one of this kind."""
    types = kind.__annotations__.values()
    _, form = _FORMS[kind]
    pattern = re.escape(form).replace(r"\{\}", "{}").format(*map(_PATTERNS.get, types))
    found = re.fullmatch(pattern, detail, re.DOTALL)
    if found is None:
        return None
    return kind._make(of(text) for of, text in zip(types, found.groups(), strict=True))
