"""The mission coordinator: tasks, hand-over, time limit, search time."""

from collections.abc import Callable
from functools import cache
from types import SimpleNamespace

import pytest
import simpy

from suave_des.domain import Task
from suave_des.events import texts_of
from suave_des.managed.coordinator import MissionCoordinator
from suave_des.scenario.loader import load_scenario, with_values
from suave_des.scenario.models import Scenario

BOTH = pytest.mark.parametrize("name", ["2023", "1.5"])
POLL_PHASE_S, LIMIT_PHASE_S = 0.35, 0.2


@cache
def scenario(name: str, time_limit_s: float) -> Scenario:
    loaded = load_scenario({"2023": "seams2023", "1.5": "release15"}[name])
    return with_values(loaded, {"mission.time_limit_s": time_limit_s}).scenario


class Mission:
    """A coordinator with a detection and a path's end at given times; what it asks for, with the
    times.
    """

    def __init__(
        self,
        name: str,
        detected_s: float | None = None,
        path_end_s: float | None = None,
        *,
        time_limit_s: float = 300.0,
        start_delay_s: float = 0.0,
    ) -> None:
        self.env = simpy.Environment()
        self.detector = SimpleNamespace(detected=self.env.event(), detected_s=None, first_point=3)
        self.follow = SimpleNamespace(finished=self.env.event(), distance_m=12.5)
        if detected_s is not None:
            self.env.process(self._detect(detected_s))
        if path_end_s is not None:
            self.env.process(self._finish(path_end_s))
        self.calls: list[tuple[str, float, str]] = []
        self.tasks: list[Task] = []
        self.on_cancel: Callable[[], None] = lambda: None
        self.logged: list[tuple[float, str, str]] = []
        phases_s = {
            "coordinator": POLL_PHASE_S if name == "2023" else 0.035,
            "limit": LIMIT_PHASE_S,
        }
        self.coordinator = MissionCoordinator(
            self.env,
            scenario(name, time_limit_s),
            SimpleNamespace(
                value=lambda key: start_delay_s, phase=lambda timer, period_s: phases_s[timer]
            ),
            self.detector,
            self.follow,
            lambda source, happening: self.logged.append((self.env.now, *texts_of(happening))),
        )
        self.coordinator.start(self.request, self.cancel)

    def run(self) -> "Mission":
        self.env.run(until=self.coordinator.ended)
        return self

    def request(self, task: Task) -> None:
        self.calls.append(("request", round(self.env.now, 6), task.name))
        self.tasks.append(task)

    def cancel(self, task: Task) -> None:
        self.calls.append(("cancel", round(self.env.now, 6), task.name))
        if task.name == "inspect_pipeline":
            self.on_cancel()

    def _detect(self, at_s: float):
        yield self.env.timeout(at_s)
        self.detector.detected_s = at_s
        self.detector.detected.succeed()

    def _finish(self, at_s: float):
        yield self.env.timeout(at_s)
        self.follow.finished.succeed()


@BOTH
def test_search_is_requested_when_the_mission_starts(name):
    assert Mission(name, start_delay_s=2.5).run().calls[0] == ("request", 2.5, "search_pipeline")


@pytest.mark.parametrize(("name", "poll_s"), [("2023", 74.35), ("1.5", 73.535)])
def test_the_inspection_takes_over_at_the_poll_that_sees_the_detection(name, poll_s):
    assert Mission(name, 73.45).run().calls[1:3] == [
        ("cancel", poll_s, "search_pipeline"),
        ("request", poll_s, "inspect_pipeline"),
    ]


@pytest.mark.parametrize(
    ("name", "detected_s", "search_time_s"),
    [
        ("2023", 73.45, 74.0),
        ("2023", 73.30, 73.0),
        ("2023", 100.7, 101.0),
        ("1.5", 73.45, 73.0),
        ("1.5", 73.99, 73.0),
        ("1.5", 74.0 - 1e-10, 74.0),
    ],
)
def test_search_time(name, detected_s, search_time_s):
    assert Mission(name, detected_s).run().coordinator.search_time_or_limit_s == search_time_s


@BOTH
def test_search_time_is_the_limit_when_nothing_was_found(name):
    mission = Mission(name, time_limit_s=100.0).run()
    assert mission.env.now > 100.0
    assert mission.coordinator.search_time_or_limit_s == 100.0


@pytest.mark.parametrize(("limit_s", "end_s"), [(300.0, 300.2), (100.21, 100.7), (100.7, 100.7)])
@BOTH
def test_the_limit_is_checked_every_half_second(name, limit_s, end_s):
    assert Mission(name, time_limit_s=limit_s).run().env.now == pytest.approx(end_s)


@pytest.mark.parametrize(
    ("detected_s", "task"), [(None, "search_pipeline"), (150.0, "inspect_pipeline")]
)
@BOTH
def test_at_the_limit_the_present_task_is_cancelled(name, detected_s, task):
    assert Mission(name, detected_s).run().calls[-1] == ("cancel", 300.2, task)


def test_distance_is_the_one_published_before_the_cancellation_at_the_limit():
    mission = Mission("2023", 150.0)
    mission.on_cancel = lambda: setattr(mission.follow, "distance_m", 99.0)
    assert mission.run().coordinator.distance_inspected_m == 12.5


@pytest.mark.parametrize(("name", "end_s"), [("2023", 201.35), ("1.5", 201.135)])
def test_the_mission_ends_at_the_poll_after_the_end_of_the_path(name, end_s):
    mission = Mission(name, 50.0, 201.1).run()
    assert mission.env.now == pytest.approx(end_s)
    assert [task for what, _, task in mission.calls if what == "cancel"] == [
        "search_pipeline",
        "inspect_pipeline",
    ]


def test_a_detection_that_no_poll_saw_before_the_limit_is_none():
    # Detected at 300.1 s, seen only at 300.35 s; the limit is noticed at 300.2 s.
    assert Mission("2023", 300.1).run().coordinator.search_time_s is None


@pytest.mark.parametrize(("name", "functions"), [("2023", ("f_maintain_motion",)), ("1.5", ())])
def test_functions_that_the_mission_needs(name, functions):
    assert Mission(name, 50.0).coordinator.mission_wide_functions == functions


@pytest.mark.parametrize(("name", "too"), [("2023", ()), ("1.5", ("f_maintain_motion",))])
def test_functions_that_each_task_needs(name, too):
    functions = [(*too, "f_generate_search_path"), (*too, "f_follow_pipeline")]
    assert [task.functions for task in Mission(name, 50.0).run().tasks] == functions
