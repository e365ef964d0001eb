"""The situations that metacontrol gets into: all that it knows but measured values. Each is worked out once.

Missions of one scenario go through the same few situations, so that what follows is looked up in most of them. Those of
several threads may share them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import lru_cache, partial
from math import inf, isfinite, nextafter
from typing import Any, Final, NamedTuple

from suave_des.knowledge.deliberation import REMEMBERED, Conclusion
from suave_des.knowledge.regions import Regions
from suave_des.managing.base import Bounds
from suave_des.monitor.diagnostics import RECOVERED

UNGROUNDED = "UNGROUNDED"

Values = tuple[float | None, ...]
"""Measured values, in the order of their quality attributes' names; none before the first measurement."""

Bound = tuple[float, float]
Region = tuple[Bound, ...]
"""Bounds of each measured value: all values between them are the same to the rules. Equal bounds are a value itself."""

NO_VALUE: Bound = (inf, -inf)
"""Bounds of what has not been measured: no value is between them."""

JOINED: Final = 64
"""Regions that are joined at most: where only equal values are the same to the rules there is no end to them."""


class Known(NamedTuple):
    """What makes a situation: objectives with their status, groundings, reported components."""

    objectives: dict[str, str | None]
    groundings: dict[str, str]
    components: dict[str, str]


News = Callable[..., None]
"""Changes what is known."""


def requested(known: Known, functions: tuple[str, ...]) -> None:
    """News: functions are needed."""
    for function in functions:
        known.objectives.setdefault(function, UNGROUNDED)


def cancelled(known: Known, functions: tuple[str, ...]) -> None:
    """News: functions are not needed any more."""
    for function in functions:
        known.objectives.pop(function, None)
        known.groundings.pop(function, None)


def reported(known: Known, component: str, status: str) -> None:
    """News: a component's status."""
    known.components[component] = status


def executed(known: Known, designs: tuple[tuple[str, str], ...], recovered: tuple[str, ...]) -> None:
    """News: function designs were grounded, by function, after components that have recovered were reasoned about.

    A recovery is news once: it has been reasoned about, and from now on the component is as if it had never failed.
    Kept, it would make every objective updatable for ever, and in the exemplar's oldest files, where the status says
    so, contradict the UNGROUNDED of each objective to come.
    """
    for function, design in designs:
        known.groundings[function] = design
        known.objectives[function] = None
    for component in recovered:
        if known.components.get(component) == RECOVERED:
            del known.components[component]


class Situations:
    """All situations that belong together: what is concluded in one of them depends on it and measured values alone.

    Args:
        attributes: quality attributes that are measured, in the order of the values.
        regions: regions of measured values that make no difference; none if each value makes one.

    Attributes:
        region: the region of measured values.
    """

    def __init__(self, attributes: tuple[str, ...], regions: Regions | None) -> None:
        self._attributes = attributes
        self.regions = regions
        self.region: Callable[[Values], Region] = lru_cache(maxsize=4096)(partial(_region, regions))
        self._all: dict[object, Situation] = {}
        self._size = 0

    def first(self) -> Situation:
        """Nothing is known."""
        return self.of(Known({}, {}, {}))

    def bounds(self, edges: Iterable[tuple[float, ...]]) -> Bounds:
        """Bounds by quality attribute."""
        return dict(zip(self._attributes, edges, strict=True))

    def of(self, known: Known) -> Situation:
        """The situation in which that is known."""
        key = tuple([tuple(sorted(part.items())) for part in known])
        found = self._all.get(key)
        if found is None:
            self.make_room()
            found = self._all[key] = Situation(self, known)
        return found

    def make_room(self) -> None:
        """Before anything is remembered: if that is too much, forget all."""
        self._size += 1
        if self._size > REMEMBERED:
            self._size = 1
            for situation in tuple(self._all.values()):
                situation.forget()
            self._all.clear()


class Situation:
    """What is known but measured values, what was concluded from it, and what it leads to.

    It does not change: news lead to another one.

    Attributes:
        objectives: the status of the objective of each function that is needed; none while all is well.
        groundings: the function designs in use, by function.
        components: the reported statuses.
        recovered: the components that are reported to have recovered.
    """

    def __init__(self, situations: Situations, known: Known) -> None:
        self._situations = situations
        self.objectives, self.groundings, self.components = known
        self.recovered = tuple([name for name, status in known.components.items() if status == RECOVERED])
        self._after: dict[object, Situation] = {}
        self._conclusions: dict[Region, Conclusion] = {}
        self._rests: dict[Region, Bounds] = {}

    def after(self, news: News, *what: Any) -> Situation:
        """The situation after news."""
        key = news, what
        found = self._after.get(key)
        if found is None:
            known = Known(self.objectives.copy(), self.groundings.copy(), self.components.copy())
            news(known, *what)
            found = self._after[key] = self._situations.of(known)
        return found

    def conclusion(self, region: Region) -> Conclusion | None:
        """What was concluded in a region, none if nothing was."""
        return self._conclusions.get(region)

    def remember(self, region: Region, conclusion: Conclusion) -> None:
        """Keep what was concluded."""
        self._situations.make_room()
        self._conclusions[region] = conclusion
        self._rests.clear()

    def forget(self) -> None:
        """Drop what is remembered."""
        self._after.clear()
        self._conclusions.clear()
        self._rests.clear()

    def is_met_by(self, conclusion: Conclusion) -> bool:
        """Whether all that a conclusion asks for is so already; where no design is left it asks for nothing."""
        if self.recovered:
            return False
        for decision in conclusion.plan.decisions:
            function, design = decision.function, decision.design
            if design is not None and (
                self.groundings.get(function) != design or self.objectives[function] is not None
            ):
                return False
        return True

    def rest(self, region: Region) -> Bounds | None:
        """Between which measured values all that would be concluded is known, and is so already.

        None if that is not known of a region itself.
        """
        bounds = self._rests.get(region)
        if bounds is None and self._is_met_in(region):
            bounds = self._rests[region] = self._situations.bounds(self._widened(region))
        return bounds

    def _widened(self, region: Region) -> Iterable[tuple[float, ...]]:
        # Of several values two could be in one gap in other regions.
        if len(region) != 1 or len(self._conclusions) > JOINED:
            return region
        return [_joined([only for (only,) in tuple(self._conclusions) if self._is_met_in((only,))])]

    def _is_met_in(self, region: Region) -> bool:
        conclusion = self._conclusions.get(region)
        return conclusion is not None and self.is_met_by(conclusion)


def _region(regions: Regions | None, values: Values) -> Region:
    if regions is not None:
        region = tuple([_bound(value, regions.around) for value in values])
        # Of two values in one gap between thresholds rules can tell which is the greater.
        if len(set(region)) == len(region):
            return region
    return tuple([_bound(value, _alone) for value in values])


def _bound(value: float | None, around: Callable[[float], Bound]) -> Bound:
    if value is None:
        return NO_VALUE
    return around(value) if isfinite(value) else _alone(value)


def _alone(value: float) -> Bound:
    return value, value


def _joined(bounds: list[Bound]) -> tuple[float, ...]:
    """Pairs of bounds in ascending order; a number by itself and the gap next to it are joined."""
    edges: list[float] = []
    for low, high in sorted(bounds):
        if low == high:
            low, high = nextafter(low, -inf), nextafter(high, inf)
        if edges and low < edges[-1]:
            edges[-1] = max(edges[-1], high)
        elif low < high:
            edges += low, high
    return tuple(edges)
