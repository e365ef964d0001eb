"""The /diagnostics topic: what monitors say, and who hears it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum


class Kind(StrEnum):
    """What a diagnostic is about; the values are the exemplar's message texts."""

    QA_STATUS = "QA status"
    COMPONENT_STATUS = "Component status"


FAILED = "FALSE"
RECOVERED = "RECOVERED"


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One message: the measured value of a quality attribute, or the status of a component."""

    time_s: float
    kind: Kind
    key: str
    value: float | str


Subscriber = Callable[[Diagnostic], None]


class DiagnosticsBus:
    """Hands each diagnostic to every subscriber at once, in the order of subscription."""

    def __init__(self) -> None:
        self._subscribers: list[Subscriber] = []

    def subscribe(self, subscriber: Subscriber) -> None:
        """Have every later diagnostic passed to `subscriber`."""
        self._subscribers.append(subscriber)

    def publish(self, diagnostic: Diagnostic) -> None:
        """Pass a diagnostic to all subscribers."""
        for subscriber in self._subscribers:
            subscriber(diagnostic)
