"""One mission: scenario, manager, run and seed, wired into a SimPy environment."""

from __future__ import annotations

import gc
from collections.abc import Callable, Mapping
from functools import cached_property
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import simpy

from suave_des.clock import Process
from suave_des.errors import SuaveDesError
from suave_des.managed.coordinator import MissionCoordinator
from suave_des.managed.detection import PipelineDetector, measured_at_rows
from suave_des.managed.follow import FollowPipeline, Way
from suave_des.managed.mode_manager import ModeManager
from suave_des.managed.motion import MaintainMotion
from suave_des.managed.node import Frame, FunctionNode, SetPointSender
from suave_des.managed.reactions import ReactionMeter
from suave_des.managed.recharge import GenerateRechargePath
from suave_des.managed.search import GenerateSearchPath
from suave_des.managed.task import FOLLOW, MAINTAIN_MOTION, RECHARGE, SEARCH
from suave_des.managing.base import ManagedSystem
from suave_des.monitor.diagnostics import DiagnosticsBus, Kind
from suave_des.monitor.measurements import BatteryLevel, Measurements
from suave_des.monitor.measuring import measure
from suave_des.monitor.monitors import ThrusterFault, battery_monitor, signal_monitor, thruster_monitor
from suave_des.scenario.loader import LoadedScenario
from suave_des.scenario.models import Battery
from suave_des.simulation.chance import Chance
from suave_des.simulation.host import RAISED, ManagerHost
from suave_des.simulation.recording import Recorder
from suave_des.simulation.result import MissionMetrics, MissionResult
from suave_des.simulation.signals import build_signal
from suave_des.vehicle.bluerov2 import BLUEROV2
from suave_des.vehicle.kernel import ROW
from suave_des.vehicle.model import Array
from suave_des.vehicle.vehicle import Autopilot, Pose, Vehicle, track_rows
from suave_des.world.pipeline import SEA_BED_Z_M, SURFACE_Z_M, sample_points, there_and_back

OnTime = Callable[[float, float], None]

_MISSIONS_FREED = 100
"""A mission's objects know one another, so only garbage collection frees them: soon done while they are still in the
processor's caches. After so many missions the collector's own rules are left to decide: they free what is older, too.
"""


class _Memory(NamedTuple):
    """What a mission fills row by row, kept from mission to mission: allocated for each, a megabyte leaves the
    process's memory in pieces.
    """

    track: Array
    visibility_m: Array


class Simulator:
    """Runs missions of one scenario in this process; what does not change between missions is made once.

    Args:
        loaded: the scenario with its files.
        runs_per_draw: how many runs in a row share the value drawn for a key path; one, if the path is not in it.
    """

    def __init__(self, loaded: LoadedScenario, runs_per_draw: Mapping[str, int] = MappingProxyType({})) -> None:
        self.loaded = loaded
        self.runs_per_draw = dict(runs_per_draw)
        scenario = loaded.scenario
        pipeline = scenario.pipeline
        self.points = sample_points(pipeline.vertices_m, pipeline.points_per_piece)
        self.way = Way.along(there_and_back(self.points))
        height = scenario.revision.monitors.detected_point_height_m
        self.detection_points = self.points + np.array([0.0, 0.0, height])
        self.duration_s = scenario.mission.time_limit_s + scenario.revision.coordinator.limit_check_period_s
        self._spare_memory: list[_Memory] = []

    @cached_property
    def knowledge(self) -> Any:
        """The scenario's knowledge base with its reasoner (a Deliberation), opened and checked on first use."""
        from suave_des.simulation.knowledge import open_knowledge  # owlready2 is loaded only when it is needed

        return open_knowledge(self.loaded)

    def run(
        self, manager: str, run: int, seed: int, *, record: bool = False, on_time: OnTime | None = None
    ) -> MissionResult:
        """Run one mission.

        Args:
            manager: name of the managing subsystem, or module:Class.
            run: number of the run in its campaign; together with the seed it decides everything that is random.
            seed: seed of the campaign.
            record: whether to keep events and trajectory.
            on_time: called each second of mission time with it and the time limit, in s.

        Raises:
            MissionError: the manager raised; the error names it, the run and the mission time.
            InputError: the manager or the knowledge base cannot be used.
        """
        if gc.isenabled() and gc.get_count()[1] < _MISSIONS_FREED:
            gc.collect(0)
        memory = self._spare_memory.pop() if self._spare_memory else self._make_memory()
        try:
            mission = _Mission(self, manager, run, seed, memory, record=record)
            if on_time is not None:
                mission.env.process(_tell_time(mission.env, on_time, self.loaded.scenario.mission.time_limit_s))
            return mission.result()
        finally:
            self._spare_memory.append(memory)

    def _make_memory(self) -> _Memory:
        rows = track_rows(self.duration_s)
        return _Memory(np.empty((rows, ROW)), np.empty(rows))


