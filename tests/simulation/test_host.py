"""The host of a manager: which hook it calls when, and what becomes of what the manager raises."""

from collections.abc import Callable
from types import SimpleNamespace

import pytest
import simpy

from suave_des.domain import Task
from suave_des.errors import InputError, SuaveDesError
from suave_des.managing.base import ManagingSubsystem
from suave_des.monitor.diagnostics import Diagnostic, DiagnosticsBus, Kind
from suave_des.simulation.host import ManagerHost
from tests.helpers.managers_at_work import SCENARIOS, system_of

TASK = Task("search_pipeline", ("f_generate_search_path",))
REPORT = Diagnostic(0.0, Kind.COMPONENT_STATUS, "c_thruster_1", "FALSE")
METRICS = SimpleNamespace(adaptations=3)


class FailedError(SuaveDesError):
    """The error that ends the mission."""


class Modes:
    """What a host uses of the mode manager, and what a test says of requests."""

    def __init__(self, note: Callable[..., None]) -> None:
        self.note = note
        self.requests = self.refusals = 0

    def end_task(self, functions: tuple[str, ...]) -> None:
        self.note("end_task", functions)


class Noting(ManagingSubsystem):
    """Notes the calls of its hooks, with the mission time of those of adapt."""

    def note(self, *what: object) -> None:
        self.system.modes.note(*what)

    def recall(self, learned, training):
        self.note("recall", learned, training)

    def mission_started(self):
        self.note("mission_started")

    def mission_ended(self, metrics):
        self.note("mission_ended", metrics)

    def task_requested(self, task):
        self.note("task_requested", task)

    def task_cancelled(self, task):
        self.note("task_cancelled", task)

    def adapt(self):
        self.note("adapt", self.system.now_s)


class Hosted:
    """A manager and its host, without a mission, and the calls that were noted."""

    def __init__(self, kind: type[ManagingSubsystem], *, recorded: bool = False) -> None:
        self.calls: list[tuple[object, ...]] = []
        self.env = simpy.Environment()
        self.bus = DiagnosticsBus()
        self.modes = Modes(lambda *what: self.calls.append(what))
        coordinator = SimpleNamespace(task=None, functions=())
        scenario = SCENARIOS["2023"].scenario
        self.system = system_of(self.env, scenario, self.modes, {}, coordinator, recorded=recorded)
        self.host = ManagerHost(
            kind, self.system, self.bus, FailedError, {"depth_m": 5.0}, training=True
        )

    def adapted_s(self, until_s: float) -> list[object]:
        """The times of the calls of adapt, once mission time is `until_s`."""
        self.env.run(until_s)
        return [call[1] for call in self.calls if call[0] == "adapt"]


@pytest.mark.parametrize(
    ("call", "noted"),
    [
        (lambda host: None, ("recall", {"depth_m": 5.0}, True)),
        (lambda host: host.start(), ("mission_started",)),
        (lambda host: host.end(METRICS), ("mission_ended", METRICS)),
        (lambda host: host.request(TASK), ("task_requested", TASK)),
        (lambda host: host.cancel(TASK), ("task_cancelled", TASK)),
    ],
    ids=["recall", "mission_started", "mission_ended", "task_requested", "task_cancelled"],
)
def test_a_hook_is_called_with_what_it_is_for(call, noted):
    hosted = Hosted(Noting)
    call(hosted.host)
    assert hosted.calls[-1] == noted


def test_functions_of_a_task_have_ended_before_the_manager_is_told():
    hosted = Hosted(Noting)
    hosted.host.cancel(TASK)
    assert hosted.calls[1:] == [("end_task", TASK.functions), ("task_cancelled", TASK)]


# Diagnostics.


class Reading(Noting):
    subscribes_to = (Kind.COMPONENT_STATUS,)

    def diagnostic(self, diagnostic):
        self.note("diagnostic", diagnostic)


def test_a_diagnostic_of_a_subscribed_kind_is_passed_on():
    hosted = Hosted(Reading)
    hosted.bus.publish(REPORT)
    assert hosted.calls[-1] == ("diagnostic", REPORT)


def test_one_of_another_kind_is_not():
    hosted = Hosted(Reading)
    hosted.bus.publish(Diagnostic(0.0, Kind.QA_STATUS, "water_visibility", 2.0))
    assert "diagnostic" not in dict.fromkeys(call[0] for call in hosted.calls)


def test_a_manager_that_does_not_read_them_is_not_subscribed():
    """Publishing measured values takes time, which a mission without a reader saves."""
    started = []
    Hosted(Noting).bus.when_subscribed(Kind.COMPONENT_STATUS, lambda: started.append(True))
    assert not started


# Errors.

HOOKS = {
    "mission_started": lambda host: host.start(),
    "mission_ended": lambda host: host.end(METRICS),
    "task_requested": lambda host: host.request(TASK),
    "task_cancelled": lambda host: host.cancel(TASK),
    "diagnostic": lambda host: host.bus.publish(REPORT),
    "adapt": lambda host: host.system.env.run(1.0),
}


def raising(error: BaseException) -> Callable[..., None]:
    def hook(self: ManagingSubsystem, *arguments: object) -> None:
        raise error

    return hook


@pytest.mark.parametrize("raised", [ValueError("no"), SystemExit(3)], ids=["error", "exit"])
@pytest.mark.parametrize("hook", HOOKS)
def test_what_a_hook_raises_ends_the_mission(hook, raised):
    hosted = Hosted(type("Raising", (Noting,), {hook: raising(raised), "period_s": 2.0}))
    with pytest.raises(FailedError) as caught:
        HOOKS[hook](hosted.host)
    assert caught.value.__cause__ is raised


