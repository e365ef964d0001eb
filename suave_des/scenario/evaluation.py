"""What is evaluated of a mission besides its metrics: further ones, and requirements on metrics and measured values."""

from __future__ import annotations

from typing import Annotated, Literal, Self, get_args

from pydantic import Field, model_validator

from suave_des.scenario.quantities import NotNegative, Number, Strict, wrong

FurtherMetric = Literal[
    "adaptations_undone",
    "configurations",
    "reasoning_time_s",
    "area_covered_m2",
    "operational_thrusters",
    "battery_level",
    "recharges",
    "surfacing_time_s",
]
FURTHER_METRICS: tuple[str, ...] = get_args(FurtherMetric)
Metric = (
    FurtherMetric
    | Literal[
        "mission_duration_s",
        "search_time_s",
        "distance_inspected_m",
        "mean_reaction_time_s",
        "adaptations",
        "detection_time_s",
    ]
)


class Requirement(Strict):
    """A requirement that may be fulfilled in part, as in RELAX (Whittle et al., Requirements Engineering 15, 2010).

    Exactly one of `metric` and `attribute` is given. Fulfilment is 1 where the value is as required, and falls to 0
    in a straight line where it is off by the tolerance. Without tolerance it is RELAX's SHALL; with one, at_least is
    AS MANY AS POSSIBLE, at_most AS FEW (or AS EARLY) AS POSSIBLE, close_to AS CLOSE AS POSSIBLE TO.
    """

    metric: Metric | None = None
    """A metric of the mission."""
    attribute: str | None = None
    """A measured quality attribute; its fulfilment is the mean over mission time, from the first measurement on."""
    relation: Literal["at_least", "at_most", "close_to"]
    """How the value has to lie to the required one."""
    value: Number
    """The required value."""
    tolerance: NotNegative = 0.0
    """How far off the value may be; 0: not at all."""

    @model_validator(mode="after")
    def _is_about_one_thing(self) -> Self:
        if (self.metric is None) == (self.attribute is None):
            raise wrong("is about no value, or about two", "give either metric or attribute", "metric")
        return self

    def fulfilment(self, value: float) -> float:
        """To which degree a value fulfils the requirement, from 0 to 1."""
        off = value - self.value
        gap = {"at_least": -off, "at_most": off, "close_to": abs(off)}[self.relation]
        if gap <= 0.0:
            return 1.0
        return max(0.0, 1.0 - gap / self.tolerance) if self.tolerance > 0.0 else 0.0


Metrics = Annotated[tuple[FurtherMetric, ...], Field(max_length=len(FURTHER_METRICS))]
