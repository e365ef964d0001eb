"""Everything that is random in one mission: each use has its own stream, named after the scenario's key."""

import math
from collections.abc import Callable, Mapping
from operator import attrgetter

from suave_des.scenario.models import Scenario
from suave_des.scenario.quantities import Distribution, Drawn, draw
from suave_des.scenario.signal_kinds import (
    ConstantSignal,
    Monitor,
    SignalDescription,
    SignalTable,
    SinusoidSignal,
    StepSignal,
    TableSignal,
)
from suave_des.streams import Streams
from suave_des.world import signals


class Distributions(dict[str, Distribution]):
    """What a scenario gives, a number or a distribution, by key path; looked up in the scenario when first needed."""

    def __init__(self, scenario: Scenario) -> None:
        super().__init__()
        self._scenario = scenario

    def __missing__(self, path: str) -> Distribution:
        found: Distribution = attrgetter(path)(self._scenario)
        self[path] = found
        return found


class Chance(Streams):
    """The random streams of a run, and what was drawn from them.

    Args:
        distributions: of the scenario.
        seed: the campaign's.
        run: number of the run, from 1.
        runs_per_draw: how many runs in a row share the value drawn for a key path; one, if the path is not in it.

    Attributes:
        drawn: values that hold for the whole run, by key path.
    """

    def __init__(self, distributions: Distributions, seed: int, run: int, runs_per_draw: Mapping[str, int]) -> None:
        super().__init__(seed, run)
        self._distributions, self._seed, self._run, self._runs_per_draw = distributions, seed, run, runs_per_draw
        self.drawn: dict[str, float] = {}

    def value(self, path: str, node: str = "") -> float:
        """The run's value of what the scenario gives at a key path; each node may have its own."""
        return self.draw(f"{path}/{node}" if node else path, self._distributions[path])

    def draw(self, key: str, distribution: Distribution, least: float = -math.inf) -> float:
        """The run's value of a distribution, at least `least`; a plain number is its own."""
        if not isinstance(distribution, float):
            shared_by = self._runs_per_draw.get(key, 1)
            first = (self._run - 1) // shared_by * shared_by + 1  # of the runs that share the value
            distribution = distribution.draw(Streams(self._seed, first).stream(_stream_name(key, distribution)))
        value = self.drawn[key] = max(least, distribution)
        return value

    def sampler(self, key: str, distribution: Distribution) -> Callable[[], float]:
        """A function that draws a new value at each call."""
        if isinstance(distribution, float):
            return lambda: distribution
        stream = self.stream(_stream_name(key, distribution))
        return lambda: draw(distribution, stream)

    def loss(self, key: str, monitor: Monitor) -> Callable[[float], bool] | None:
        """Whether the message of a monitor at a mission time is lost; none: none is."""
        if not monitor.loses_messages:
            return None
        stream, share, outages_s = self.stream(f"{key}.dropout"), monitor.dropout_probability, monitor.outages_s

        def is_lost(t_s: float) -> bool:
            by_chance = stream.random() < share
            return by_chance or any(since_s <= t_s <= to_s for since_s, to_s in outages_s)

        return is_lost

    def phase(self, timer: str, period_s: float) -> float:
        """Phase of a timer: arbitrary per node, another one in each run."""
        return self.stream(f"phase/{timer}").random() * period_s

    def signal(self, name: str, description: SignalDescription, tables: Mapping[str, SignalTable]) -> signals.Signal:
        """The run's signal from its entry in the scenario; `tables` has the contents of CSV files, by signal name."""
        match description:
            case SinusoidSignal():
                shift_s = self.draw(f"signals.{name}.shift_s", description.shift_s)
                return signals.sinusoid(description.period_s, description.minimum, description.maximum, shift_s)
            case ConstantSignal():
                return signals.constant(self.draw(f"signals.{name}.value", description.value))
            case StepSignal():
                time_s = self.draw(f"signals.{name}.time_s", description.time_s)
                return signals.step(time_s, description.before, description.after)
            case TableSignal():
                times_s, values = tables[name]
                return signals.table(times_s, values, linear=description.interpolation == "linear")


def _stream_name(key: str, distribution: Drawn) -> str:
    """Name of the stream that a key's values are drawn from: its own, or that of a draw that several keys share."""
    return key if distribution.shared is None else f"shared/{distribution.shared}"
