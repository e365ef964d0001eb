"""The /diagnostics topic: what monitors say, and who hears it."""

from __future__ import annotations

from collections.abc import Callable, Collection
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


_KINDS = tuple(Kind)
Subscriber = Callable[[Diagnostic], None]


class DiagnosticsBus:
    """Hands each diagnostic at once to those who want its kind, in the order of subscription."""

    def __init__(self) -> None:
        self._subscribers: dict[Kind, list[Subscriber]] = {kind: [] for kind in _KINDS}

    def subscribe(self, subscriber: Subscriber, kinds: Collection[Kind] = _KINDS) -> None:
        """Have every later diagnostic of some kinds passed to `subscriber`."""
        for kind in kinds:
            self._subscribers[kind].append(subscriber)

    def has_listeners(self, kind: Kind) -> bool:
        """Whether anybody wants diagnostics of a kind."""
        return bool(self._subscribers[kind])

    def publish(self, diagnostic: Diagnostic) -> None:
        """Pass a diagnostic to those who want its kind."""
        for subscriber in self._subscribers[diagnostic.kind]:
            subscriber(diagnostic)
