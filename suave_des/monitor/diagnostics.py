"""The /diagnostics topic: what monitors publish, and who subscribes to it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # or looking a manager up would load the compiler
    from suave_des.vehicle.model import Pose


class Kind(StrEnum):
    """The kinds of diagnostics; the values are the exemplar's message texts.

    Example:
        class Listener(NoManager):
            subscribes_to = (Kind.QA_STATUS, Kind.COMPONENT_STATUS)
    """

    QA_STATUS = "QA status"
    COMPONENT_STATUS = "Component status"
    POSE = "Pose"
    """Key pose, a `Pose`. Not published by the exemplar's monitors, like the next two: subscribers
    have to name it.
    """
    DISTANCE = "Distance inspected"
    """Key distance_inspected_m."""
    DETECTION = "Pipeline detected"
    """Key pipeline, the index of the point seen first; at the moment of the first sight."""


EXEMPLAR_KINDS = (Kind.QA_STATUS, Kind.COMPONENT_STATUS)
"""The kinds that the exemplar's monitors publish."""
FAILED, RECOVERED = "FALSE", "RECOVERED"
"""Statuses of a thruster, as the ontology's property c_status has them: FALSE, it cannot be
used.
"""
HULL, LEAK = "hull", "LEAK"
"""The component that leaks, and its status then."""


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One message: a measured value of a quality attribute, a component's status, or what the other
    kinds say.
    """

    time_s: float
    kind: Kind
    key: str
    value: float | str | Pose


Subscriber = Callable[[Diagnostic], None]


class DiagnosticsBus:
    """Passes each diagnostic at once to the subscribers to its kind, in the order of
    subscription.
    """

    def __init__(self) -> None:
        self._subscribers: defaultdict[Kind, list[Subscriber]] = defaultdict(list)
        # monitors, for a subscriber
        self._waiting: defaultdict[Kind, list[Callable[[], object]]] = defaultdict(list)

    def subscribe(self, subscriber: Subscriber, kinds: Iterable[Kind] = EXEMPLAR_KINDS) -> None:
        """Pass every later diagnostic of some kinds to `subscriber`."""
        for kind in kinds:
            self._subscribers[kind].append(subscriber)
            for start in self._waiting.pop(kind, ()):
                start()

    def when_subscribed(self, kind: Kind, start: Callable[[], object]) -> None:
        """Start a monitor at the first subscription to its kind of diagnostic, or now if there has
        been one.
        """
        if self._subscribers[kind]:
            start()
        else:
            self._waiting[kind].append(start)

    def publish(self, diagnostic: Diagnostic) -> None:
        """Pass a diagnostic to the subscribers to its kind."""
        for subscriber in self._subscribers[diagnostic.kind]:
            subscriber(diagnostic)

    def close(self) -> None:
        """Pass nothing on any more."""
        self._subscribers.clear()
        self._waiting.clear()
