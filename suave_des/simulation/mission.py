"""One mission: scenario, manager, run and seed, wired into a SimPy environment."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import simpy

from suave_des import domain
from suave_des.chance import Chance
from suave_des.clock import advance, stop_at
from suave_des.compiling import Array
from suave_des.errors import MissionError, SuaveDesError
from suave_des.managed.coordinator import MissionCoordinator, MissionTiming
from suave_des.managed.custom import CustomFunction, FunctionContext, function_that_raised
from suave_des.managed.detection import PipelineDetector
from suave_des.managed.follow import NO_PATH, FollowPipeline, InspectionPath
from suave_des.managed.mode_manager import ModeManager
from suave_des.managed.motion import MaintainMotion
from suave_des.managed.node import FunctionNode
from suave_des.managed.recharge import GenerateRechargePath
from suave_des.managed.search import GenerateSearchPath
from suave_des.managed.surface import Surface
from suave_des.managing.base import ManagedSystem, ManagingSubsystem
from suave_des.metrics.further import FurtherMetrics
from suave_des.metrics.reactions import ReactionMeter
from suave_des.metrics.recording import Recorder
from suave_des.metrics.result import MissionMetrics, MissionResult
from suave_des.monitor.diagnostics import Diagnostic, DiagnosticsBus, Kind
from suave_des.monitor.measurements import Measured
from suave_des.monitor.monitors import (
    battery_monitor,
    detection_monitor,
    leak_monitor,
    signal_monitor,
    state_monitor,
    thruster_monitor,
)
from suave_des.registry import manager_class
from suave_des.simulation.faults import ThrusterFaults, schedule
from suave_des.simulation.host import RAISED, ManagerHost
from suave_des.simulation.measuring import measure_battery, measure_signal, monitor_timing
from suave_des.simulation.prepared import PreparedScenario
from suave_des.simulation.vehicles import draw_start, make_vehicle
from suave_des.vehicle.guidance import SetPointSender


@dataclass(frozen=True, slots=True)
class RunSpec:
    """The mission of a scenario to run; see `Simulator.start`."""

    manager: str
    run: int
    seed: int
    record: bool
    manager_type: type[ManagingSubsystem] | None


class MissionRun:
    """The parts of one mission, made and connected.

    Args:
        prepared: the scenario.
        spec: the mission to run.
        track: to be filled with the vehicle's states.
    """

    def __init__(self, prepared: PreparedScenario, spec: RunSpec, track: Array) -> None:
        self._prepared, self._spec = prepared, spec
        self._manager_type = spec.manager_type or manager_class(spec.manager)
        self._scenario = scenario = prepared.loaded.scenario
        self._revision = scenario.revision
        self.track = track
        self._chance = chance = Chance(prepared.distributions, spec.seed, spec.run, prepared.runs_per_draw)
        self.env = simpy.Environment()
        self.bus = DiagnosticsBus()
        self._recorder = Recorder(self.env, enabled=spec.record)

        # The vehicle.
        self._start = draw_start(chance)
        self._vehicle = make_vehicle(prepared, chance, self._start, track, reasons=self._manager_type.needs_knowledge)
        self._faults = ThrusterFaults(scenario, chance, self._vehicle, self._recorder.log)

        # Measurements.
        described, tables = scenario.signals, prepared.loaded.tables
        self._true_signals = {name: chance.signal(name, described[name], tables) for name in sorted(described)}
        self._signals = {
            name: measure_signal(scenario, chance, name, signal, prepared.duration_s)
            for name, signal in self._true_signals.items()
        }
        self._battery = measure_battery(scenario, chance, self._vehicle)
        self._measured: dict[str, Measured] = {**self._signals}
        if self._battery is not None:
            self._measured[self._battery.key] = self._battery

        # The managed subsystem.
        self._detector = self._make_detector()
        self.modes = self._make_mode_manager(self._make_functions())
        self._coordinator = self._make_coordinator()

        # Metrics and record.
        self._reactions = self._make_reaction_meter()
        self._further = self._make_further_metrics()
        if spec.record:
            self._record_changes()

        # The managing subsystem.
        self._host = self._make_host()
        self._start_processes()

    @property
    def manager(self) -> ManagingSubsystem:
        """The managing subsystem."""
        return self._host.manager

    @property
    def system(self) -> ManagedSystem:
        """What the manager sees and can do."""
        return self._host.system

    @property
    def task(self) -> domain.Task | None:
        """The current task."""
        return self._coordinator.task

    @property
    def found_s(self) -> float | None:
        """Time at which the search ended, as the revision counts it; None before."""
        return self._coordinator.search_time_s

    @property
    def is_over(self) -> bool:
        """Whether the mission has ended."""
        return self._coordinator.ended.triggered

    def advance(self, until_s: float) -> None:
        """Advance to `until_s`, excluding events at that time, or to the mission's end.

        Raises:
            MissionError: the manager raised.
        """
        if until_s > self.env.now and not self.is_over:
            self._guarded(advance, self.env, until_s)

    def result(self) -> MissionResult:
        """Run to the end, and read the metrics."""
        if not self.is_over:
            self._guarded(self.env.run, self._coordinator.ended)
        recorder, drawn, metrics = self._recorder, self._chance.drawn, self.metrics()
        self._host.end(metrics)
        measured = {} if self._battery is None else {self._battery.key: self._battery}
        trajectory = recorder.trajectory(self._vehicle, self._signals[domain.WATER_VISIBILITY], measured)
        events, knowledge = tuple(recorder.events), tuple(recorder.knowledge)
        further = {} if self._further is None else self._further.columns(metrics)
        remarks = self._host.remarks
        return MissionResult(metrics, events, trajectory, knowledge, drawn, self.modes.refused, further, remarks)

    def metrics(self) -> MissionMetrics:
        """Compute the metrics, as of now if the mission is not over."""
        coordinator, detector = self._coordinator, self._detector
        found = coordinator.search_time_s is not None
        x_m, y_m = self._prepared.points[detector.first_point, :2].tolist() if found else (None, None)
        return MissionMetrics(
            scenario=self._scenario.name,
            manager=self._spec.manager,
            run=self._spec.run,
            seed=self._spec.seed,
            initial_x_m=self._start.position_m[0],
            initial_y_m=self._start.position_m[1],
            mission_duration_s=float(self.env.now),
            pipeline_found=found,
            search_time_s=coordinator.search_time_or_limit_s(),
            distance_inspected_m=coordinator.distance_inspected_m,
            mean_reaction_time_s=self._reactions.mean_s(),
            adaptations=self.modes.adaptations,
            detection_time_s=detector.detected_s if found else None,
            detection_x_m=x_m,
            detection_y_m=y_m,
        )

    def _guarded(self, run: Callable[..., object], *arguments: object) -> None:
        try:
            run(*arguments)
        except SuaveDesError:
            raise
        except RAISED as error:  # in a user-defined function, or in a process that the manager started by itself
            if (function := function_that_raised(error)) is not None:
                raise self._function_error(function.context.name, error) from error
            raise self._host.mission_error(error) from error

    def _function_error(self, name: str, error: BaseException) -> MissionError:
        cause = f"function {name}: {type(error).__name__}: {error}"
        return MissionError(self._spec.manager, self._spec.run, self.env.now, cause)

    # The parts.

    def _make_detector(self) -> PipelineDetector:
        prepared, visibility = self._prepared, self._signals[domain.WATER_VISIBILITY].arrays
        points, view_tangent, log = prepared.detection_points, prepared.view_tangent, self._recorder.log
        return PipelineDetector(self.env, self._vehicle, visibility, points, view_tangent, log)

    def _make_mode_manager(self, nodes: Mapping[str, FunctionNode]) -> ModeManager:
        latency_s = self._chance.sampler("latencies.mode_change_s", self._scenario.latencies.mode_change_s)
        return ModeManager(self.env, self._prepared.loaded.modes, nodes, latency_s, self._recorder.log)

    def _make_functions(self) -> dict[str, FunctionNode]:
        env, revision, chance = self.env, self._revision, self._chance
        loss_probability = chance.value("revision.set_points.loss_probability")
        follow, search, recharge = domain.FOLLOW_PIPELINE, domain.GENERATE_SEARCH_PATH, domain.GENERATE_RECHARGE_PATH
        make_sender = partial(self._make_sender, loss_probability)
        phase_s = chance.phase(search, revision.spiral.tick_period_s)
        latency_s, view_tangent = chance.value("latencies.search_start_s"), self._prepared.view_tangent
        recovery_s = chance.sampler("revision.recovery.delay_s", revision.recovery.delay_s)
        self._follow = FollowPipeline(env, make_sender(follow), revision.follow, self._path)
        nodes: dict[str, FunctionNode] = {
            domain.MAINTAIN_MOTION: MaintainMotion(
                env, self.bus, revision.recovery, self._faults.set_health, recovery_s, self._faults.unrecoverable
            ),
            search: GenerateSearchPath(
                env, make_sender(search), revision.spiral, self._start.origin_m, view_tangent, phase_s, latency_s
            ),
            follow: self._follow,
        }
        if (battery := self._scenario.battery) is not None:
            station_m = battery.station_x_m, battery.station_y_m, domain.SEA_BED_Z_M + battery.approach_altitude_m
            nodes[recharge] = GenerateRechargePath(env, make_sender(recharge), station_m, battery.resend_period_s)
        if self._scenario.leak is not None:
            self._surface = Surface(env, make_sender(domain.SURFACE))
            nodes[domain.SURFACE] = self._surface
        for name, function_type in self._prepared.custom_functions.items():
            nodes[name] = self._make_custom_function(function_type, self._function_context(name, make_sender(name)))
        return nodes

    def _make_custom_function(self, function_type: type[CustomFunction], context: FunctionContext) -> CustomFunction:
        try:
            node = function_type(context)
            if not hasattr(node, "context"):
                raise TypeError(f"{function_type.__name__}.__init__ does not begin with super().__init__(context)")
        except RAISED as error:
            raise self._function_error(context.name, error) from error
        return node

    def _function_context(self, name: str, sender: SetPointSender) -> FunctionContext:
        settings = self._scenario.functions.get(name)
        return FunctionContext(
            name=name,
            env=self.env,
            settings=(settings.model_extra or {}) if settings is not None else {},
            sender=sender,
            bus=self.bus,
            stream=lambda stream: self._chance.stream(f"functions/{name}/{stream}"),
            log=partial(self._recorder.log, name),
        )

    def _make_sender(self, loss_probability: float, node: str) -> SetPointSender:
        value, offset = self._chance.value, "revision.set_points.node_frame_offset_"
        frame_error_m = value(f"{offset}x_m", node), value(f"{offset}y_m", node), value(f"{offset}z_m", node)
        stream = self._chance.stream(f"set_points/{node}") if loss_probability else None
        return SetPointSender(self._vehicle, lambda: self.env.now, frame_error_m, loss_probability, stream)

    def _path(self) -> InspectionPath:
        first = self._detector.first_point
        return NO_PATH if first is None else self._prepared.path.from_point(first)

    def _make_coordinator(self) -> MissionCoordinator:
        settings, phase = self._revision.coordinator, self._chance.phase
        timing = MissionTiming(
            time_limit_s=self._scenario.mission.time_limit_s,
            start_delay_s=self._chance.value("latencies.task_start_s"),
            poll_phase_s=phase("coordinator", settings.poll_period_s),
            limit_phase_s=phase("limit", settings.limit_check_period_s),
        )
        functions = self._scenario.mission.functions
        coordinator = MissionCoordinator(
            self.env, settings, timing, functions, self._detector, self._follow, self._recorder.log
        )
        battery = self._scenario.battery
        if self._battery is not None and battery is not None and battery.mission_ends_at_level is not None:
            coordinator.end_at_battery_level(self._battery, battery.mission_ends_at_level)
        if self._scenario.leak is not None:
            leak = coordinator.leak_handler(self._surface.surfaced)
            self.env.process(leak_monitor(self.env, self.bus, self._chance.value("leak.time_s"), leak))
        return coordinator

    def _make_reaction_meter(self) -> ReactionMeter:
        settings, altitude_m = self._scenario.reaction_metric, self._revision.spiral.initial_altitude_m
        meter = ReactionMeter(self.env, settings, self._signals[domain.WATER_VISIBILITY], altitude_m, self._battery)
        self.bus.subscribe(meter.diagnostic, (Kind.COMPONENT_STATUS,))
        self.modes.listeners.append(meter.mode_effect)
        return meter

    def _make_further_metrics(self) -> FurtherMetrics | None:
        if not self._scenario.further_columns:
            return None
        further = FurtherMetrics(self.env, self._scenario, self._vehicle, self._measured, self._battery)
        self._faults.listeners.append(further.thrusters_changed)
        self.modes.listeners.append(further.mode_effect)
        self.modes.adaptation_listeners.append(further.adapted)
        if self._scenario.leak is not None:
            self.env.process(further.watch_surfacing(self._surface.surfaced, self._chance.value("leak.time_s")))
        return further

    def _record_changes(self) -> None:
        metric = self._scenario.reaction_metric
        self.bus.subscribe(self._recorder.diagnostic_of(metric.visibility_thresholds_m, metric.battery_limit))
        self.modes.listeners.append(self._recorder.mode_effect)

    def _make_host(self) -> ManagerHost:
        spec, name = self._spec, self._spec.manager
        system = ManagedSystem(
            env=self.env,
            scenario=self._scenario,
            settings=self._prepared.loaded.manager_settings(name),
            modes=self.modes,
            lasting_functions=self._coordinator.lasting_functions,
            stream=lambda stream: self._chance.stream(f"manager/{stream}"),
            log=partial(self._recorder.log, name),
            knowledge=lambda: self._prepared.knowledge,
            record_state=self._recorder.record_state,
            state_changed=lambda: self._host.state_changed(),
            measurements=self._measured,
            record_reasoning_time=(lambda duration_s: None) if self._further is None else self._further.reasoning_took,
            recorded=spec.record,
            pose=lambda: self._vehicle.pose(self.env.now),
            distance_inspected_m=lambda: self._follow.distance_m,
            true_signal=self._true_signals.__getitem__,
            files={} if spec.manager_type else self._prepared.manager_files(name),
            learned=self._prepared.learned(name),
            training=self._prepared.training is not None,
        )
        return ManagerHost(name, self._manager_type, spec.run, system, self.bus, skips_idle_calls=not spec.record)

    # The start.

    def _start_processes(self) -> None:
        """Start the coordinator, the monitors and the manager."""
        self._coordinator.start(self._host.request, self._host.cancel)
        self._start_monitors()
        stop_at(self._coordinator.ended)
        self._host.start()

    def _start_monitors(self) -> None:
        if self.bus.has_subscribers(Kind.QA_STATUS):  # for lookups, the measurements are enough
            for measurements in self._signals.values():
                self.env.process(signal_monitor(self.env, self.bus, measurements))
            if self._battery is not None:
                self.env.process(battery_monitor(self.env, self.bus, self._battery))
        for kind, key, state in (
            (Kind.POSE, "pose", lambda: self._vehicle.pose(self.env.now)),
            (Kind.DISTANCE, "distance_inspected_m", lambda: self._follow.distance_m),
        ):
            if self.bus.has_subscribers(kind):
                self.env.process(state_monitor(self.env, self.bus, kind, key, state))
        if self.bus.has_subscribers(Kind.DETECTION):
            self.env.process(detection_monitor(self.env, self.bus, self._detector.detected))
        self._start_thruster_monitor()

    def _start_thruster_monitor(self) -> None:
        monitors, lost = self._revision.monitors, self._chance.loss("thruster_monitor", self._scenario.thruster_monitor)
        timing = monitor_timing(self._scenario, self._chance, "thruster_monitor", monitors.thruster_check_period_s)
        events = schedule(self._scenario, self._chance)
        after_previous = monitors.thruster_event_times == "after_previous"

        def publish(diagnostic: Diagnostic) -> None:
            if lost is None or not lost(diagnostic.time_s):
                self.bus.publish(diagnostic)

        self.env.process(thruster_monitor(self.env, publish, events, self._faults.apply, timing, after_previous))
