"""Makes the parts of one mission, and connects them: each step takes what the steps before have
made.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np
import simpy

from suave_des import domain
from suave_des.clock import MissionEnvironment, stop_at
from suave_des.domain import WATER_VISIBILITY
from suave_des.draws import Draws
from suave_des.errors import MissionError, SuaveDesError
from suave_des.events import Said
from suave_des.managed.coordinator import MissionCoordinator
from suave_des.managed.destinations import GenerateRechargePath, Surface
from suave_des.managed.detection import PipelineDetector
from suave_des.managed.flight import Flight
from suave_des.managed.follow import FollowPipeline
from suave_des.managed.mode_manager import ModeManager
from suave_des.managed.motion import MaintainMotion
from suave_des.managed.node import FunctionContext, FunctionNode, SetPointSender
from suave_des.managed.search import GenerateSearchPath
from suave_des.managing.base import ManagingSubsystem, System
from suave_des.metrics.further import FurtherMetrics
from suave_des.metrics.reactions import ReactionMeter
from suave_des.metrics.recording import Recorder
from suave_des.monitor.diagnostics import DiagnosticsBus, Kind
from suave_des.monitor.measurements import BatteryMeasurements, Measurements, Timing, message_loss
from suave_des.monitor.monitors import (
    leak_monitor,
    measure_battery,
    measure_signals,
    start_monitors,
)
from suave_des.monitor.thrusters import (
    Thrusters,
    draw_schedule,
    failure_loss,
    thruster_monitor,
)
from suave_des.scenario.models import Scenario
from suave_des.simulation.calls import RAISED
from suave_des.simulation.host import ManagerHost
from suave_des.simulation.prepared import PreparedScenario, draw_start
from suave_des.tracebacks import cause_of
from suave_des.vehicle.model import Pose
from suave_des.vehicle.vehicle import Point, Vehicle


@dataclass(frozen=True)
class Order:
    """Which mission is wanted.

    Attributes:
        manager: the manager's name in the metrics.
        manager_type: its class.
        is_callers: whether the caller is the managing subsystem.
    """

    prepared: PreparedScenario
    manager: str
    manager_type: type[ManagingSubsystem]
    is_callers: bool
    run: int
    seed: int
    record: bool

    @property
    def scenario(self) -> Scenario:
        """The mission's scenario."""
        return self.prepared.loaded.scenario


class Surroundings(NamedTuple):
    """The clock, what is random, the vehicle, and what is measured."""

    env: MissionEnvironment
    bus: DiagnosticsBus
    draws: Draws
    recorder: Recorder
    start_m: tuple[float, float]
    origin_m: tuple[float, float]
    vehicle: Vehicle
    thrusters: Thrusters
    battery: BatteryMeasurements | None
    measurements: Mapping[str, Measurements]
    error_of: Callable[..., SuaveDesError]

    @property
    def visibility(self) -> Measurements:
        """The measured water visibility."""
        return self.measurements[WATER_VISIBILITY]


class Managed(NamedTuple):
    """The managed subsystem."""

    flight: Flight
    detector: PipelineDetector
    follow: FollowPipeline
    surface: Surface | None
    mode_manager: ModeManager
    coordinator: MissionCoordinator


class Observers(NamedTuple):
    """What metrics are made of; `components` has the last reported status of each component."""

    reactions: ReactionMeter
    further: FurtherMetrics
    components: dict[str, str]


class Parts(NamedTuple):
    """The parts of one mission."""

    surroundings: Surroundings
    managed: Managed
    observers: Observers
    host: ManagerHost


def assemble(order: Order) -> Parts:
    """Make the parts of a mission, and start it at t = 0.

    Raises:
        InputError: something in the scenario, or the manager, cannot be used.
        MissionError: the manager, or a user-defined function, raised.
    """
    surroundings = _make_surroundings(order)
    managed = _make_managed(order, surroundings)
    observers = _make_observers(order, surroundings, managed)
    host = _make_host(order, surroundings, managed)
    parts = Parts(surroundings, managed, observers, host)
    _start(order, parts)
    return parts


