"""Managers as a user would write them, some of them with mistakes."""

from bisect import bisect_left, bisect_right
from dataclasses import replace
from typing import ClassVar
from weakref import WeakSet

from suave_des.domain import Task
from suave_des.knowledge.state import Plan
from suave_des.managing.base import ManagingSubsystem, System
from suave_des.managing.metacontrol import Metacontrol
from suave_des.monitor.diagnostics import FAILED, Diagnostic, Kind


class Deliberate(ManagingSubsystem):
    """Searches high from the first tick on; each adaptation takes as long as its settings say."""

    def __init__(self, system: System) -> None:
        super().__init__(system)
        self.period_s = 2.0
        self.starts_s = 1.0
        self.takes_s = float(system.settings.get("takes_s", 0.5))
        self.searching = False

    def task_requested(self, task: Task) -> None:
        self.searching = task.name == "search_pipeline"
        if not self.searching:
            self.system.change_mode("f_follow_pipeline", "fd_follow_pipeline")

    def adapt(self):
        self.system.log("thinks", "")
        yield self.system.env.timeout(self.takes_s)
        if self.searching:
            self.system.change_mode("f_generate_search_path", "fd_spiral_high")


class HandlesFailures(Deliberate):
    """Waits for an event that fails, and goes on."""

    def adapt(self):
        try:
            yield self.system.env.event().fail(LookupError("lost"))
        except LookupError as error:
            self.system.log("handles", str(error))


class Observer(ManagingSubsystem):
    """Records the diagnostics that it gets."""

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        self.system.log("received", f"{diagnostic.key} {diagnostic.value}")


class Drawing(ManagingSubsystem):
    """Draws from a stream of its own."""

    def task_requested(self, task: Task) -> None:
        self.system.log("drew", str(self.system.stream("my/choice").random()))


class Counted(ManagingSubsystem):
    """Tells how many of its kind there still are."""

    existing: ClassVar[WeakSet] = WeakSet()

    def __init__(self, system: System) -> None:
        super().__init__(system)
        self.existing.add(self)


class Lingering(Counted):
    """Outlives its mission, until there is another one."""

    latest: ClassVar[Counted | None] = None

    def __init__(self, system: System) -> None:
        super().__init__(system)
        Lingering.latest = self


class EventTriggered(ManagingSubsystem):
    """Depends on how the visibility compares with 2 and 3 m, and notes the times of its calls."""

    subscribes_to: ClassVar = (Kind.COMPONENT_STATUS,)
    depends_on: ClassVar = {"water_visibility": (2.0, 3.0), "battery_level": (0.5,)}

    def __init__(self, system: System) -> None:
        super().__init__(system)
        self.period_s = float(system.settings.get("period_s", 2.0))
        self.starts_s = float(system.settings.get("starts_s", 1.0))
        CALLED_S.clear()

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        """A component's status may change what it does."""

    def adapt(self):
        CALLED_S.append(self.system.now_s)


class EventTriggeredByProperty(EventTriggered):
    """Its settings say what it depends on."""

    @property
    def depends_on(self):
        return {"water_visibility": tuple(self.system.settings.get("thresholds_m", (2.0, 3.0)))}


class DependsOnNoMeasuredValue(EventTriggered):
    depends_on: ClassVar = {}


class MayDependOnAnything(EventTriggered):
    """Says so by the base class's own word."""

    depends_on: ClassVar = None


class DoesNotDeclare(EventTriggered):
    """Derived from an event-triggered manager: what it does in adapt may depend on anything."""


class NeverIdle(EventTriggered):
    """Each call lets mission time pass, if only none; its settings say whether another one would
    change nothing.
    """

    depends_on: ClassVar = EventTriggered.depends_on

    def adapt(self):
        super().adapt()
        yield self.system.env.timeout(self.system.settings.get("takes_s", 0.0))
        return self.system.settings.get("settled")


class ReadsLate(EventTriggered):
    """Reads measured values a second after each call begins."""

    depends_on: ClassVar = EventTriggered.depends_on
    reads_for_s = 1.0

    def adapt(self):
        super().adapt()
        yield self.system.env.timeout(1.0)
        return True


