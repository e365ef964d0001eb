"""One mission: vehicle, monitors, managed and managing subsystem, wired into a SimPy environment
and advanced in it.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Collection, Mapping
from copy import deepcopy
from functools import partial
from math import inf, isnan
from pathlib import Path
from typing import ClassVar, Unpack

import numpy as np

from suave_des import domain
from suave_des.arguments import check_names
from suave_des.clock import MissionEnvironment, drop_events, stop_at
from suave_des.compiling import Array
from suave_des.domain import WATER_VISIBILITY, Task
from suave_des.draws import Draws
from suave_des.errors import InputError, MissionError, MissionTimeOut, SuaveDesError, shown
from suave_des.managed.coordinator import MissionCoordinator
from suave_des.managed.destinations import GenerateRechargePath, Surface
from suave_des.managed.detection import PipelineDetector
from suave_des.managed.flight import Flight
from suave_des.managed.follow import FollowPipeline
from suave_des.managed.mode_manager import ModeManager
from suave_des.managed.motion import MaintainMotion
from suave_des.managed.node import FunctionContext, FunctionNode, SetPointSender
from suave_des.managed.search import GenerateSearchPath
from suave_des.managing.base import System
from suave_des.managing.simple import NoManager
from suave_des.metrics.further import FurtherMetrics
from suave_des.metrics.reactions import ReactionMeter
from suave_des.metrics.recording import Recorder
from suave_des.metrics.result import MissionMetrics, MissionResult
from suave_des.monitor.diagnostics import DiagnosticsBus, Kind
from suave_des.monitor.measurements import Measurements, Timing, message_loss
from suave_des.monitor.monitors import (
    leak_monitor,
    measure_battery,
    measure_signals,
    start_monitors,
)
from suave_des.monitor.thrusters import Thrusters, draw_schedule, thruster_monitor
from suave_des.registry import ManagerLike, cause_of, is_built_in, manager_class, name_of
from suave_des.resources import DEFAULT_SCENARIO
from suave_des.scenario.loader import Replacements, load_scenario
from suave_des.simulation.host import RAISED, ManagerHost
from suave_des.simulation.prepared import PreparedScenario, draw_start
from suave_des.vehicle.kernel import POSITION
from suave_des.vehicle.model import Pose
from suave_des.vehicle.vehicle import row_at

CALLER = "caller"
"""Name, in the metrics, of a managing subsystem that is the program which advances the mission."""


class CallerManages(NoManager):
    """Leaves adaptation to the caller; a task begins with the default modes of its functions."""

    subscribes_to: ClassVar[Collection[Kind]] = ()


class Mission:
    """One mission, advanced step by step, or at once by `result`.

    Without a manager the caller is the managing subsystem: each task begins with the default modes
    of its functions, and everything after that is up to `change_mode`. Missions that are advanced
    in other steps are the same missions: only what is requested, and when, makes a difference.

    Example:
        >>> mission = Mission("seams2023", run=1, seed=8)
        >>> while not mission.is_over:
        ...     mission.advance(mission.now_s + 2.0)
        ...     if mission.searches and mission.measured("water_visibility", 0.0) >= 3.25:
        ...         mission.change_mode("f_generate_search_path", "fd_spiral_high")
        >>> mission.metrics().search_time_s
        61.0

    Args:
        scenario: path of a scenario file, name of a shipped one, or a Simulator of a loaded one,
            which saves loading it for each of many missions.
        manager: name of a managing subsystem, module:Class, or a class, which the caller then
            watches; None: the caller.
        run: number of the run in a campaign with this seed.
        seed: of everything that is random.
        record: whether events and trajectory are kept, for `result`.
        replacements: as of `load_scenario`, unless the scenario is a Simulator.

    Attributes:
        env: the mission's clock.
        bus: the diagnostics.
        mode_manager: takes requests for modes.
        manager: the managing subsystem.
        components: the last reported statuses of components, FALSE or RECOVERED.

    Raises:
        InputError: something given cannot be used.
        MissionError: the manager raised.
    """

    def __init__(
        self,
        scenario: str | Path | PreparedScenario = DEFAULT_SCENARIO,
        manager: ManagerLike | None = None,
        *,
        run: int = 1,
        seed: int = 1,
        record: bool = False,
        **replacements: Unpack[Replacements],
    ) -> None:
        for name, number in (("run", run), ("seed", seed)):
            if isinstance(number, bool) or not isinstance(number, int) or number < 0:
                raise InputError(
                    f"{name}: {shown(number)} is not a number of a {name}",
                    remedy="give a whole number",
                )
        if replacements:
            own = "scenario", "manager", "run", "seed", "record"
            check_names("Mission", replacements, (*own, *Replacements.__annotations__))
        if not isinstance(scenario, PreparedScenario):
            scenario = PreparedScenario(load_scenario(scenario, **replacements))
        self._prepared = prepared = scenario
        self._scenario = described = prepared.loaded.scenario
        self._manager_name = CALLER if manager is None else name_of(manager)
        manager_type = CallerManages if manager is None else manager_class(self._manager_name)
        self._run, self._seed = run, seed
        self._result: MissionResult | None = None
        revision, loaded = described.revision, prepared.loaded
        self.env = env = MissionEnvironment()
        self.bus = DiagnosticsBus()
        self._draws = draws = Draws(described, seed, run, prepared.runs_per_draw, prepared.numbers)
        self._recorder = recorder = Recorder(env, record, described.reaction_metric)

        # The vehicle, and what is measured.
        self._start_m, self._origin_m = draw_start(draws)
        self._track = prepared.take_track()
        self._vehicle = prepared.make_vehicle(
            draws, self._start_m, self._track, manager_type.needs_knowledge
        )
        self._thrusters = Thrusters(env, self._vehicle, revision.thruster_failures, recorder.log)
        self._battery = measure_battery(described, draws, prepared.duration_s)
        measured = [
            *measure_signals(loaded, draws, prepared.duration_s),
            *filter(None, [self._battery]),
        ]
        self._measurements: Mapping[str, Measurements] = {each.key: each for each in measured}
        self._visibility = self._measurements[WATER_VISIBILITY]

        # The managed subsystem.
        self._detector = PipelineDetector(env, recorder.log)
        self._flight = Flight(
            self._vehicle,
            prepared.camera,
            prepared.detected_points,
            np.array(self._visibility.arrays),
            prepared.path,
        )
        env.fly_to = self._flight.fly_to
        mode_latency_s = draws.each_time(
            "latencies.mode_change_s", described.latencies.mode_change_s
        )
        self.mode_manager = ModeManager(
            env, loaded.modes, self._make_nodes(), mode_latency_s, recorder.log
        )
        self._coordinator = self._make_coordinator()

        # What is observed of it.
        rules, start_m = described.reaction_metric, revision.spiral.initial_altitude_m
        self._reactions = ReactionMeter(env, rules, self._visibility, start_m, self._battery)
        self._further = FurtherMetrics(env, described, self._thrusters, self._measurements)
        self._observe()

        # The managing subsystem.
        files, learned = (
            ({}, {}) if manager is None else prepared.manager_inputs(self._manager_name)
        )
        system = System(
            env=env,
            modes=self.mode_manager,
            measurements=self._measurements,
            scenario=described,
            settings=deepcopy(loaded.manager_settings(self._manager_name)),
            recorded=record,
            _manager=self._manager_name,
            _coordinator=self._coordinator,
            _vehicle=self._vehicle,
            _draws=draws,
            _recorder=recorder,
            _files=files,
            _open_knowledge=lambda: prepared.knowledge,
        )
        self._host = ManagerHost(
            manager_type, system, self.bus, self._error_of, learned, prepared.training is not None
        )
        self.manager = self._host.manager
        if self._battery is not None:
            self._battery.listeners.append(self._host.state_changed)
        self._start_processes()

    # Advancing.

    def advance(self, until: float | None = None) -> None:
        """Advance mission time.

        Args:
            until: mission time in s, which comes before whatever happens at that very time; None:
                the mission's end, beyond which it does not go in any case.

        Raises:
            InputError: that time has already passed.
            MissionError: the manager raised.
        """
        until_s = inf if until is None else float(until)
        if isnan(until_s) or until_s < self.env.now:
            problem = f"the mission cannot go to {until_s:g} s: it is at {self.now_s:g} s"
            raise InputError(problem, remedy="give a later mission time")
        if until_s == inf:
            self.result()
        elif until_s > self.env.now and not self.is_over:
            self._guarded(self.env.advance, until_s)

    def change_mode(self, function: str, mode: str) -> None:
        """Request a mode of a function, which takes effect after the scenario's latency.

        Raises:
            InputError: there is no such function or mode, or the mission has a manager.
        """
        if self._manager_name != CALLER:
            raise InputError(
                "the mission has a manager, which changes modes", remedy="leave the manager out"
            )
        if not self.mode_manager.change_mode(function, mode):
            self.check_mode(function, mode)

    def check_mode(self, function: str, mode: str) -> None:
        """Check that a mode can be requested.

        Raises:
            InputError: there is no such function or mode.
        """
        if mode not in self.mode_manager.available_modes(function):
            raise self.mode_manager.refusal(function, mode)

    def result(self) -> MissionResult:
        """Run to the end, and return the metrics with the record, if one was kept."""
        if self._result is None:
            if not self.is_over:
                self._guarded(self.env.run, self._coordinator.ended)
            self._result = self._make_result()
        return self._result

    def close(self) -> None:
        """Give the mission's memory back to its Simulator, for the next mission; this one cannot
        continue.
        """
        if vars(self.bus):  # not closed yet
            self._prepared.give_back(self._track)
        drop_events(self.env)
        for part in (self._vehicle, self._flight, self._detector, self._host, self.bus):
            vars(
                part
            ).clear()  # what refers to each other is freed at once then, which saves 5% of a mission's time

    # What can be seen.

    @property
    def now_s(self) -> float:
        """Mission time."""
        return float(self.env.now)

    @property
    def is_over(self) -> bool:
        """Whether the mission has ended."""
        return self._coordinator.ended.triggered

    @property
    def task(self) -> Task | None:
        """The current task, with the functions that it needs."""
        return self._coordinator.task

    @property
    def searches(self) -> bool:
        """Whether the pipeline is searched for."""
        return self.task is not None and self.task.name == "search_pipeline"

    @property
    def found_s(self) -> float | None:
        """Time at which the search ended, as the revision counts it; None before."""
        return self._coordinator.search_time_s

    @property
    def functions(self) -> tuple[str, ...]:
        """The functions that are currently needed: those of the whole mission, and those of the
        task.
        """
        return self._coordinator.functions

    @property
    def modes(self) -> Mapping[str, tuple[str, ...]]:
        """The modes of each function that can be requested."""
        return {
            function: self.mode_manager.available_modes(function)
            for function in self.mode_manager.nodes
        }

    def current_mode(self, function: str) -> str | None:
        """Return the last requested mode of a function; None before the first request."""
        return self.mode_manager.current_mode(function)

    def measured(self, attribute: str, default: float | None = None) -> float | None:
        """Return the last published value of a quality attribute; `default` before the first."""
        measurements = self._measurements.get(attribute)
        value = None if measurements is None else measurements.value(self.env.now)
        return default if value is None else value

    @property
    def pose(self) -> Pose:
        """The vehicle's pose."""
        return self._vehicle.pose(self.env.now)

    def way_m(self) -> Array:
        """Return the vehicle's positions so far, one each 0.05 s: x, y and z, shape (n, 3)."""
        self._vehicle.position(self.env.now)
        return self._vehicle.track[: row_at(self.env.now) + 1, POSITION].copy()

    @property
    def distance_inspected_m(self) -> float:
        """The last published distance inspected."""
        return self._coordinator.distance_inspected_m

    def metrics(self) -> MissionMetrics:
        """Compute the metrics, a row of runs.csv; as of now while the mission is not over."""
        coordinator, detector = self._coordinator, self._detector
        found = coordinator.search_time_s is not None
        x_m, y_m = (
            self._prepared.points[detector.first_point, :2].tolist() if found else (None, None)
        )
        return MissionMetrics(
            scenario=self._scenario.name,
            manager=self._manager_name,
            run=self._run,
            seed=self._seed,
            initial_x_m=self._start_m[0],
            initial_y_m=self._start_m[1],
            mission_duration_s=float(self.env.now),
            pipeline_found=found,
            search_time_s=coordinator.search_time_or_limit_s,
            distance_inspected_m=coordinator.distance_inspected_m,
            mean_reaction_time_s=self._reactions.mean_s(),
            adaptations=self.mode_manager.adaptations,
            detection_time_s=detector.detected_s if found else None,
            detection_x_m=x_m,
            detection_y_m=y_m,
        )

    # The parts.

    def _make_nodes(self) -> dict[str, FunctionNode]:
        """Make the functions' nodes: those of the exemplar, and those that the scenario names."""
        env, described, draws = self.env, self._scenario, self._draws
        revision, loss_probability = (
            described.revision,
            draws.value("revision.set_points.loss_probability"),
        )

        def sender(function: str) -> SetPointSender:
            keys = [f"revision.set_points.node_frame_offset_{axis}_m/{function}" for axis in "xyz"]
            x_m, y_m, z_m = map(draws.value, keys)
            stream = draws.stream(f"set_points/{function}") if loss_probability else None
            return SetPointSender(self._vehicle, env, (x_m, y_m, z_m), loss_probability, stream)

        def stream(function: str, name: str) -> random.Random:
            return draws.stream(f"functions/{function}/{name}")

        recovery_s = draws.each_time("revision.recovery.delay_s", revision.recovery.delay_s)
        search = GenerateSearchPath(
            env,
            sender(domain.GENERATE_SEARCH_PATH),
            self._flight,
            revision.spiral,
            self._origin_m,
            self._prepared.view_tangent,
            draws.phase(domain.GENERATE_SEARCH_PATH, revision.spiral.tick_period_s),
            draws.value("latencies.search_start_s"),
        )
        follow = FollowPipeline(
            env, sender(domain.FOLLOW_PIPELINE), self._flight, revision.follow, self._detector
        )
        self._follow = follow
        self._flight.begin(self._detector, search, follow)
        nodes: dict[str, FunctionNode] = {
            domain.MAINTAIN_MOTION: MaintainMotion(
                env, self.bus, revision.recovery, self._thrusters, recovery_s
            ),
            domain.GENERATE_SEARCH_PATH: search,
            domain.FOLLOW_PIPELINE: follow,
        }
        if self._battery is not None and (station := described.battery) is not None:
            recharge = domain.GENERATE_RECHARGE_PATH
            phase_s = draws.phase(recharge, station.docking_check_period_s)
            nodes[recharge] = GenerateRechargePath(
                env, sender(recharge), station, self._battery, phase_s
            )
        self._surface = None if described.leak is None else Surface(env, sender(domain.SURFACE))
        if self._surface is not None:
            nodes[domain.SURFACE] = self._surface
        for name, kind in self._prepared.custom_functions.items():
            settings = described.functions.get(name)
            context = FunctionContext(
                name=name,
                env=env,
                settings=deepcopy(settings.model_extra or {}) if settings is not None else {},
                sender=sender(name),
                bus=self.bus,
                stream=partial(stream, name),
                log=partial(self._recorder.log, name),
            )
            try:
                nodes[name] = node = kind(context)
                if not hasattr(node, "context"):
                    raise TypeError(
                        f"{kind.__name__}.__init__ does not begin with super().__init__(context)"
                    )
            except RAISED as error:
                raise self._error_of(error, name) from error
        return nodes

    def _make_coordinator(self) -> MissionCoordinator:
        described, draws = self._scenario, self._draws
        surfaced = None if self._surface is None else self._surface.surfaced
        follow, log = self._follow, self._recorder.log
        coordinator = MissionCoordinator(
            self.env, described, draws, self._detector, follow, log, surfaced
        )
        level = None if described.battery is None else described.battery.mission_ends_at_level
        if self._battery is not None and level is not None:
            self.env.process(coordinator.watch_battery(self._battery, level))
        if described.leak is not None:
            self.env.process(
                leak_monitor(self.env, self.bus, draws.value("leak.time_s"), coordinator.give_up)
            )
        return coordinator

    def _observe(self) -> None:
        """Have metrics and record told what they are made of."""
        modes, bus = self.mode_manager, self.bus
        self.components = components = dict[str, str]()
        bus.subscribe(
            lambda report: components.update({report.key: str(report.value)}),
            (Kind.COMPONENT_STATUS,),
        )
        bus.subscribe(self._reactions.diagnostic, (Kind.COMPONENT_STATUS,))
        modes.listeners.append(self._reactions.mode_effect)
        if self._scenario.further_columns:
            modes.listeners.append(self._further.mode_effect)
            modes.adaptation_listeners.append(self._further.adapted)
        if self._recorder.enabled:
            bus.subscribe(self._recorder.diagnostic)
            modes.listeners.append(self._recorder.mode_effect)

    def _start_processes(self) -> None:
        """Start the coordinator, the monitors and the manager."""
        scenario, draws, monitors = self._scenario, self._draws, self._scenario.revision.monitors
        self._coordinator.start(self._host.request, self._host.cancel)
        states: dict[tuple[Kind, str], Callable[[], Pose | float]] = {
            (Kind.POSE, "pose"): lambda: self.pose,
            (Kind.DISTANCE, "distance_inspected_m"): lambda: self._follow.distance_m,
        }
        start_monitors(
            self.env, self.bus, self._measurements.values(), states, self._detector.detected
        )
        self.env.process(
            thruster_monitor(
                self._thrusters,
                self.bus,
                draw_schedule(scenario, draws),
                Timing.of(scenario, draws, "thruster_monitor", monitors.thruster_check_period_s),
                monitors.thruster_event_times == "after_previous",
                message_loss("thruster_monitor", scenario.thruster_monitor, draws),
            )
        )
        stop_at(self._coordinator.ended)
        self._host.start()

    # The end.

    def _make_result(self) -> MissionResult:
        metrics, recorder = self.metrics(), self._recorder
        self._host.end(metrics)
        further: dict[str, float | int | None] = {}
        if self._scenario.further_columns:
            self._further.reasoning_time_s = self.manager.reasoning_time_s
            if self._surface is not None and self._surface.surfaced_s is not None:
                self._further.surfacing_time_s = (
                    self._surface.surfaced_s - self._draws.drawn["leak.time_s"]
                )
            further = self._further.columns(metrics)
        refusals = [
            str(self.mode_manager.refusal(*request)) for request in self.mode_manager.refused
        ]
        return MissionResult(
            metrics,
            tuple(recorder.events),
            recorder.trajectory(self._vehicle, self._visibility, self._battery),
            tuple(recorder.knowledge),
            self._draws.drawn,
            further,
            (*refusals, *(() if is_built_in(self._manager_name) else self._host.remarks())),
        )

    def _guarded(self, run: Callable[..., object], *arguments: object) -> None:
        try:
            run(*arguments)
        except SuaveDesError:
            raise
        except MissionTimeOut as error:
            error.time_s = self.now_s
            raise
        except RAISED as error:  # in a user-defined function, or in a process that the manager started by itself
            raise self._error_of(error) from error

    def _error_of(self, error: BaseException, function: str = "") -> SuaveDesError:
        """Convert an exception in a user's code into the error that ends the mission."""
        if isinstance(error, MissionError):
            return error
        cause = str(error) if isinstance(error, SuaveDesError) else cause_of(error, function)
        return MissionError(self._manager_name, self._run, self.env.now, cause)
