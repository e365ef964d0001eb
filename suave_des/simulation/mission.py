"""One mission: vehicle, monitors, managed and managing subsystem, wired into a SimPy environment
and advanced in it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from math import inf, isnan
from pathlib import Path
from typing import ClassVar, Unpack

from suave_des.arguments import check_names
from suave_des.clock import drop_events
from suave_des.compiling import Array
from suave_des.domain import Task
from suave_des.errors import InputError, MissionTimeOut, SuaveDesError, shown
from suave_des.managing.simple import NoManager
from suave_des.metrics.result import MissionMetrics, MissionResult
from suave_des.monitor.diagnostics import Kind
from suave_des.registry import ManagerLike, is_built_in, manager_class, name_of
from suave_des.resources import DEFAULT_SCENARIO
from suave_des.scenario.loader import Replacements, load_scenario
from suave_des.simulation.assembly import Order, assemble
from suave_des.simulation.calls import RAISED
from suave_des.simulation.prepared import PreparedScenario
from suave_des.vehicle.kernel import POSITION
from suave_des.vehicle.model import Pose
from suave_des.vehicle.vehicle import row_at

CALLER = "caller"
"""Name, in the metrics, of a managing subsystem that is the program which advances the mission."""


class CallerManages(NoManager):
    """Leaves adaptation to the caller; a task, and the mission, begins with the default modes of
    its functions.
    """

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
        components: the last reported status of each component: FALSE or RECOVERED, or LEAK of the hull.

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
        name = CALLER if manager is None else name_of(manager)
        kind = CallerManages if manager is None else manager_class(name)
        self._order = Order(scenario, name, kind, manager is None, run, seed, record)
        parts = assemble(self._order)
        self._surroundings, self._managed, self._observers, self._host = parts
        self.env, self.bus = self._surroundings.env, self._surroundings.bus
        self.mode_manager, self._coordinator = self._managed.mode_manager, self._managed.coordinator
        self.components, self.manager = self._observers.components, self._host.manager
        self._vehicle, self._measurements = (
            parts.surroundings.vehicle,
            parts.surroundings.measurements,
        )
        self._result: MissionResult | None = None
        self._is_closed = False

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
        self._check_open()
        until_s, now_s = inf if until is None else float(until), self.env.now
        if isnan(until_s) or until_s < now_s:
            problem = f"the mission cannot go to {until_s:g} s: it is at {self.now_s:g} s"
            raise InputError(problem, remedy="give a later mission time")
        if until_s == inf:
            self.result()
        elif until_s > now_s and not self.is_over:
            self._guarded(self.env.advance, until_s)

    def change_mode(self, function: str, mode: str) -> bool:
        """Request a mode of a function, which takes effect after the scenario's latency.

        Returns:
            Whether the function accepts it.

        Raises:
            InputError: there is no such function or mode, or the mission has a manager.
        """
        self._check_open()
        if not self._order.is_callers:
            raise InputError(
                "the mission has a manager, which changes modes", remedy="leave the manager out"
            )
        is_accepted = self.mode_manager.change_mode(function, mode)
        if not is_accepted:
            self.check_mode(function, mode)
        return is_accepted

    def check_mode(self, function: str, mode: str) -> None:
        """Check that a mode can be requested.

        Raises:
            InputError: there is no such function or mode.
        """
        if mode not in self.mode_manager.available_modes(function):
            raise self.mode_manager.refusal(function, mode)

    def result(self) -> MissionResult:
        """Run to the end, and return the metrics with the record, if one was kept.

        Raises:
            InputError: the mission was closed before its result was asked for.
            MissionError: the manager raised.
        """
        if self._result is None:
            self._check_open()
            if not self.is_over:
                self._guarded(self.env.run, self._coordinator.ended)
            self._result = self._make_result()
        return self._result

    def close(self) -> None:
        """End the mission, and give its memory back to its Simulator, for the next mission.

        Afterwards it cannot go on, and neither `pose` nor `way_m` can be read: each says that the
        mission is closed. All else can be read as before, and so can a result that was made.
        """
        if self._is_closed:
            return
        self._is_closed = True
        if not self._order.record:  # the trajectory is read from it
            self._order.prepared.give_back(self._vehicle.track)
        # What refers to each other is freed at once if it no longer does: 5% of a mission's time.
        drop_events(self.env)
        self.bus.close()
        self.mode_manager.listeners.clear()
        if self._surroundings.battery is not None:
            self._surroundings.battery.close()
        self._managed.flight.close()
        self._coordinator.close()
        self._host.close()

    def _check_open(self) -> None:
        if self._is_closed:
            raise InputError("the mission is closed", remedy="read what you need before close()")

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
        """The vehicle's pose.

        Raises:
            InputError: the mission is closed.
        """
        self._check_open()
        return self._vehicle.pose(self.env.now)

    def way_m(self) -> Array:
        """Return the vehicle's positions so far, one each 0.05 s: x, y and z, shape (n, 3).

        Raises:
            InputError: the mission is closed.
        """
        self._check_open()
        return self._vehicle.track[: row_at(self.env.now) + 1, POSITION].copy()

    @property
    def distance_inspected_m(self) -> float:
        """The last published distance inspected."""
        return self._coordinator.distance_inspected_m

    def metrics(self) -> MissionMetrics:
        """Compute the metrics, a row of runs.csv; as of now while the mission is not over."""
        order, coordinator, detector = self._order, self._coordinator, self._managed.detector
        found = coordinator.search_time_s is not None
        x_m, y_m = (
            order.prepared.points[detector.first_point, :2].tolist() if found else (None, None)
        )
        return MissionMetrics(
            scenario=order.scenario.name,
            manager=order.manager,
            run=order.run,
            seed=order.seed,
            initial_x_m=self._surroundings.start_m[0],
            initial_y_m=self._surroundings.start_m[1],
            mission_duration_s=float(self.env.now),
            pipeline_found=found,
            search_time_s=coordinator.search_time_or_limit_s,
            distance_inspected_m=coordinator.distance_inspected_m,
            mean_reaction_time_s=self._observers.reactions.mean_s(),
            adaptations=self.mode_manager.adaptations,
            detection_time_s=detector.detected_s if found else None,
            detection_x_m=x_m,
            detection_y_m=y_m,
        )

    # The end.

    def _make_result(self) -> MissionResult:
        metrics, around = self.metrics(), self._surroundings
        self._host.end(metrics)
        further: dict[str, float | int | None] = {}
        if self._order.scenario.further_columns:
            columns, surface = self._observers.further, self._managed.surface
            columns.reasoning_time_s = self.manager.reasoning_time_s
            if surface is not None and surface.surfaced_s is not None:
                columns.surfacing_time_s = surface.surfaced_s - around.draws.drawn["leak.time_s"]
            further = columns.columns(metrics)
        unknown = self.mode_manager.unknown_requests
        remarks = [str(self.mode_manager.refusal(*request)) for request in unknown]
        if not is_built_in(self._order.manager):
            remarks.extend(self._host.remarks())
        recorder = around.recorder
        return MissionResult(
            metrics,
            tuple(recorder.events),
            recorder.trajectory(self._vehicle, around.visibility, around.battery),
            tuple(recorder.knowledge),
            around.draws.drawn,
            further,
            tuple(remarks),
        )

    def _guarded(self, run: Callable[..., object], *arguments: object) -> None:
        try:
            run(*arguments)
        except SuaveDesError:
            raise
        except MissionTimeOut as error:
            error.time_s = self.now_s
            raise
        except RAISED as error:  # in a user's function, or in a process that the manager started
            raise self._surroundings.error_of(error) from error