def _tell_time(env: simpy.Environment, on_time: OnTime, limit_s: float) -> Process:
    while env.now <= limit_s:
        on_time(env.now, limit_s)
        yield env.timeout(1.0)


class _Mission:
    """The wiring of one mission."""

    def __init__(
        self, simulator: Simulator, manager: str, run: int, seed: int, memory: _Memory, *, record: bool
    ) -> None:
        self.simulator = simulator
        self._memory = memory
        self.scenario = simulator.loaded.scenario
        self.revision = self.scenario.revision
        self.manager_name, self.run, self.seed = manager, run, seed
        self.chance = Chance(seed, run, simulator.runs_per_draw)
        self.env = simpy.Environment()
        self.recorder = Recorder(self.env, enabled=record)
        self.bus = DiagnosticsBus()
        self.duration_s = simulator.duration_s
        self.vehicle = self._make_vehicle()
        self.signals = {name: self._measure(name) for name in sorted(self.scenario.signals)}
        self.visibility = self.signals["water_visibility"]
        self.battery = None if self.scenario.battery is None else self._make_battery(self.scenario.battery)
        measured_at_rows(*self.visibility.arrays, memory.visibility_m)
        self.detector = PipelineDetector(self.env, self.vehicle, memory.visibility_m, simulator.detection_points)
        self.follow, nodes = self._make_functions()
        self.modes = ModeManager(
            self.env,
            simulator.loaded.modes,
            nodes,
            self.chance.sampler("latencies.mode_change_s", self.scenario.latencies.mode_change_s),
            self.recorder.log,
        )
        self.reactions = ReactionMeter(self.env, self.scenario.reaction_metric, self.visibility, self.battery)
        self.bus.subscribe(self.reactions.diagnostic, (Kind.COMPONENT_STATUS,))
        if record:
            self.bus.subscribe(self.recorder.diagnostic_of(self.scenario.reaction_metric.visibility_thresholds_m))
            self.modes.on_effect(self.recorder.mode_effect)
        self.modes.on_effect(self.reactions.mode_effect)
        self.coordinator = self._make_coordinator()
        self.host = self._make_host()
        self._start_monitors()

    def result(self) -> MissionResult:
        """Run to the end and read the metrics."""
        try:
            self.env.run(until=self.coordinator.ended)
        except SuaveDesError:
            raise
        except RAISED as error:  # in a process that the manager started by itself
            raise self.host.mission_error(error) from error
        point = self.detector.first_point
        found = self.coordinator.search_time_s is not None
        metrics = MissionMetrics(
            scenario=self.scenario.name,
            manager=self.manager_name,
            run=self.run,
            seed=self.seed,
            initial_x_m=self.chance.drawn["start.x_m"],
            initial_y_m=self.chance.drawn["start.y_m"],
            mission_duration_s=float(self.env.now),
            pipeline_found=found,
            search_time_s=self.coordinator.search_time_or_limit_s(),
            distance_inspected_m=self.coordinator.distance_inspected_m,
            mean_reaction_time_s=self.reactions.mean_s(),
            adaptations=self.modes.adaptations,
            detection_time_s=self.detector.detected_s if found else None,
            detection_x_m=float(self.simulator.points[point, 0]) if found and point is not None else None,
            detection_y_m=float(self.simulator.points[point, 1]) if found and point is not None else None,
        )
        trajectory = self.recorder.trajectory(self.vehicle, self.visibility)
        return MissionResult(
            metrics, tuple(self.recorder.events), trajectory, tuple(self.recorder.knowledge), self.chance.drawn
        )

    # The world and the vehicle.

    def _make_vehicle(self) -> Vehicle:
        start, current, calibration = self.scenario.start, self.scenario.current, self.scenario.calibration
        x_m, y_m = self.chance.draw("start.x_m", start.x_m), self.chance.draw("start.y_m", start.y_m)
        self.origin_m = (
            x_m + self.chance.draw("calibration.drift_x_m", calibration.drift_x_m),
            y_m + self.chance.draw("calibration.drift_y_m", calibration.drift_y_m),
        )
        z_m, heading_rad = (
            self.chance.draw("start.z_m", start.z_m),
            self.chance.draw("start.heading_rad", start.heading_rad),
        )
        loss = self.chance.draw("calibration.real_time_factor_loss", calibration.real_time_factor_loss)
        return Vehicle(
            BLUEROV2,
            Autopilot(
                calibration.position_gain_per_s,
                calibration.horizontal_speed_limit_m_per_s,
                calibration.vertical_speed_limit_m_per_s,
                calibration.velocity_time_constant_s,
                self.chance.draw("calibration.altitude_error_m", calibration.altitude_error_m),
                self.chance.draw("calibration.altitude_deadband_m", calibration.altitude_deadband_m),
            ),
            Pose(*self.origin_m, z_m, 0.0, 0.0, heading_rad),
            self.duration_s,
            current_m_per_s=(
                self.chance.draw("current.x_m_per_s", current.x_m_per_s),
                self.chance.draw("current.y_m_per_s", current.y_m_per_s),
                self.chance.draw("current.z_m_per_s", current.z_m_per_s),
            ),
            time_scale=1.0 / (1.0 + loss),
            z_limits_m=(SEA_BED_Z_M, SURFACE_Z_M),
            memory=self._memory.track,
        )

    # The monitors.

    def _start_monitors(self) -> None:
        if self.bus.has_listeners(Kind.QA_STATUS):
            for measurements in self.signals.values():
                self.env.process(signal_monitor(self.env, self.bus, measurements))
            if self.battery is not None:
                self.env.process(battery_monitor(self.env, self.bus, self.battery))
        faults = [
            ThrusterFault(
                event.thruster,
                event.event == "failure",
                self.chance.draw(f"thruster_events.{place}.time_s", event.time_s),
            )
            for place, event in enumerate(self.scenario.thruster_events)
        ]
        self.env.process(
            thruster_monitor(
                self.env,
                self.bus,
                faults,
                lambda thruster, health: self.vehicle.set_thruster_health(self.env.now, thruster, health),
                phase_s=self.chance.phase("thruster_monitor", 1.0),
                after_previous=self.revision.monitors.thruster_event_times == "after_previous",
            )
        )

    def _measure(self, name: str) -> Measurements:
        signal = self.scenario.signals[name]
        period_s = signal.publishing_period_s or self.revision.monitors.visibility_publishing_period_s
        noisy = signal.noise != 0.0
        return measure(
            name,
            build_signal(name, signal, self.simulator.loaded.tables, self.chance.draw),
            self.duration_s,
            period_s=period_s,
            phase_s=self.chance.phase(f"signals.{name}", period_s),
            time_step_s=signal.time_step_s,
            noise=self.chance.sampler(f"signals.{name}.noise", signal.noise) if noisy else None,
        )

    def _make_battery(self, battery: Battery) -> BatteryLevel:
        def is_at_station(t_s: float) -> bool:
            x, y, _ = self.vehicle.position(t_s)
            radius = battery.station_radius_m
            return abs(x - battery.station_x_m) <= radius and abs(y - battery.station_y_m) <= radius

        return BatteryLevel(
            is_at_station,
            discharge_time_s=battery.discharge_time_s,
            period_s=battery.publishing_period_s,
            phase_s=self.chance.phase("battery_monitor", battery.publishing_period_s),
        )

    # The managed subsystem.

    def _sender(self, node: str) -> SetPointSender:
        set_points = self.revision.set_points
        frame = Frame(
            self.chance.draw(f"revision.set_points.node_frame_offset_x_m/{node}", set_points.node_frame_offset_x_m),
            self.chance.draw(f"revision.set_points.node_frame_offset_y_m/{node}", set_points.node_frame_offset_y_m),
            self.chance.draw(f"revision.set_points.node_frame_offset_z_m/{node}", set_points.node_frame_offset_z_m),
        )
        stream = self.chance.stream(f"set_points/{node}") if self.loss_probability else None
        return SetPointSender(self.env, self.vehicle, frame, self.loss_probability, stream)

    def _make_functions(self) -> tuple[FollowPipeline, dict[str, FunctionNode]]:
        env, vehicle, revision = self.env, self.vehicle, self.revision
        self.loss_probability = self.chance.draw(
            "revision.set_points.loss_probability", revision.set_points.loss_probability
        )
        follow = FollowPipeline(env, vehicle, self._sender(FOLLOW), revision.follow, self._path)
        nodes: dict[str, FunctionNode] = {
            MAINTAIN_MOTION: MaintainMotion(env, self.bus, revision.recovery, self._restore_thruster),
            SEARCH: GenerateSearchPath(
                env,
                vehicle,
                self._sender(SEARCH),
                revision.spiral,
                self.origin_m,
                self.chance.phase(SEARCH, 1.0),
                self.chance.draw("latencies.guided_start_s", self.scenario.latencies.guided_start_s),
            ),
            FOLLOW: follow,
        }
        if self.scenario.battery is not None:
            battery = self.scenario.battery
            station_m = (battery.station_x_m, battery.station_y_m)
            nodes[RECHARGE] = GenerateRechargePath(env, self._sender(RECHARGE), station_m)
        return follow, nodes

    def _restore_thruster(self, thruster: int) -> None:
        self.vehicle.set_thruster_health(self.env.now, thruster, 1.0)

    def _path(self) -> Way | None:
        first = self.detector.first_point
        return None if first is None else self.simulator.way.from_point(first)

    def _make_coordinator(self) -> MissionCoordinator:
        settings = self.revision.coordinator
        return MissionCoordinator(
            self.env,
            settings,
            self.detector,
            self.follow,
            lambda task: self.host.request(task),
            lambda task: self.host.cancel(task),
            time_limit_s=self.scenario.mission.time_limit_s,
            start_delay_s=self.chance.draw("latencies.task_start_s", self.scenario.latencies.task_start_s),
            poll_phase_s=self.chance.phase("coordinator", settings.poll_period_s),
            limit_phase_s=self.chance.phase("limit", settings.limit_check_period_s),
            log=self.recorder.log,
        )

    # The managing subsystem.

    def _make_host(self) -> ManagerHost:
        name = self.manager_name
        settings = (self.scenario.managers.model_extra or {}).get(name)
        system = ManagedSystem(
            env=self.env,
            scenario=self.scenario,
            settings=settings if isinstance(settings, Mapping) else {},
            modes=self.modes,
            lasting_functions=self.coordinator.lasting_functions,
            stream=lambda stream: self.chance.stream(f"manager/{stream}"),
            log=lambda event, detail: self.recorder.log(name, event, detail),
            knowledge=lambda: self.simulator.knowledge,
            reasoned=self.recorder.reasoned,
            recorded=self.recorder.enabled,
            measurements=self.signals if self.battery is None else {**self.signals, self.battery.key: self.battery},
        )
        return ManagerHost(name, self.run, system, self.bus, may_rest=not self.recorder.enabled)