class ReadsLateInMurkyWater(EventTriggered):
    """Reads measured values a second after a call begins, but below 3 m only."""

    depends_on: ClassVar = EventTriggered.depends_on

    def adapt(self):
        super().adapt()
        is_murky = (self.system.measured("water_visibility") or 0.0) < 3.0
        self.reads_for_s = 1.0 if is_murky else 0.0
        return self.read_later() if is_murky else None

    def read_later(self):
        yield self.system.env.timeout(1.0)
        is_murky = (self.system.measured("water_visibility") or 0.0) < 3.0
        self.reads_for_s = 1.0 if is_murky else 0.0
        return True


class LongInClearWater(EventTriggered):
    """Sets the search altitude by the values at the end of a call, which is late in clear water."""

    depends_on: ClassVar = {"water_visibility": (3.0,)}
    subscribes_to = ()
    reads_for_s = 3.0

    def adapt(self):
        is_clear = (self.system.measured("water_visibility") or 0.0) >= 3.0
        yield self.system.env.timeout(3.0 if is_clear else 0.5)
        is_clear = (self.system.measured("water_visibility") or 0.0) >= 3.0
        mode = "fd_spiral_high" if is_clear else "fd_spiral_low"
        self.system.change_mode("f_generate_search_path", mode)
        return True


class SpoilsItsReadingTime(EventTriggered):
    depends_on: ClassVar = EventTriggered.depends_on

    def adapt(self):
        self.reads_for_s = -1.0


class KeepsToWake(EventTriggered):
    """Keeps the function that says that its state has changed."""

    depends_on: ClassVar = EventTriggered.depends_on

    def __init__(self, system: System) -> None:
        super().__init__(system)
        self.wake = system.state_changed


class CountsPlans(Metacontrol):
    """Looks at each plan that it executes."""

    decisions: ClassVar[list[int]] = []

    def execute(self, reasoning, latency_s):
        self.decisions.append(len(reasoning.plan.decisions))
        return super().execute(reasoning, latency_s)


class ThinksFirst(Metacontrol):
    """Begins each cycle half a second after its call, and says so."""

    depends_on = Metacontrol.depends_on

    def __init__(self, system: System) -> None:
        super().__init__(system)
        self.reads_for_s += 0.5

    def adapt(self):
        yield self.system.env.timeout(0.5)
        execution = super().adapt()
        if execution is None:
            return True
        return (yield from execution)


class SlowInClearWater(EventTriggered):
    """Takes more than a period, in clear water only."""

    depends_on: ClassVar = EventTriggered.depends_on

    def adapt(self):
        super().adapt()
        is_clear = (self.system.measured("water_visibility") or 0.0) >= 3.0
        yield self.system.env.timeout(3.0 if is_clear else 0.5)
        return True


