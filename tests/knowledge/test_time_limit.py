"""The reasoner's time limit: what counts is the CPU time that its process gets, and what was given
up is no reason to refuse everything after it.
"""

import threading
import time

import pytest

from suave_des.knowledge import pellet
from suave_des.knowledge.pellet import ReasonerTimeoutError, TimeLimit, is_stuck
from tests.helpers.command import stopped_for, wait_until

LIMIT_S = 0.05


@pytest.fixture
def released(monkeypatch: pytest.MonkeyPatch):
    """Ends what a test has begun, and does without the end of a process with abandoned work."""
    monkeypatch.setattr(pellet, "_abandoned", ["so that nothing is registered"])
    event = threading.Event()
    yield event
    event.set()
    wait_until(lambda: not is_stuck(), 10.0)


def computing(seconds: float) -> int:
    """Use CPU time."""
    end_s = time.thread_time() + seconds
    while time.thread_time() < end_s:
        pass
    return 7


def give_up(limit: TimeLimit, released: threading.Event) -> None:
    """Have work given up that ends when it is released."""
    with pytest.raises(ReasonerTimeoutError, match="not done after"):
        limit.run(released.wait, "waiting")


def test_time_in_which_the_reasoner_does_not_compute_does_not_count():
    def late() -> int:
        time.sleep(4.0 * LIMIT_S)
        return 7

    assert TimeLimit(LIMIT_S).run(late, "being late") == 7


@pytest.mark.usefixtures("released")
def test_work_that_takes_more_cpu_time_than_the_limit_is_given_up():
    with pytest.raises(ReasonerTimeoutError, match=r"not done after 0.05 s of CPU time \(look for"):
        TimeLimit(LIMIT_S).run(lambda: computing(4.0 * LIMIT_S), "computing")


def test_work_that_gets_no_cpu_time_is_the_machines_fault(released, monkeypatch):
    monkeypatch.setattr(time, "process_time", lambda: 0.0)
    with pytest.raises(ReasonerTimeoutError, match=r"the machine was busy .* \(try again when"):
        TimeLimit(LIMIT_S).run(released.wait, "waiting")


def test_when_the_work_has_ended_later_work_is_done(released):
    limit = TimeLimit(LIMIT_S)
    give_up(limit, released)
    released.set()
    assert limit.run(lambda: 7, "reasoning") == 7


@pytest.mark.usefixtures("released")
def test_the_next_work_waits_for_what_was_given_up():
    limit = TimeLimit(LIMIT_S)
    with pytest.raises(ReasonerTimeoutError):
        limit.run(lambda: computing(2.0 * LIMIT_S), "computing")
    assert limit.run(lambda: 8, "reasoning") == 8


@pytest.fixture
def stuck(released) -> TimeLimit:
    """A limit whose reasoner still works on what was given up, and on what was asked next."""
    limit = TimeLimit(LIMIT_S)
    give_up(limit, released)
    refuse(limit)
    return limit


def refuse(limit: TimeLimit) -> None:
    """Have work refused."""
    with pytest.raises(ReasonerTimeoutError, match="the reasoner is still waiting"):
        limit.run(lambda: 7, "reasoning")


@pytest.mark.usefixtures("stuck")
def test_what_still_goes_on_when_the_next_work_is_given_up_is_stuck():
    assert is_stuck()


def test_a_reasoner_that_is_stuck_refuses_all_work_at_once(stuck):
    began_s = time.process_time()
    refuse(stuck)
    assert time.process_time() - began_s < LIMIT_S


def test_a_process_that_is_stopped_for_longer_than_the_limit_goes_on():
    done = stopped_for(
        1.5,
        """
import time
from suave_des.knowledge.pellet import TimeLimit

def work():
    print("begun", flush=True)
    while time.thread_time() < 0.1:
        pass

TimeLimit(1.0).run(work, "computing")
""",
    )
    assert (done.returncode, done.stderr) == (0, "")
