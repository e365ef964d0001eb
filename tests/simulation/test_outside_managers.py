"""User-defined managers, given as module:Class: what happens when they fail, and that missions are
freed.
"""

import gc

import pytest

from suave_des.errors import MissionError
from suave_des.metrics.result import MissionResult
from tests.helpers import OUTSIDE
from tests.helpers.outside_managers import Counted

QUIET = {"calibration": {"altitude_error_m": 0.0, "reasoning_slowdown": 0.0}}


def mission(
    simulator, manager: str, scenario: str = "seams2023", **changes: object
) -> MissionResult:
    return simulator(scenario, **changes).run(f"{OUTSIDE}:{manager}", 1, 1, record=True)


def times_of(result: MissionResult, event: str, detail: str = "") -> list[float]:
    return [
        each.t_s for each in result.events if each.event == event and each.detail.startswith(detail)
    ]


def test_adapt_is_called_every_period(simulator):
    result = mission(simulator, "Deliberate")
    assert times_of(result, "thinks")[:4] == pytest.approx([1.0, 3.0, 5.0, 7.0])


@pytest.mark.parametrize(
    ("event", "detail", "t_s"),
    [
        ("mode_requested", "f_generate_search_path -> fd_spiral_high", 1.5),
        ("mode_set", "f_generate_search_path = fd_spiral_high", 2.0),
    ],
)
def test_adapt_may_let_mission_time_pass(simulator, event, detail, t_s):
    """It thinks for half a second; so long is the latency of modes, too."""
    result = mission(simulator, "Deliberate")
    assert times_of(result, event, detail)[0] == pytest.approx(t_s)


def test_a_call_that_would_come_during_an_earlier_one_is_left_out(simulator):
    settings = {"managers": {f"{OUTSIDE}:Deliberate": {"takes_s": 5.0}}}
    assert times_of(mission(simulator, "Deliberate", **settings), "thinks")[:4] == pytest.approx(
        [1.0, 7.0, 13.0, 19.0]
    )


def test_adapt_may_handle_the_failure_of_an_event_that_it_waits_for(simulator):
    assert times_of(mission(simulator, "HandlesFailures"), "handles", "lost")[:2] == pytest.approx(
        [1.0, 3.0]
    )


def test_an_outside_manager_can_complete_the_mission(simulator):
    assert mission(simulator, "Deliberate", **QUIET).metrics.distance_inspected_m > 0.0


@pytest.mark.parametrize("detail", ["water_visibility 3.75", "c_thruster_1 FALSE"])
def test_it_gets_what_monitors_publish(simulator, detail):
    assert times_of(mission(simulator, "Observer"), "received", detail)


def test_its_random_stream_depends_on_the_run_alone(simulator):
    def drawn(run: int, **changes: object) -> list[str]:
        result = simulator("seams2023", **changes).run(f"{OUTSIDE}:Drawing", run, 1, record=True)
        return [each.detail for each in result.events if each.event == "drew"][:1]

    assert drawn(1) == drawn(1, **QUIET) != drawn(2)


RAISES = """
from suave_des.managing.base import ManagingSubsystem

class Mine(ManagingSubsystem):
    period_s = starts_s = 12.0
    {}
"""


@pytest.fixture
def failure(simulator, tmp_path, monkeypatch):
    """The error of a mission whose manager has a class of this body."""
    monkeypatch.syspath_prepend(tmp_path)

    def of(body: str) -> MissionError:
        (tmp_path / f"failing_{tmp_path.name}.py").write_text(RAISES.format(body))
        with pytest.raises(MissionError) as raised:
            simulator().run(f"failing_{tmp_path.name}:Mine", 4, 1)
        return raised.value

    return of


@pytest.mark.parametrize(
    ("body", "cause", "earliest_s", "latest_s"),
    [
        (
            "def __init__(self, system): raise RuntimeError('at launch')",
            "RuntimeError: at launch",
            0.0,
            0.0,
        ),
        (
            "def task_requested(self, task): raise KeyError('no task')",
            "KeyError: 'no task'",
            0.0,
            0.0,
        ),
        (
            "def task_cancelled(self, task): raise ValueError('no stop')",
            "ValueError: no stop",
            300.0,
            300.5,
        ),
        (
            "def diagnostic(self, diagnostic): 1 / (diagnostic.value != 'FALSE')",
            "ZeroDivisionError: ",
            35.0,
            36.0,
        ),
        ("def adapt(self): raise ValueError('not now')", "ValueError: not now", 12.0, 12.0),
        (
            "def adapt(self): yield self.system.env.timeout(2.5); raise ValueError('later')",
            "ValueError: ",
            14.5,
            14.5,
        ),
        (
            "def adapt(self): yield self.system.env.event().fail(LookupError('lost'))",
            "LookupError: lost",
            12.0,
            12.0,
        ),
        (
            "def adapt(self): raise type('E', (Exception,), {'__str__': len})",
            "E: its text cannot be made",
            12.0,
            12.0,
        ),
        ("def adapt(self): yield 1.0", "TypeError: adapt yielded 1.0", 12.0, 12.0),
        ("period_s = 0.0", "ValueError: period_s is 0.0", 0.0, 0.0),
        (
            "def task_requested(self, task): self.system.env.process(self.go())\n"
            "    def go(self): yield self.system.env.timeout(7.0); raise ValueError('by itself')",
            *("ValueError: by itself", 7.0, 7.0),
        ),
    ],
)
def test_what_a_manager_raises_is_told_with_where_it_was_raised(
    failure, body, cause, earliest_s, latest_s
):
    error = failure(body)
    assert error.manager.endswith(":Mine") and error.run == 4
    assert earliest_s <= error.time_s <= latest_s
    assert error.cause.startswith(cause)


def test_other_missions_are_not_disturbed_by_one_that_failed(simulator, failure):
    before = simulator().run("none", 1, 1)
    failure("def adapt(self): raise ValueError")
    assert simulator().run("none", 1, 1) == before


def test_a_mission_is_freed_at_its_end(simulator):
    missions = simulator(mission={"time_limit_s": 200.0})
    gc.collect()  # in tests it does not come by itself so soon
    for run in range(1, 4):
        missions.run(f"{OUTSIDE}:Lingering", run, 1)
        assert len(Counted.existing) == 1  # the last one's, which its class keeps