def _make_surroundings(order: Order) -> Surroundings:
    prepared, scenario, env = order.prepared, order.scenario, MissionEnvironment()
    draws = Draws(scenario, order.seed, order.run, prepared.runs_per_draw, prepared.numbers)
    recorder = Recorder(env, order.record, scenario.reaction_metric)
    start_m, origin_m = draw_start(draws)
    reasons = order.manager_type.needs_knowledge
    vehicle = prepared.make_vehicle(draws, start_m, prepared.take_track(), reasons)
    failures = scenario.revision.thruster_failures
    thrusters = Thrusters(env, vehicle, failures, recorder.log, failure_loss(failures, draws))
    battery = measure_battery(scenario, draws, prepared.duration_s)
    measured: list[Measurements] = [
        *measure_signals(prepared.loaded, draws, prepared.duration_s),
        *filter(None, [battery]),
    ]

    def error_of(error: BaseException, function: str = "") -> SuaveDesError:
        """Convert an exception in a user's code into the error that ends the mission."""
        if isinstance(error, MissionError):
            return error
        cause = str(error) if isinstance(error, SuaveDesError) else cause_of(error, function)
        return MissionError(order.manager, order.run, env.now, cause)

    return Surroundings(
        env=env,
        bus=DiagnosticsBus(),
        draws=draws,
        recorder=recorder,
        start_m=start_m,
        origin_m=origin_m,
        vehicle=vehicle,
        thrusters=thrusters,
        battery=battery,
        measurements={each.key: each for each in measured},
        error_of=error_of,
    )


# The managed subsystem.


def _make_managed(order: Order, around: Surroundings) -> Managed:
    prepared, scenario, env, draws = order.prepared, order.scenario, around.env, around.draws
    log, revision = around.recorder.log, scenario.revision
    detector = PipelineDetector(env, log)
    visibility, points = np.array(around.visibility.arrays), prepared.detected_points
    flight = Flight(around.vehicle, prepared.camera, points, visibility, prepared.path)
    env.fly_to = flight.fly_to
    latency_s = draws.each_time("latencies.mode_change_s", scenario.latencies.mode_change_s)
    make_sender = _sender_maker(order, around)
    recovery_s = draws.each_time("revision.recovery.delay_s", revision.recovery.delay_s)
    search = GenerateSearchPath(
        env,
        make_sender(domain.GENERATE_SEARCH_PATH),
        flight.state.search,
        revision.spiral,
        around.origin_m,
        prepared.view_tangent,
        draws.phase(domain.GENERATE_SEARCH_PATH, revision.spiral.tick_period_s),
        draws.value("latencies.search_start_s"),
    )
    sender = make_sender(domain.FOLLOW_PIPELINE)
    state, path = flight.state.follow, prepared.path
    follow = FollowPipeline(env, sender, state, revision.follow, path, detector)
    flight.begin(detector, search, follow)
    nodes: dict[str, FunctionNode] = {
        domain.MAINTAIN_MOTION: MaintainMotion(
            env, around.bus, revision.recovery, around.thrusters, recovery_s
        ),
        domain.GENERATE_SEARCH_PATH: search,
        domain.FOLLOW_PIPELINE: follow,
    }
    if around.battery is not None and (station := scenario.battery) is not None:
        recharge = domain.GENERATE_RECHARGE_PATH
        phase_s = draws.phase(recharge, station.docking_check_period_s)
        nodes[recharge] = GenerateRechargePath(
            env, make_sender(recharge), station, around.battery, phase_s
        )
    surface = None if scenario.leak is None else Surface(env, make_sender(domain.SURFACE))
    if surface is not None:
        nodes[domain.SURFACE] = surface
    nodes |= _make_custom_functions(order, around, make_sender)
    mode_manager = ModeManager(env, prepared.loaded.modes, nodes, latency_s, log)
    coordinator = _make_coordinator(order, around, detector, follow, surface)
    return Managed(flight, detector, follow, surface, mode_manager, coordinator)


def _sender_maker(order: Order, around: Surroundings) -> Callable[[str], SetPointSender]:
    """Make the function that makes a function's connection to the autopilot."""
    draws = around.draws
    loss_probability = draws.value("revision.set_points.loss_probability")

    def make(function: str) -> SetPointSender:
        x, y, z = _frame_offset_keys(function)
        offset_m: Point = (draws.value(x), draws.value(y), draws.value(z))
        stream = draws.stream(f"set_points/{function}") if loss_probability else None
        return SetPointSender(around.vehicle, around.env, offset_m, loss_probability, stream)

    return make


@lru_cache(maxsize=64)
def _frame_offset_keys(function: str) -> list[str]:
    """Key paths of how far off a function's frame is in x, y and z."""
    return [f"revision.set_points.node_frame_offset_{axis}_m/{function}" for axis in "xyz"]


def _make_custom_functions(
    order: Order, around: Surroundings, make_sender: Callable[[str], SetPointSender]
) -> dict[str, FunctionNode]:
    """Make the nodes of the functions that the scenario names."""

    def stream(function: str, name: str) -> random.Random:
        return around.draws.stream(f"functions/{function}/{name}")

    def log(function: str, event: str, detail: str) -> None:
        around.recorder.log(function, Said(event, detail))

    nodes: dict[str, FunctionNode] = {}
    for name, kind in order.prepared.custom_functions.items():
        settings = order.scenario.functions.get(name)
        context = FunctionContext(
            name=name,
            env=around.env,
            settings=deepcopy(settings.model_extra or {}) if settings is not None else {},
            sender=make_sender(name),
            bus=around.bus,
            stream=partial(stream, name),
            log=partial(log, name),
        )
        try:
            nodes[name] = node = kind(context)
            if not hasattr(node, "context"):
                raise TypeError(
                    f"{kind.__name__}.__init__ does not begin with super().__init__(context)"
                )
        except RAISED as error:
            raise around.error_of(error, name) from error
    return nodes


