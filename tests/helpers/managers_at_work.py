"""A managing subsystem by itself: the test calls its hooks and reads the modes that it asks for."""

from collections import defaultdict
from collections.abc import Mapping
from types import SimpleNamespace

import simpy

from suave_des.domain import Task
from suave_des.draws import Streams
from suave_des.managing.base import ManagingSubsystem, System
from suave_des.monitor.diagnostics import Diagnostic, Kind
from suave_des.monitor.measurements import Measurements
from suave_des.registry import manager_class
from suave_des.scenario.loader import load_scenario
from suave_des.scenario.models import Battery, Scenario

MOTION, SEARCH, FOLLOW = "f_maintain_motion", "f_generate_search_path", "f_follow_pipeline"
SCENARIOS = {"2023": load_scenario("seams2023"), "1.5": load_scenario("release15")}
MODES = SCENARIOS["1.5"].modes


class AskedModes:
    """Takes requests for modes as the mode manager does, and keeps them."""

    def __init__(self) -> None:
        self.asked: list[tuple[str, str]] = []

    def available_modes(self, function: str) -> tuple[str, ...]:
        return MODES.modes(function)

    def current_mode(self, function: str) -> str | None:
        return next((mode for asked, mode in reversed(self.asked) if asked == function), None)

    def change_mode(self, function: str, mode: str, latency_s: float | None = None) -> bool:
        self.asked.append((function, mode))
        return mode in MODES.modes(function)


class Published(Measurements):
    """Values of a quality attribute, all of them published by now."""

    def __init__(self) -> None:
        self.times_s: list[float] = []
        self.values: list[float] = []

    def count_until(self, t_s: float) -> int:
        return len(self.values)


def system_of(
    env: simpy.Environment,
    scenario: Scenario,
    modes: object,
    measurements: Mapping[str, Measurements],
    coordinator: object,
    *,
    recorded: bool = False,
    settings: Mapping[str, object] | None = None,
    seed: int = 1,
) -> System:
    """What a manager sees, without a vehicle and a knowledge base."""
    recorder = SimpleNamespace(log=lambda source, happening: None)
    parts = {
        "_manager": "m",
        "_coordinator": coordinator,
        "_vehicle": None,
        "_draws": Streams(seed, 1),
    }
    further = {"_recorder": recorder, "_files": {}, "_open_knowledge": lambda: None}
    return System(env, modes, measurements, scenario, settings or {}, recorded, **parts, **further)


class AtWork:
    """One manager in one revision."""

    def __init__(
        self, name: str, revision: str = "1.5", *, seed: int = 1, battery: bool = False
    ) -> None:
        self.per_task = revision == "1.5"
        self.modes = AskedModes()
        self.measurements: defaultdict[str, Published] = defaultdict(Published)
        scenario: Scenario = SCENARIOS[revision].scenario
        if battery:
            scenario = scenario.model_copy(update={"battery": Battery()})
        self.mission_wide = () if self.per_task else (MOTION,)
        self.coordinator = SimpleNamespace(functions=self.mission_wide)
        system = system_of(
            simpy.Environment(),
            scenario,
            self.modes,
            self.measurements,
            self.coordinator,
            seed=seed,
        )
        self.manager: ManagingSubsystem = manager_class(name)(system)

    def task(self, name: str) -> Task:
        function = SEARCH if name == "search_pipeline" else FOLLOW
        return Task(name, (MOTION, function) if self.per_task else (function,))

    def request(self, name: str) -> list[tuple[str, str]]:
        """What is asked for at a task's request."""
        self.coordinator.functions = (*self.mission_wide, *self.task(name).functions)
        return self._during(lambda: self.manager.task_requested(self.task(name)))

    def cancel(self, name: str) -> list[tuple[str, str]]:
        """What is asked for at a task's cancellation."""
        self.coordinator.functions = self.mission_wide
        return self._during(lambda: self.manager.task_cancelled(self.task(name)))

    def adapt(self) -> list[tuple[str, str]]:
        """What is asked for at a tick."""
        return self._during(self.manager.adapt)

    def measured(self, key: str, value: float) -> None:
        """A quality attribute is published."""
        measured = self.measurements[key]
        measured.times_s.append(0.0)
        measured.values.append(value)
        if Kind.QA_STATUS in self.manager.subscribes_to:
            self.manager.diagnostic(Diagnostic(0.0, Kind.QA_STATUS, key, value))

    def reported(self, thruster: int, status: str) -> None:
        """A component's status is published."""
        self.manager.diagnostic(
            Diagnostic(0.0, Kind.COMPONENT_STATUS, f"c_thruster_{thruster}", status)
        )

    def detected(self) -> list[tuple[str, str]]:
        """What is asked for when the pipeline is detected."""
        return self._during(
            lambda: self.manager.diagnostic(Diagnostic(0.0, Kind.DETECTION, "pipeline", 0.0))
        )

    def _during(self, action) -> list[tuple[str, str]]:
        before = len(self.modes.asked)
        action()
        return self.modes.asked[before:]
