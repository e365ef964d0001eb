"""Managers as a user would write them, some of them with mistakes."""

from suave_des.managed.coordinator import Task
from suave_des.managing.base import ManagedSystem, ManagingSubsystem
from suave_des.monitor.diagnostics import Diagnostic


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
