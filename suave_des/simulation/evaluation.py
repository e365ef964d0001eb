"""Further metrics of a mission and its requirements, for scenarios that ask for them."""

from dataclasses import dataclass

from suave_des.compiling import Array
from suave_des.domain import SEA_BED_Z_M
from suave_des.metrics.further import Observer, Value, fulfilments
from suave_des.metrics.result import MissionMetrics
from suave_des.monitor.measurements import BatteryLevel, Measured
from suave_des.scenario.models import FURTHER_METRICS, Scenario
from suave_des.vehicle.vehicle import Vehicle, row_at
from suave_des.world.coverage import covered_area_m2


@dataclass(frozen=True)
class Evaluation:
    """What a mission's further metrics are computed from.

    Attributes:
        scenario: says which are asked for.
        observer: has noted what happened.
        vehicle: has the track.
        visibility_m: measured water visibility at each row of the track.
        measured: what monitors have measured, by quality attribute.
        battery: its level; none if there is no battery.
    """

    scenario: Scenario
    observer: Observer
    vehicle: Vehicle
    visibility_m: Array
    measured: dict[str, Measured]
    battery: BatteryLevel | None

    def further(self, metrics: MissionMetrics, now_s: float) -> dict[str, Value]:
        """The further metrics and the fulfilment of requirements at a mission time, by column."""
        scenario = self.scenario
        asked = (*scenario.metrics, *(str(each.metric) for each in scenario.requirements.values()))
        found = {metric: self._value(metric, now_s) for metric in asked if metric in FURTHER_METRICS}
        degrees = fulfilments(scenario.requirements, metrics, found, self.measured, now_s)
        columns = {**found, **{f"requirement_{name}": degree for name, degree in degrees.items()}}
        return {name: columns[name] for name in scenario.further_columns}

    def _value(self, metric: str, now_s: float) -> Value:
        match metric:
            case "adaptations_undone":
                return self.observer.adaptations_undone
            case "configurations":
                return self.observer.configurations()
            case "reasoning_time_s":
                return self.observer.reasoning_time_s
            case "operational_thrusters":
                return self.observer.operational_thrusters()
            case "area_covered_m2":
                self.vehicle.position(now_s)  # fills the track until now
                tangent = self.scenario.vehicle.camera.tangent
                return covered_area_m2(self.vehicle.track, row_at(now_s), self.visibility_m, SEA_BED_Z_M, tangent)
            case "surfacing_time_s":
                return self.observer.surfacing_time_s
        assert self.battery is not None
        level = self.battery.level(now_s)
        return self.battery.recharges if metric == "recharges" else level
