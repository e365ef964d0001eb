"""Parts of a scenario that only the newest exemplar has, or none: functions of one's own, a varying current, a leak."""

from __future__ import annotations

from typing import Annotated

from pydantic import ConfigDict, Field

from suave_des.scenario.quantities import (
    LONGEST_S,
    CurrentDistribution,
    HeadingDistribution,
    Name,
    ShiftDistribution,
    Strict,
    TimeDistribution,
    Within,
)


class MissionFunctions(Strict):
    """Functions that the mission needs besides the exemplar's."""

    lasting: tuple[Name, ...] = ()
    """Needed from launch to the end."""
    search_pipeline: tuple[Name, ...] = ()
    """Needed by the first task."""
    inspect_pipeline: tuple[Name, ...] = ()
    """Needed by the second task."""


class FunctionSettings(Strict):
    """A function of one's own: its class, and whatever settings that has."""

    model_config = ConfigDict(extra="allow")

    node: Annotated[str, Field(pattern=r"^[A-Za-z_][\w.]*(:[A-Za-z_]\w*)?$")]
    """Class of the function's node, as module:Class, or the name under which a package registers it."""


class CurrentWave(Strict):
    """A current whose speed goes up and down: mean + amplitude sin(2 pi (t + shift) / period), in one direction."""

    mean_m_per_s: CurrentDistribution = 0.0
    """Mean speed, drawn once a run."""
    amplitude_m_per_s: CurrentDistribution = 0.0
    """How far the speed departs from it, drawn once a run."""
    period_s: Annotated[float, Field(strict=True), Within(1.0, LONGEST_S, unit="s")] = 120.0
    """Time from one greatest speed to the next."""
    shift_s: ShiftDistribution = 0.0
    """Added to mission time, drawn once a run."""
    direction_rad: HeadingDistribution = 0.0
    """Where the water flows to, from east towards north, drawn once a run."""


class Current(Strict):
    """Velocity of the water in the world frame: a constant part, drawn once a run, and one that varies over time."""

    x_m_per_s: CurrentDistribution = 0.0
    """Towards east."""
    y_m_per_s: CurrentDistribution = 0.0
    """Towards north."""
    z_m_per_s: CurrentDistribution = 0.0
    """Upwards."""
    wave: CurrentWave | None = None
    """The part that varies over time; left out: none."""


class Leak(Strict):
    """A leak: the vehicle gives up everything else, and surfaces."""

    time_s: TimeDistribution
    """When it is detected, drawn once a run."""