class TakesTime(EventTriggered):
    """Acts for some time in each region of the visibility and after each report, and is idle
    then.
    """

    depends_on: ClassVar = {"water_visibility": (2.0, 3.0)}

    def __init__(self, system: System) -> None:
        super().__init__(system)
        self.takes_s = float(system.settings.get("takes_s", 0.5))
        self.handled: object = None
        self.reports = 0

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        self.reports += 1

    def adapt(self):
        super().adapt()
        visibility_m, edges_m = self.system.measured("water_visibility") or 0.0, (2.0, 3.0)
        state = (
            self.reports,
            bisect_left(edges_m, visibility_m) + bisect_right(edges_m, visibility_m),
        )
        return None if state == self.handled else self._act(state)

    def _act(self, state):
        yield self.system.env.timeout(self.takes_s)
        self.handled = state
        height = ["low", "medium", "high"][(state[1] + 1) // 2]
        self.system.change_mode("f_generate_search_path", f"fd_spiral_{height}")


class SearchesAsHighAsItCanSee(ManagingSubsystem):
    """Reads the visibility, recovers thrusters; idle as long as nothing changes."""

    subscribes_to: ClassVar = (Kind.COMPONENT_STATUS,)
    depends_on: ClassVar = {"water_visibility": (2.25, 3.25)}

    def __init__(self, system: System) -> None:
        super().__init__(system)
        self.period_s = float(system.settings.get("period_s", 2.0))
        self.starts_s = float(system.settings.get("starts_s", 1.0))
        self.functions: list[str] = []
        self.failed: set[str] = set()

    def task_requested(self, task: Task) -> None:
        self.functions.extend(task.functions)

    def task_cancelled(self, task: Task) -> None:
        self.functions = [name for name in self.functions if name not in task.functions]
        super().task_cancelled(task)

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        if diagnostic.kind == Kind.COMPONENT_STATUS:
            (self.failed.add if diagnostic.value == FAILED else self.failed.discard)(diagnostic.key)

    def adapt(self):
        visibility_m = self.visibility_m()
        for name in self.functions:
            if name == "f_generate_search_path":
                height = (
                    "high" if visibility_m >= 3.25 else "medium" if visibility_m >= 2.25 else "low"
                )
                self.system.change_mode(name, f"fd_spiral_{height}")
            elif name == "f_follow_pipeline":
                self.system.change_mode(name, "fd_follow_pipeline")
        recovering = "fd_recover_thrusters" if self.failed else "fd_all_thrusters"
        self.system.change_mode("f_maintain_motion", recovering)

    def visibility_m(self) -> float:
        return self.system.measured("water_visibility") or 0.0


class SubscribesToMeasuredValues(SearchesAsHighAsItCanSee):
    """The same, with the visibility that it was told in its hook."""

    subscribes_to: ClassVar = tuple(Kind)
    depends_on: ClassVar = {}
    told_m = 0.0

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        super().diagnostic(diagnostic)
        if diagnostic.key == "water_visibility":
            self.told_m = float(diagnostic.value)

    def visibility_m(self) -> float:
        return self.told_m


class ChangesModesInHooks(SearchesAsHighAsItCanSee):
    """Requests a mode at once when a component's status is reported; its next call may take that
    back.
    """

    depends_on: ClassVar = SearchesAsHighAsItCanSee.depends_on

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        super().diagnostic(diagnostic)
        self.system.change_mode("f_generate_search_path", "fd_spiral_high")


class BlindInTheDark(Metacontrol):
    """Takes a visibility below 2 m for not a number."""

    depends_on = Metacontrol.depends_on

    def monitor(self):
        super().monitor()
        if self.measurements.get("water_visibility", 2.0) < 2.0:
            self.measurements["water_visibility"] = float("nan")


class Hasty(Metacontrol):
    """Begins a cycle sooner than one is over."""

    depends_on = Metacontrol.depends_on

    def __init__(self, system: System) -> None:
        super().__init__(system)
        self.period_s = 0.4


class Meddling(Metacontrol):
    """Requests a mode at once when a component's status is reported."""

    depends_on = Metacontrol.depends_on

    def diagnostic(self, diagnostic):
        super().diagnostic(diagnostic)
        self.system.change_mode("f_generate_search_path", "fd_spiral_high")


class SeesHalf(Metacontrol):
    """Infers as if the visibility were half of what is measured; counts its plans."""

    depends_on = Metacontrol.depends_on
    plans = 0

    def analyze(self):
        measured = dict(self.measurements)
        self.measurements = {name: value / 2.0 for name, value in measured.items()}
        inference = super().analyze()
        self.measurements = measured
        return inference

    def plan(self, inference):
        SeesHalf.plans += 1
        return super().plan(inference)


class PlansLow(Metacontrol):
    """Searches at the lowest altitude, whatever the visibility is."""

    depends_on = Metacontrol.depends_on

    def plan(self, inference):
        low = {"f_generate_search_path": "fd_spiral_low"}
        decisions = super().plan(inference).decisions
        return Plan(
            tuple(replace(each, design=low.get(each.function, each.design)) for each in decisions)
        )


class DoesMore(Metacontrol):
    """Notes when metacontrol's cycles are over."""

    def adapt(self):
        execution = super().adapt()
        if execution is not None:
            yield from execution
        CALLED_S.append(self.system.now_s)


CALLED_S: list[float] = []
"""When the last mission's manager was called."""
