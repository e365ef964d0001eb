"""Settings of the managing subsystems, by name."""

from __future__ import annotations

from typing import Self

from pydantic import ConfigDict, model_validator

from suave_des.scenario.distributions import Number, Period, Strict, wrong


def paired(part: Strict, one: str, other: str) -> None:
    """Raise an error unless two lists of a part have the same length."""
    lengths = len(getattr(part, one)), len(getattr(part, other))
    if lengths[0] != lengths[1]:
        raise wrong(f"{one} has {lengths[0]} entries, {other} {lengths[1]}", "give as many of both", other, one)


class RandomSettings(Strict):
    """The random manager."""

    adaptation_period_s: Period = 15.0
    """Period at which it picks modes."""


class MetacontrolSettings(Strict):
    """The metacontrol manager."""

    reasoning_period_s: Period = 2.0
    """Period of its MAPE-K loop."""


class BehaviourTreeSettings(Strict):
    """The behaviour tree manager of revision 1.5."""

    tick_period_s: Period = 0.1
    """Period at which the tree is ticked."""
    visibility_thresholds_m: tuple[Number, ...] = (3.25, 2.25, 1.25)
    """Visibility from which on each of search_modes is chosen; the first that is reached wins."""
    search_modes: tuple[str, ...] = ("fd_spiral_high", "fd_spiral_medium", "fd_spiral_low")
    """Search modes, one for each threshold."""
    battery_limit: Number = 0.25
    """Battery level below which the extended tree goes to recharge."""

    @model_validator(mode="after")
    def _paired(self) -> Self:
        paired(self, "visibility_thresholds_m", "search_modes")
        return self


class ManagerSettings(Strict):
    """Settings of managing subsystems by name; an outside manager finds its own under its own name."""

    model_config = ConfigDict(extra="allow")

    random: RandomSettings = RandomSettings()
    """The random manager."""
    metacontrol: MetacontrolSettings = MetacontrolSettings()
    """The metacontrol manager."""
    bt: BehaviourTreeSettings = BehaviourTreeSettings()
    """The behaviour tree manager."""
