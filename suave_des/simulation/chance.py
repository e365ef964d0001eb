"""Everything that is random in one mission: each use has a stream of its own, named after the scenario's key."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping
from types import MappingProxyType

from suave_des.scenario.quantities import Distribution, draw
from suave_des.streams import Streams


class Chance(Streams):
    """The random streams of a run, and what was drawn from them.

    Args:
        seed: the campaign's.
        run: number of the run, from 1.
        runs_per_draw: how many runs in a row share the value drawn for a key path; one, if the path is not in it.

    Attributes:
        drawn: values that hold for the whole run, by key path.
    """

    def __init__(self, seed: int, run: int, runs_per_draw: Mapping[str, int] = MappingProxyType({})) -> None:
        super().__init__(seed, run)
        self._seed, self._run, self._runs_per_draw = seed, run, runs_per_draw
        self.drawn: dict[str, float] = {}

    def draw(self, key: str, distribution: Distribution) -> float:
        """The run's value of a scenario's distribution; a plain number is its own."""
        value = distribution if isinstance(distribution, float) else draw(distribution, self._stream_of_draw(key))
        self.drawn[key] = value
        return value

    def _stream_of_draw(self, key: str) -> random.Random:
        shared_by = self._runs_per_draw.get(key, 1)
        if shared_by == 1:
            return self.stream(key)
        first = (self._run - 1) // shared_by * shared_by + 1
        return Streams(self._seed, first).stream(key)

    def sampler(self, key: str, distribution: Distribution) -> Callable[[], float]:
        """A function that draws a new value at each call."""
        if isinstance(distribution, float):
            return lambda: distribution
        stream = self.stream(key)
        return lambda: draw(distribution, stream)

    def phase(self, timer: str, period_s: float) -> float:
        """Phase of a timer: arbitrary per node, another one in each run."""
        return self.stream(f"phase/{timer}").random() * period_s
