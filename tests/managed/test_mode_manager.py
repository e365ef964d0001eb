"""The mode manager: what it answers, and when modes take effect."""

import itertools
from collections.abc import Callable

import pytest
import simpy

from suave_des.managed.mode_manager import ModeManager
from suave_des.managed.node import FunctionNode
from suave_des.scenario.loader import load_scenario
from suave_des.scenario.modes import Mode
from tests.helpers.stand_ins import silent

SEARCH, FOLLOW = "f_generate_search_path", "f_follow_pipeline"
TABLE = load_scenario("seams2023").modes


class Node(FunctionNode):
    """A node that keeps the modes that it was given."""

    def __init__(self, env: simpy.Environment) -> None:
        super().__init__(env)
        self.applied: list[tuple[float, str]] = []

    def apply(self, mode: Mode) -> None:
        self.applied.append((self.env.now, mode.name))
        super().apply(mode)


class Managed:
    """A mode manager for search and follow."""

    def __init__(self, latency_s: Callable[[], float] = lambda: 0.5) -> None:
        self.env = simpy.Environment()
        self.search, self.follow = Node(self.env), Node(self.env)
        nodes = {SEARCH: self.search, FOLLOW: self.follow}
        self.modes = ModeManager(self.env, TABLE, nodes, latency_s, silent)


@pytest.fixture
def managed() -> Managed:
    return Managed()


@pytest.mark.parametrize("mode", ["fd_spiral_low", "fd_unground", "__DEFAULT__"])
def test_any_known_mode_is_answered_with_success_at_once(managed: Managed, mode: str) -> None:
    assert managed.modes.change_mode(SEARCH, mode) is True and managed.env.now == 0.0


@pytest.mark.parametrize(
    ("function", "mode"),
    [(SEARCH, "fd_spiral_very_high"), ("f_dock", "fd_spiral_low"), ("f_maintain_motion", "fd_all_thrusters")],
    ids=["unknown mode", "unknown function", "function without a node"],
)
def test_anything_else_is_refused(managed: Managed, function: str, mode: str) -> None:
    assert managed.modes.change_mode(function, mode) is False


def test_effects_come_after_the_latency_and_listeners_are_called_then_but_not_for_what_was_refused(
    managed: Managed,
) -> None:
    effects: list[tuple[float, str, str]] = []
    managed.modes.listeners.append(lambda function, mode: effects.append((managed.env.now, function, mode.name)))
    managed.modes.change_mode(SEARCH, "fd_spiral_very_high")
    managed.modes.change_mode(SEARCH, "fd_spiral_low")
    managed.env.run()
    assert managed.search.applied == [(0.5, "fd_spiral_low")]
    assert effects == [(0.5, SEARCH, "fd_spiral_low")]


def test_the_mode_already_asked_for_succeeds_without_effect(managed: Managed) -> None:
    managed.modes.change_mode(SEARCH, "fd_spiral_low")
    managed.env.run(until=3.0)
    assert managed.modes.change_mode(SEARCH, "fd_spiral_low") is True
    managed.env.run()
    assert len(managed.search.applied) == 1


def test_effects_keep_the_order_of_requests_of_each_function() -> None:
    latencies = itertools.cycle([3.0, 1.0])
    managed = Managed(lambda: next(latencies))
    managed.modes.change_mode(SEARCH, "fd_spiral_low")
    managed.modes.change_mode(SEARCH, "fd_spiral_high")
    managed.env.run()
    assert managed.search.applied == [(3.0, "fd_spiral_low"), (3.0, "fd_spiral_high")]
    managed.modes.change_mode(SEARCH, "fd_spiral_low")
    managed.modes.change_mode(FOLLOW, "fd_follow_pipeline")
    managed.env.run()
    assert managed.follow.applied == [(4.0, "fd_follow_pipeline")]


def test_current_mode_is_the_one_requested_last(managed: Managed) -> None:
    managed.modes.change_mode(SEARCH, "fd_spiral_low")
    assert managed.modes.current_mode(SEARCH) == "fd_spiral_low" and managed.modes.current_mode(FOLLOW) is None


def test_available_modes_are_those_of_the_file(managed: Managed) -> None:
    assert set(managed.modes.available_modes(SEARCH)) == {
        "__DEFAULT__",
        "fd_unground",
        "fd_spiral_low",
        "fd_spiral_medium",
        "fd_spiral_high",
    }
    assert managed.modes.available_modes("f_dock") == ()


@pytest.mark.parametrize(
    ("requests", "adaptations"),
    [
        (["fd_spiral_low"], 0),
        (["fd_spiral_low", "fd_spiral_low"], 0),
        (["fd_spiral_low", "fd_spiral_high"], 1),
        (["fd_spiral_low", "fd_unground", "fd_spiral_low"], 2),
        (["fd_unground", "fd_spiral_low"], 0),
    ],
    ids=["a first mode", "no change", "a change", "off and on", "off before the first"],
)
def test_adaptations_are_changes_of_functions_in_use(managed: Managed, requests: list[str], adaptations: int) -> None:
    for mode in requests:
        managed.modes.change_mode(SEARCH, mode)
    assert managed.modes.adaptations == adaptations


def test_the_end_of_a_task_is_no_adaptation(managed: Managed) -> None:
    managed.modes.change_mode(SEARCH, "fd_spiral_low")
    managed.modes.end_task([SEARCH])
    managed.modes.change_mode(SEARCH, "fd_unground")
    managed.modes.change_mode(SEARCH, "fd_spiral_high")
    assert managed.modes.adaptations == 0


# The life cycle of a node


class Hooked(FunctionNode):
    """A node that keeps which hooks were called."""

    def __init__(self) -> None:
        super().__init__(simpy.Environment())
        self.calls: list[str] = []

    def configure(self, mode: Mode) -> None:
        self.calls.append(f"configure {mode.name}")

    def activated(self) -> None:
        self.calls.append("activated")

    def deactivated(self) -> None:
        self.calls.append("deactivated")


def calls_of(*modes: Mode) -> list[str]:
    node = Hooked()
    for mode in modes:
        node.apply(mode)
    return node.calls


LOW, HIGH, OFF = Mode("low", True, {}), Mode("high", True, {}), Mode("off", False, {})


@pytest.mark.parametrize(
    ("modes", "calls"),
    [
        ([LOW], ["configure low", "activated"]),
        ([LOW, HIGH], ["configure low", "activated", "configure high"]),
        ([OFF], []),
        ([LOW, OFF, HIGH], ["configure low", "activated", "deactivated", "configure high", "activated"]),
    ],
)
def test_hooks_that_modes_call(modes: list[Mode], calls: list[str]) -> None:
    assert calls_of(*modes) == calls
