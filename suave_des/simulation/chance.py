"""Everything that is random in one mission: each use has a stream of its own, named after the scenario's key."""

from __future__ import annotations

from collections.abc import Callable

from suave_des.scenario.distributions import Distribution, draw
from suave_des.streams import Streams


class Chance(Streams):
    """The random streams of a run, and what was drawn from them.

    Attributes:
        drawn: values that hold for the whole run, by key path.
    """

    def __init__(self, seed: int, run: int) -> None:
        super().__init__(seed, run)
        self.drawn: dict[str, float] = {}

    def draw(self, key: str, distribution: Distribution) -> float:
        """The run's value of a scenario's distribution; a plain number is its own."""
        value = distribution if isinstance(distribution, float) else draw(distribution, self.stream(key))
        self.drawn[key] = value
        return value

    def sampler(self, key: str, distribution: Distribution) -> Callable[[], float]:
        """A function that draws a new value at each call."""
        if isinstance(distribution, float):
            return lambda: distribution
        stream = self.stream(key)
        return lambda: draw(distribution, stream)

    def phase(self, timer: str, period_s: float) -> float:
        """Phase of a timer: arbitrary per node, another one in each run."""
        return self.stream(f"phase/{timer}").random() * period_s