def test_what_init_raises_ends_the_mission():
    with pytest.raises(FailedError):
        Hosted(type("Raising", (Noting,), {"__init__": raising(ValueError("no"))}))


def test_bad_input_that_a_manager_finds_concerns_all_missions():
    with pytest.raises(InputError):
        Hosted(type("Raising", (Noting,), {"__init__": raising(InputError("no rules"))}))


def test_an_init_that_does_not_call_that_of_the_base_ends_the_mission():
    with pytest.raises(FailedError) as caught:
        Hosted(type("Alone", (ManagingSubsystem,), {"__init__": lambda self, system: None}))
    assert isinstance(caught.value.__cause__, TypeError)


def test_what_adapt_returns_is_nothing_or_a_generator():
    hosted = Hosted(type("Answering", (Noting,), {"adapt": lambda self: 1.0, "period_s": 2.0}))
    with pytest.raises(FailedError):
        hosted.env.run(1.0)


# Times of adapt.


class Periodic(Noting):
    period_s = 2.0
    starts_s = 1.0


def test_adapt_is_called_once_a_period_from_its_start_on():
    assert Hosted(Periodic).adapted_s(until_s=6.0) == [1.0, 3.0, 5.0]


def test_without_a_period_it_is_never_called():
    assert Hosted(Noting).adapted_s(until_s=6.0) == []


def test_after_the_end_it_is_not_called():
    hosted = Hosted(Periodic)
    hosted.env.run(4.0)
    hosted.host.close()
    assert hosted.adapted_s(until_s=8.0) == [1.0, 3.0]


class EventTriggered(Noting):
    """Depends on nothing that is measured: it is called when something has happened."""

    period_s = 2.0
    starts_s = 1.0
    depends_on = {}  # noqa: RUF012 - as users write it


def test_after_a_call_that_changed_nothing_an_event_triggered_manager_sleeps():
    """Not after the first one, in whose period times may be rounded."""
    assert Hosted(EventTriggered).adapted_s(until_s=20.0) == [1.0, 3.0]


def test_in_a_recorded_mission_it_does_not_sleep():
    assert Hosted(EventTriggered, recorded=True).adapted_s(until_s=8.0) == [1.0, 3.0, 5.0, 7.0]


class HeedsReports(EventTriggered):
    depends_on = {}  # noqa: RUF012 - which counts only in the class itself

    def diagnostic(self, diagnostic):
        pass


@pytest.mark.parametrize(
    "happens",
    [
        lambda hosted: hosted.host.request(TASK),
        lambda hosted: hosted.host.cancel(TASK),
        lambda hosted: hosted.bus.publish(REPORT),
        lambda hosted: hosted.system.state_changed(),
    ],
    ids=["task requested", "task cancelled", "diagnostic", "its own change"],
)
def test_it_is_called_at_its_next_time_after_something_happened(happens):
    hosted = Hosted(HeedsReports)
    hosted.env.run(8.0)
    happens(hosted)
    assert hosted.adapted_s(until_s=20.0) == [1.0, 3.0, 9.0]


def test_after_a_refused_request_it_does_not_sleep():
    """It would ask again."""

    def adapt(self: Noting) -> None:
        Noting.adapt(self)
        self.system.modes.refusals += self.system.now_s < 6.0

    hosted = Hosted(type("Refused", (EventTriggered,), {"adapt": adapt, "depends_on": {}}))
    assert hosted.adapted_s(until_s=20.0) == [1.0, 3.0, 5.0, 7.0]


@pytest.mark.parametrize(
    ("takes_s", "answer", "called_s"),
    [
        (0.5, True, [1.0, 3.0]),
        (0.5, None, [1.0, 3.0, 5.0, 7.0]),
        (2.5, True, [1.0, 5.0, 9.0]),
    ],
    ids=["that another call would change nothing", "nothing", "it too late"],
)
def test_after_a_call_that_takes_mission_time_it_sleeps_if_told(takes_s, answer, called_s):
    """A call that takes longer than a period has missed one, in which something may have been."""

    def adapt(self: Noting):
        Noting.adapt(self)
        yield self.system.env.timeout(takes_s)
        return answer

    hosted = Hosted(type("Slow", (EventTriggered,), {"adapt": adapt, "depends_on": {}}))
    assert hosted.adapted_s(until_s=called_s[-1] + 1.9) == called_s


# Probable mistakes.


def test_an_adapt_that_is_never_called_is_a_probable_mistake():
    assert len(list(Hosted(Noting).host.remarks())) == 1


@pytest.mark.parametrize(
    "kind",
    [Periodic, type("CallsIt", (Noting,), {"diagnostic": lambda self, report: self.adapt()})],
    ids=["with a period", "called by the manager itself"],
)
def test_one_that_is_called_is_none(kind):
    hosted = Hosted(type("Mine", (kind,), dict(vars(kind), adapt=lambda self: None)))
    assert not list(hosted.host.remarks())


def test_a_misspelt_attribute_that_was_asked_for_is_a_probable_mistake():
    hosted = Hosted(Periodic)
    hosted.system.measured("water_visibilty")
    (remark,) = hosted.host.remarks()
    assert "water_visibility" in remark


def test_one_that_another_scenario_measures_is_none():
    hosted = Hosted(Periodic)
    hosted.system.measured("battery_level")
    assert not list(hosted.host.remarks())
