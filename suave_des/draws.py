"""What is random in one mission: each random quantity has a stream of its own, so that adding one
changes no other.
"""

from __future__ import annotations

import hashlib
import math
import random
from collections.abc import Callable, Mapping
from operator import attrgetter

from suave_des.scenario.models import Distribution, Scenario, draw


class Streams:
    """The random streams of one run of a campaign.

    A stream depends on the campaign's seed, the run's number and its own name only: not on the
    manager, so that runs with the same number use common random numbers, and not on which other
    streams exist or in which order they are created.

        visibility = Streams(seed=1, run=7).stream("visibility")
    """

    def __init__(self, seed: int, run: int) -> None:
        self._key = f"{seed}/{run}/"

    def stream(self, name: str) -> random.Random:
        """Create the generator of a name; two of the same name draw the same values."""
        digest = hashlib.blake2b((self._key + name).encode(), digest_size=16).digest()
        return random.Random(int.from_bytes(digest, "big"))


class Draws(Streams):
    """The random streams of a run, and the values that are drawn once for the whole run.

    Where a scenario gives a plain number instead of a distribution, the number is the value.

    Args:
        seed: the campaign's.
        run: number of the run, from 1.
        runs_per_draw: how many runs in a row share the values of a stream, by its name, see
            stream_name; one, if it is not in it.
        numbers: keeps the plain numbers by key path, for other runs of the same scenario.

    Attributes:
        drawn: values that hold for the whole run, by key path.
    """

    def __init__(
        self,
        scenario: Scenario,
        seed: int,
        run: int,
        runs_per_draw: Mapping[str, int],
        numbers: dict[str, float],
    ) -> None:
        super().__init__(seed, run)
        self._numbers = numbers
        self._scenario = scenario
        self._seed = seed
        self._run = run
        self._runs_per_draw = runs_per_draw
        self.drawn: dict[str, float] = {}

    def value(
        self, key: str, distribution: Distribution | None = None, least: float = -math.inf
    ) -> float:
        """Draw the run's value for a key of the scenario.

        Args:
            key: key path, which names the stream; after a slash, whose value it is, if several have
                one.
            distribution: None: the scenario's entry at that path.
            least: values below count as this.
        """
        value = self._numbers.get(key)
        if value is None:
            found = (
                attrgetter(key.partition("/")[0])(self._scenario)
                if distribution is None
                else distribution
            )
            if isinstance(found, float):
                value = self._numbers[key] = max(least, found)
            else:
                name = stream_name(key, found.shared)
                shared_by = self._runs_per_draw.get(name, 1)
                first = (
                    self._run - 1
                ) // shared_by * shared_by + 1  # of the runs that share the value
                value = max(least, found.draw(Streams(self._seed, first).stream(name)))
        self.drawn[key] = value
        return value

    def each_time(self, key: str, distribution: Distribution) -> Callable[[], float]:
        """Make a function that draws a new value at each call."""
        if isinstance(distribution, float):
            return lambda: distribution
        stream = self.stream(stream_name(key, distribution.shared))
        return lambda: draw(distribution, stream)

    def phase(self, timer: str, period_s: float) -> float:
        """Draw the phase of a periodic timer: nodes start at arbitrary times, others in each
        run.
        """
        return self.stream(f"phase/{timer}").random() * period_s


def stream_name(key: str, shared: str | None) -> str:
    """Name the stream that a key's values are drawn from: its own, or that of a draw that several
    keys share.
    """
    return key if shared is None else f"shared/{shared}"
