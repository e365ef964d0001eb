"""From a scenario's description of a signal to the signal itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from suave_des.scenario.quantities import Distribution
from suave_des.scenario.signal_kinds import (
    ConstantSignal,
    Signal,
    SignalTable,
    SinusoidSignal,
    StepSignal,
    TableSignal,
)
from suave_des.world import signals

Draw = Callable[[str, Distribution], float]


def build_signal(name: str, description: Signal, tables: Mapping[str, SignalTable], draw: Draw) -> signals.Signal:
    """The signal of one run.

    Args:
        name: the signal's name in the scenario.
        description: the scenario's entry.
        tables: contents of the CSV files of table signals, by signal name.
        draw: draws what the entry gives as a distribution, under its key path.
    """
    match description:
        case SinusoidSignal():
            shift_s = draw(f"signals.{name}.shift_s", description.shift_s)
            return signals.sinusoid(description.period_s, description.minimum, description.maximum, shift_s)
        case ConstantSignal():
            return signals.constant(draw(f"signals.{name}.value", description.value))
        case StepSignal():
            time_s = draw(f"signals.{name}.time_s", description.time_s)
            return signals.step(time_s, description.before, description.after)
        case TableSignal():
            times_s, values = tables[name]
            return signals.table(times_s, values, linear=description.interpolation == "linear")
