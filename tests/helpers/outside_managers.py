"""Managers as a user would write them, some of them with mistakes."""

from typing import ClassVar
from weakref import WeakSet

from suave_des.managed.task import Task
from suave_des.managing.base import ManagedSystem, ManagingSubsystem
from suave_des.managing.metacontrol import Metacontrol
from suave_des.monitor.diagnostics import Diagnostic, Kind


class Deliberate(ManagingSubsystem):
    """Searches high from the first tick on; each adaptation takes as long as its settings say."""

    def __init__(self, system: ManagedSystem) -> None:
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


class Observer(ManagingSubsystem):
    """Writes down what it hears."""

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        self.system.log("heard", f"{diagnostic.key} {diagnostic.value}")


class Drawing(ManagingSubsystem):
    """Draws from a stream of its own."""

    def task_requested(self, task: Task) -> None:
        self.system.log("drew", str(self.system.stream("my/choice").random()))


class Counted(ManagingSubsystem):
    """Tells how many of its kind there still are."""

    existing: ClassVar[WeakSet] = WeakSet()

    def __init__(self, system: ManagedSystem) -> None:
        super().__init__(system)
        self.existing.add(self)


class Lingering(Counted):
    """Outlives its mission, until there is another one."""

    latest: ClassVar[Counted | None] = None

    def __init__(self, system: ManagedSystem) -> None:
        super().__init__(system)
        Lingering.latest = self


class FailsAtLaunch(ManagingSubsystem):
    def __init__(self, system: ManagedSystem) -> None:
        raise RuntimeError("at launch")


class FailsOnRequest(ManagingSubsystem):
    def task_requested(self, task: Task) -> None:
        raise KeyError("no such task")


class FailsOnCancellation(ManagingSubsystem):
    def task_cancelled(self, task: Task) -> None:
        raise ValueError("cannot stop")


class FailsOnDiagnostic(ManagingSubsystem):
    def diagnostic(self, diagnostic: Diagnostic) -> None:
        if diagnostic.value == "FALSE":
            raise ValueError("a thruster, too")


class FailsInAdapt(ManagingSubsystem):
    def __init__(self, system: ManagedSystem) -> None:
        super().__init__(system)
        self.period_s = self.starts_s = 12.0

    def adapt(self) -> None:
        raise ZeroDivisionError("division by zero")


class FailsAfterAWhile(FailsInAdapt):
    def adapt(self):
        yield self.system.env.timeout(2.5)
        raise ValueError("changed its mind")


class YieldsANumber(FailsInAdapt):
    def adapt(self):
        yield 1.0


class FailsInItsOwnProcess(ManagingSubsystem):
    def task_requested(self, task: Task) -> None:
        self.system.env.process(self._go())

    def _go(self):
        yield self.system.env.timeout(7.0)
        raise ValueError("by itself")


class NeverAdvances(ManagingSubsystem):
    def __init__(self, system: ManagedSystem) -> None:
        super().__init__(system)
        self.period_s = 0.0


class Resting(ManagingSubsystem):
    """Has nothing to do while the visibility is between 2 and 3 m, and notes the times of its calls."""

    hears = (Kind.COMPONENT_STATUS,)

    def __init__(self, system: ManagedSystem) -> None:
        super().__init__(system)
        self.period_s, self.starts_s = 2.0, 1.0
        self.bounds = {"water_visibility": (2.0, 3.0), "salinity": (0.0, 1.0)}
        self.called_s = CALLED_S
        self.called_s.clear()

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        """What it hears may change what it does."""

    def adapt(self) -> None:
        self.called_s.append(self.system.now_s)

    def rests_while(self):
        return self.bounds


class WatchesTheBattery(Resting):
    def rests_while(self):
        return {"battery_level": (0.0, 2.0)}


class NotResting(Resting):
    """Derived from one that rests: what it does in adapt may be anything."""


class NeverIdle(Resting):
    rests_while = Resting.rests_while

    def adapt(self):
        super().adapt()
        yield self.system.env.timeout(0.0)


class Acting(Resting):
    """Each adaptation takes half a second, after which it has nothing to do for as long."""

    rests_after = Resting.rests_while

    def adapt(self):
        super().adapt()
        yield self.system.env.timeout(0.5)


class AnyGrid(Acting):
    """The same with the times that the scenario says."""

    rests_while = Resting.rests_while
    rests_after = Resting.rests_while

    def __init__(self, system: ManagedSystem) -> None:
        super().__init__(system)
        self.period_s, self.starts_s = system.settings["period_s"], system.settings["starts_s"]

    def adapt(self):
        self.called_s.append(self.system.now_s)
        takes_s = self.system.settings["takes_s"]
        return self._act(takes_s) if takes_s else None

    def _act(self, takes_s: float):
        yield self.system.env.timeout(takes_s)


class StillActing(Acting):
    """Derived from one that rests after it has acted."""


class InTwoRanges(Resting):
    """Has nothing to do either while the visibility is between 2 and 3 m, or between 3 and 4 m."""

    def rests_while(self):
        return {"water_visibility": (2.0, 3.0, 3.0, 4.0)}


class AsksForTheRecord(ManagingSubsystem):
    def __init__(self, system: ManagedSystem) -> None:
        super().__init__(system)
        RECORDED.append(system.recorded)


class BlindInTheDark(Metacontrol):
    """Takes a visibility below 2 m for no number."""

    rests_while = Metacontrol.rests_while
    rests_after = Metacontrol.rests_after

    def measured(self, attribute):
        value = super().measured(attribute)
        return float("nan") if value is not None and value < 2.0 else value


class Hasty(Metacontrol):
    """Begins a cycle sooner than one is over."""

    rests_while = Metacontrol.rests_while
    rests_after = Metacontrol.rests_after

    def __init__(self, system: ManagedSystem) -> None:
        super().__init__(system)
        self.period_s = 0.4


class Meddling(Metacontrol):
    """Requests a mode at once when a component's status is reported, and rests as metacontrol did at first."""

    rests_while = Metacontrol.rests_while

    def diagnostic(self, diagnostic):
        super().diagnostic(diagnostic)
        self.system.change_mode("f_generate_search_path", "fd_spiral_high")


class MeddlingToo(Meddling):
    """The same, and rests after executions as well."""

    rests_while = Metacontrol.rests_while
    rests_after = Metacontrol.rests_after


class CountsIdleCycles(Metacontrol):
    """Requests a mode in the 25th cycle that changes nothing, and so never rests."""

    def __init__(self, system: ManagedSystem) -> None:
        super().__init__(system)
        self._idle = 0

    def rests_while(self):
        return None

    def adapt(self):
        execution = super().adapt()
        self._idle += execution is None
        if self._idle == 25:
            self.system.change_mode("f_generate_search_path", "fd_spiral_low")
        return execution


class TakesBoundsApart(Metacontrol):
    """Knows of one pair of bounds for an attribute."""

    def rests_while(self):
        bounds = super().rests_while()
        return None if bounds is None else {name: (low, high) for name, (low, high) in bounds.items()}


class DoesMore(Metacontrol):
    """Notes when metacontrol's cycles are over."""

    def adapt(self):
        execution = super().adapt()
        if execution is not None:
            yield from execution
        CALLED_S.append(self.system.now_s)


RECORDED: list[bool] = []
"""What managers were told of the record."""

CALLED_S: list[float] = []
"""When the last mission's manager was called."""