def _make_coordinator(
    order: Order,
    around: Surroundings,
    detector: PipelineDetector,
    follow: FollowPipeline,
    surface: Surface | None,
) -> MissionCoordinator:
    env, scenario, draws = around.env, order.scenario, around.draws
    surfaced: simpy.Event | None = None if surface is None else surface.surfaced
    coordinator = MissionCoordinator(
        env, scenario, draws, detector, follow, around.recorder.log, surfaced
    )
    level = None if scenario.battery is None else scenario.battery.mission_ends_at_level
    if around.battery is not None and level is not None:
        env.process(coordinator.watch_battery(around.battery, level))
    if scenario.leak is not None:
        leak_s = draws.value("leak.time_s")
        env.process(leak_monitor(env, around.bus, leak_s, coordinator.give_up))
    return coordinator


# What is observed of it.


def _make_observers(order: Order, around: Surroundings, managed: Managed) -> Observers:
    """Have metrics and record told what they are made of.

    They are told of a report before the manager is, as they subscribe first: what the manager does
    about it at the same time is an answer to it.
    """
    env, scenario, bus, modes = around.env, order.scenario, around.bus, managed.mode_manager
    altitude_m = scenario.revision.spiral.initial_altitude_m
    reactions = ReactionMeter(
        env, scenario.reaction_metric, around.visibility, altitude_m, around.battery
    )
    further = FurtherMetrics(env, scenario, around.thrusters, around.measurements)
    components: dict[str, str] = {}
    bus.subscribe(
        lambda report: components.update({report.key: str(report.value)}),
        (Kind.COMPONENT_STATUS,),
    )
    bus.subscribe(reactions.diagnostic, (Kind.COMPONENT_STATUS,))
    modes.listeners.append(reactions.mode_effect)
    if scenario.further_columns:
        modes.listeners.append(further.mode_effect)
        modes.adaptation_listeners.append(further.adapted)
    if around.recorder.enabled:
        bus.subscribe(around.recorder.diagnostic)
        modes.listeners.append(around.recorder.mode_effect)
    return Observers(reactions, further, components)


# The managing subsystem.


def _make_host(order: Order, around: Surroundings, managed: Managed) -> ManagerHost:
    prepared, name = order.prepared, order.manager
    files, learned = ({}, {}) if order.is_callers else prepared.manager_inputs(name)
    system = System(
        env=around.env,
        modes=managed.mode_manager,
        measurements=around.measurements,
        scenario=order.scenario,
        settings=deepcopy(prepared.loaded.manager_settings(name)),
        recorded=order.record,
        _manager=name,
        _coordinator=managed.coordinator,
        _vehicle=around.vehicle,
        _draws=around.draws,
        _recorder=around.recorder,
        _files=files,
        _open_knowledge=lambda: prepared.knowledge,
    )
    training = prepared.training is not None
    host = ManagerHost(order.manager_type, system, around.bus, around.error_of, learned, training)
    if around.battery is not None:
        recharge = domain.GENERATE_RECHARGE_PATH
        around.battery.may_be_recharged = partial(managed.mode_manager.may_be_active, recharge)
        around.battery.listeners.append(host.state_changed)
        managed.mode_manager.listeners.append(lambda *_: host.state_changed())
    return host


def _start(order: Order, parts: Parts) -> None:
    """Start the coordinator, the monitors and the manager."""
    (around, managed, _, host), scenario = parts, order.scenario
    env, draws, vehicle, follow = around.env, around.draws, around.vehicle, managed.follow
    monitors = scenario.revision.monitors
    managed.coordinator.start(host.request, host.cancel)
    states: dict[tuple[Kind, str], Callable[[], Pose | float]] = {
        (Kind.POSE, "pose"): lambda: vehicle.pose(env.now),
        (Kind.DISTANCE, "distance_inspected_m"): lambda: follow.distance_m,
    }
    measurements, detected = around.measurements.values(), managed.detector.detected
    start_monitors(env, around.bus, measurements, states, detected)
    env.process(
        thruster_monitor(
            around.thrusters,
            around.bus,
            draw_schedule(scenario, draws),
            Timing.of(scenario, draws, "thruster_monitor", monitors.thruster_check_period_s),
            monitors.thruster_event_times == "after_previous",
            message_loss("thruster_monitor", scenario.thruster_monitor, draws),
        )
    )
    stop_at(managed.coordinator.ended)
    host.start()
