"""A mission step by step: the caller decides how far it goes, and may be its managing subsystem."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from math import inf, isnan
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, ClassVar, Self, Unpack

from suave_des.domain import Task
from suave_des.errors import InputError, did_you_mean, shown
from suave_des.managing.simple import NoManager
from suave_des.metrics.result import MissionMetrics, MissionResult
from suave_des.monitor.diagnostics import Diagnostic, Kind
from suave_des.resources import DEFAULT_SCENARIO
from suave_des.scenario.loader import Replacements, load_scenario
from suave_des.simulation.simulator import Simulator

if TYPE_CHECKING:
    from suave_des.vehicle.frames import Pose

CALLER = "caller"
"""Name, in the metrics, of a managing subsystem that is the program which advances the mission."""


class CallerManages(NoManager):
    """Leaves adaptation to the caller; a task begins with the default modes of its functions."""

    subscribes_to: ClassVar[Collection[Kind]] = ()


class Mission:
    """One mission, advanced step by step.

    Without a manager the caller is the managing subsystem: each task begins with the default modes of its functions,
    and everything after that is up to `change_mode`. Missions that are advanced in other steps are the same missions:
    only what is requested, and when, makes a difference.

    Example:
        >>> mission = Mission("seams2023", run=1, seed=8)
        >>> while not mission.is_over:
        ...     mission.advance(mission.now_s + 2.0)
        ...     if mission.searches and mission.measured("water_visibility", 0.0) >= 3.25:
        ...         mission.change_mode("f_generate_search_path", "fd_spiral_high")
        >>> mission.metrics().search_time_s
        61.0

    Args:
        scenario: path of a scenario file, name of a shipped one, or a Simulator of a loaded one, which saves loading
            it for each of many missions.
        manager: name of a managing subsystem, or module:Class, which the caller then watches; None: the caller.
        run: number of the run in a campaign with this seed.
        seed: of everything that is random.
        record: whether events and trajectory are kept, for `result`.
        replacements: as of `load_scenario`, unless the scenario is a Simulator.

    Raises:
        InputError: something given cannot be used.
        MissionError: the manager raised.
    """

    def __init__(
        self,
        scenario: str | Path | Simulator = DEFAULT_SCENARIO,
        manager: str | None = None,
        *,
        run: int = 1,
        seed: int = 1,
        record: bool = False,
        **replacements: Unpack[Replacements],
    ) -> None:
        if isinstance(scenario, Simulator):
            self._simulator = scenario
        else:
            self._simulator = Simulator(load_scenario(scenario, **replacements))
        for name, number in (("run", run), ("seed", seed)):
            if isinstance(number, bool) or not isinstance(number, int) or number < 0:
                raise InputError(f"{name}: {shown(number)} is not a number of a {name}", remedy="give a whole number")
        self._is_managed = manager is not None
        self._run = self._simulator.start(
            manager or CALLER, run, seed, record=record, manager_type=None if manager else CallerManages
        )
        self._result: MissionResult | None = None
        self._components: dict[str, str] = {}
        self._run.bus.subscribe(self._take, (Kind.COMPONENT_STATUS,))

    def advance(self, until: float | None = None) -> None:
        """Advance mission time.

        Args:
            until: mission time in s, which comes before whatever happens at that very time; None: the mission's end,
                beyond which it does not go in any case.

        Raises:
            InputError: that time has already passed.
            MissionError: the manager raised.
        """
        until_s = inf if until is None else float(until)
        if isnan(until_s) or until_s < self.now_s:
            problem = f"the mission cannot go to {until_s:g} s: it is at {self.now_s:g} s"
            raise InputError(problem, remedy="give a later mission time")
        if until_s == inf:
            self.result()
        else:
            self._run.advance(until_s)

    def change_mode(self, function: str, mode: str) -> None:
        """Request a mode of a function, which takes effect after the scenario's latency.

        Raises:
            InputError: there is no such function or mode, or the mission has a manager.
        """
        if self._is_managed:
            raise InputError("the mission has a manager, which changes modes", remedy="leave the manager out")
        if not self._run.modes.change_mode(function, mode):
            self.check_mode(function, mode)

    def check_mode(self, function: str, mode: str) -> None:
        """Check that a mode can be requested.

        Raises:
            InputError: there is no such function or mode.
        """
        known = self.modes
        if function not in known:
            raise InputError(f"there is no function {shown(function)}", remedy=did_you_mean(function, known))
        if mode not in known[function]:
            remedy = did_you_mean(mode, known[function], "its modes")
            raise InputError(f"function {function} has no mode {shown(mode)}", remedy=remedy)

    @property
    def now_s(self) -> float:
        """Mission time."""
        return float(self._run.env.now)

    @property
    def is_over(self) -> bool:
        """Whether the mission has ended."""
        return self._run.is_over

    @property
    def task(self) -> Task | None:
        """The current task, with the functions that it needs."""
        return self._run.task

    @property
    def searches(self) -> bool:
        """Whether the pipeline is searched for."""
        return self.task is not None and self.task.name == "search_pipeline"

    @property
    def functions(self) -> tuple[str, ...]:
        """The functions that are currently needed: those of the task, and those of the whole mission."""
        task = self.task
        return (*self._run.system.lasting_functions, *(task.functions if task else ()))

    @property
    def modes(self) -> Mapping[str, tuple[str, ...]]:
        """The modes of each function that can be requested."""
        manager = self._run.modes
        return {function: manager.available_modes(function) for function in manager.nodes}

    def current_mode(self, function: str) -> str | None:
        """The last requested mode of a function; None before the first request."""
        return self._run.modes.current_mode(function)

    @property
    def attributes(self) -> tuple[str, ...]:
        """Names of the quality attributes that are measured."""
        return tuple(self._run.system.measurements)

    def measured(self, attribute: str, default: float | None = None) -> float | None:
        """The last published value of a quality attribute; `default` before the first."""
        value = self._run.system.measured(attribute)
        return default if value is None else value

    @property
    def components(self) -> Mapping[str, str]:
        """The last reported statuses of components, FALSE or RECOVERED."""
        return dict(self._components)

    @property
    def pose(self) -> Pose:
        """The vehicle's pose."""
        return self._run.system.pose()

    @property
    def distance_inspected_m(self) -> float:
        """The last published distance inspected."""
        return self._run.system.distance_inspected_m()

    def metrics(self) -> MissionMetrics:
        """The metrics, a row of runs.csv; as of now while the mission is not over."""
        return self._run.metrics()

    def result(self) -> MissionResult:
        """Run to the end, and return the metrics with the record, if one was kept."""
        if self._result is None:
            self._result = self._run.result()
        return self._result

    def close(self) -> None:
        """Give the mission's memory back to its Simulator, for the next mission; this one cannot continue."""
        self._simulator.give_back(self._run)

    def __enter__(self) -> Self:
        """Use the mission until the end of a `with` block."""
        return self

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        """Close it."""
        self.close()

    def _take(self, diagnostic: Diagnostic) -> None:
        self._components[diagnostic.key] = str(diagnostic.value)
