"""The parts that all missions of one scenario share, and the vehicle of each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from functools import cached_property, lru_cache
from math import cos, pi, sin
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from suave_des.arguments import plain_arguments
from suave_des.compiling import Array
from suave_des.domain import SEA_BED_Z_M, SURFACE_Z_M
from suave_des.draws import Draws, stream_name
from suave_des.learned import read_learned
from suave_des.managed.follow import there_and_back
from suave_des.registry import custom_functions, declared_files, manager_class
from suave_des.scenario.loader import LoadedScenario, value_at
from suave_des.scenario.models import Calibration, CurrentWaveDescription, VehicleDescription
from suave_des.vehicle.kernel import TRACK_COLUMNS
from suave_des.vehicle.model import Autopilot, Pose, Thruster, VehicleModel
from suave_des.vehicle.vehicle import STEP_S, Point, Vehicle, track_rows
from suave_des.world.pipeline import CameraRecord, sample_points

if TYPE_CHECKING:  # owlready2 is loaded only when it is needed
    from suave_des.knowledge.reasoner import Reasoner


def draw_start(draws: Draws) -> tuple[tuple[float, float], tuple[float, float]]:
    """Draw where a run's mission begins, and where its search has its origin: x and y of each,
    world frame, m.
    """
    value = draws.value
    x_m, y_m = (value(f"start.{axis}_m") + value(f"calibration.drift_{axis}_m") for axis in "xy")
    return (x_m, y_m), (
        x_m + value("calibration.origin_x_m"),
        y_m + value("calibration.origin_y_m"),
    )


class PreparedScenario:
    """A scenario with the parts that its missions share; see `Simulator` for the arguments."""

    @plain_arguments
    def __init__(
        self,
        loaded: LoadedScenario,
        runs_per_draw: Mapping[str, int] = MappingProxyType({}),
        training: dict[str, dict[str, Any]] | None = None,
    ) -> None:
        self.loaded, self.training = loaded, training
        self.runs_per_draw = {
            _stream_of(loaded, path): runs for path, runs in runs_per_draw.items()
        }
        scenario = loaded.scenario
        self.points = sample_points(
            scenario.pipeline.vertices_m, scenario.pipeline.points_per_piece
        )
        self.path = there_and_back(self.points)
        detected = self.points + np.array(
            [0.0, 0.0, scenario.revision.monitors.detected_point_height_m]
        )
        self.detected_points, self.view_tangent = detected, scenario.vehicle.camera.tangent
        self.camera = CameraRecord(
            True, self.view_tangent, *detected.min(axis=0), *detected.max(axis=0)
        )
        self.duration_s = (
            scenario.mission.time_limit_s + scenario.revision.coordinator.limit_check_period_s
        )
        self.custom_functions = custom_functions(loaded)
        calibrated = [name for name in Autopilot._fields if name in Calibration.model_fields]
        self.autopilot = Autopilot(
            **{name: getattr(scenario.calibration, name) for name in calibrated}
        )
        self.vehicle_model = vehicle_model(scenario.vehicle)
        self.numbers: dict[str, float] = {}
        self._spare_tracks: list[Array] = []
        self._manager_inputs: dict[str, tuple[Mapping[str, Path], Mapping[str, Any]]] = {}

    @cached_property
    def knowledge(self) -> Reasoner:
        """The scenario's knowledge base with its reasoner, opened and checked on first use."""
        from suave_des.scenario_knowledge import open_knowledge

        return open_knowledge(self.loaded)

    def manager_inputs(self, manager: str) -> tuple[Mapping[str, Path], Mapping[str, Any]]:
        """Find the files that a manager declares, by their names as given, and its training result.

        The result is mutable in training; otherwise it is the content of the file that `learned`
        names, if any.

        Raises:
            InputError: a file is not there; or the training result cannot be read, or has something
                else in it.
        """
        if manager not in self._manager_inputs:
            found = declared_files([self.loaded], {manager: manager_class(manager)})
            declared = {name: path for (_, name), path in found.items()}
            name = (
                None
                if self.training is not None
                else self.loaded.manager_settings(manager).get("learned")
            )
            path = None if name is None else self.loaded.manager_file(manager, str(name))
            self._manager_inputs[manager] = (
                declared,
                MappingProxyType({}) if path is None else read_learned(path),
            )
        files, learned = self._manager_inputs[manager]
        return files, learned if self.training is None else self.training.setdefault(manager, {})

    def make_vehicle(
        self, draws: Draws, start_m: tuple[float, float], track: Array, reasons: bool
    ) -> Vehicle:
        """Make the vehicle of one mission; if the manager reasons, it slows the simulator down."""
        scenario, value = self.loaded.scenario, draws.value
        loss = value("calibration.real_time_factor_loss")
        if reasons:
            loss += scenario.reasoning_share() * value("calibration.reasoning_slowdown")
        current_m_per_s, wave = _draw_current(scenario.current.wave, draws)
        return Vehicle(
            self.vehicle_model,
            self.autopilot,
            Pose(*start_m, value("start.z_m"), 0.0, 0.0, value("start.heading_rad")),
            self.duration_s,
            altitude_error_m=value("calibration.altitude_error_m"),
            current_m_per_s=current_m_per_s,
            current_wave=wave,
            time_scale=1.0 / (1.0 + loss),
            z_limits_m=(SEA_BED_Z_M, SURFACE_Z_M),
            memory=track,
        )

    def take_track(self) -> Array:
        """Return memory for a vehicle's track; to allocate it for each mission would fragment
        memory.
        """
        return (
            self._spare_tracks.pop()
            if self._spare_tracks
            else np.empty((track_rows(self.duration_s), TRACK_COLUMNS))
        )

    def give_back(self, track: Array) -> None:
        """Keep the memory of a mission that is no longer needed for the next one."""
        self._spare_tracks.append(track)


def _stream_of(loaded: LoadedScenario, path: str) -> str:
    """Return the stream of what is drawn at a key path: that of other keys, if they share a
    draw.
    """
    found = value_at(loaded, path.partition("/")[0])
    shared = found.get("shared") if isinstance(found, Mapping) else None
    return stream_name(path, shared)


@lru_cache(maxsize=64)
def vehicle_model(description: VehicleDescription) -> VehicleModel:
    """Return a vehicle's constants; equal descriptions give the same object, which is the key of
    cached results.
    """
    values = {each.name: getattr(description, each.name) for each in fields(VehicleModel)}
    thrusters = tuple(Thruster(each.position_m, each.direction) for each in description.thrusters)
    return VehicleModel(**values | {"thrusters": thrusters})


def _draw_current(
    wave: CurrentWaveDescription | None, draws: Draws
) -> tuple[Point, tuple[float, float, float, float]]:
    """Draw the current: its constant part, and the part that varies over time, as the vehicle needs
    it.
    """
    value = draws.value
    x, y, z = (value(f"current.{axis}_m_per_s") for axis in "xyz")
    if wave is None:
        return (x, y, z), (0.0, 0.0, 0.0, 0.0)
    east, north = cos(direction_rad := value("current.wave.direction_rad")), sin(direction_rad)
    mean, amplitude = value("current.wave.mean_m_per_s"), value("current.wave.amplitude_m_per_s")
    rate = 2.0 * pi / wave.period_s
    varying = (
        amplitude * east,
        amplitude * north,
        rate * STEP_S,
        rate * value("current.wave.shift_s"),
    )
    return (x + mean * east, y + mean * north, z), varying
