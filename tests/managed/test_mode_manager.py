"""The mode manager: what it answers, and when modes take effect; and set-points on their way to the
autopilot.
"""

import itertools
import random
from collections.abc import Callable
from types import SimpleNamespace

import pytest
import simpy

from suave_des.managed.mode_manager import ModeManager
from suave_des.managed.node import FunctionNode, SetPointSender
from suave_des.scenario.loader import load_scenario
from suave_des.scenario.modes import Mode
from tests.helpers.stand_ins import Place, silent

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
def test_any_known_mode_is_answered_with_success_at_once(managed, mode):
    assert managed.modes.change_mode(SEARCH, mode) is True and managed.env.now == 0.0


@pytest.mark.parametrize(
    ("function", "mode"),
    [
        (SEARCH, "fd_spiral_very_high"),
        ("f_dock", "fd_spiral_low"),
        ("f_maintain_motion", "fd_all_thrusters"),
    ],
    ids=["unknown mode", "unknown function", "function without a node"],
)
def test_anything_else_is_refused(managed, function, mode):
    assert managed.modes.change_mode(function, mode) is False


def test_a_mode_takes_effect_after_the_latency(managed):
    managed.modes.change_mode(SEARCH, "fd_spiral_low")
    managed.env.run()
    assert managed.search.applied == [(0.5, "fd_spiral_low")]


@pytest.mark.parametrize(
    ("mode", "told"),
    [("fd_spiral_low", [(0.5, SEARCH, "fd_spiral_low")]), ("fd_spiral_very_high", [])],
    ids=["when it takes effect", "not of a refused one"],
)
def test_listeners_are_told_of_a_mode(managed, mode, told):
    effects: list[tuple[float, str, str]] = []
    managed.modes.listeners.append(
        lambda function, mode: effects.append((managed.env.now, function, mode.name))
    )
    managed.modes.change_mode(SEARCH, mode)
    managed.env.run()
    assert effects == told


def test_the_mode_already_asked_for_succeeds_without_effect(managed):
    managed.modes.change_mode(SEARCH, "fd_spiral_low")
    managed.env.run(until=3.0)
    assert managed.modes.change_mode(SEARCH, "fd_spiral_low") is True
    managed.env.run()
    assert len(managed.search.applied) == 1


def test_effects_keep_the_order_of_requests_of_each_function():
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


def test_current_mode_is_the_one_requested_last_of_those_in_the_file(managed):
    managed.modes.change_mode(SEARCH, "fd_spiral_low")
    assert (
        managed.modes.current_mode(SEARCH) == "fd_spiral_low"
        and managed.modes.current_mode(FOLLOW) is None
    )
    assert managed.modes.available_modes(SEARCH) == TABLE.modes(SEARCH)
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
def test_adaptations_are_changes_of_functions_in_use(managed, requests, adaptations):
    for mode in requests:
        managed.modes.change_mode(SEARCH, mode)
    assert managed.modes.adaptations == adaptations


def test_the_end_of_a_task_is_no_adaptation(managed):
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
        (
            [LOW, OFF, HIGH],
            ["configure low", "activated", "deactivated", "configure high", "activated"],
        ),
    ],
)
def test_hooks_that_modes_call(modes, calls):
    assert calls_of(*modes) == calls


def sent(
    count: int, loss_probability: float, frame_error_m: Place = (0.0, 0.0, 0.0)
) -> list[Place]:
    """What arrives of so many set-points."""
    arrived: list[Place] = []
    vehicle = SimpleNamespace(command=lambda t_s, *place: arrived.append(place))
    chance = random.Random(1)
    sender = SetPointSender(vehicle, simpy.Environment(), frame_error_m, loss_probability, chance)
    for n in range(count):
        sender.send(float(n), 0.0, -18.0)
    return arrived


def test_without_loss_every_set_point_arrives():
    assert len(sent(100, 0.0)) == 100


def test_a_lost_set_point_leaves_the_autopilot_with_the_one_before():
    numbers = [int(x) for x, _, _ in sent(20, 0.5)]
    assert numbers == sorted(set(numbers)) and 0 < len(numbers) < 20


@pytest.mark.parametrize("probability", [0.1, 0.6])
def test_share_of_lost_set_points(probability):
    assert 1.0 - len(sent(4000, probability)) / 4000 == pytest.approx(probability, abs=0.03)


def test_frame_error_shifts_every_set_point():
    assert sent(1, 0.0, (0.1, -0.2, 0.3)) == [pytest.approx((0.1, -0.2, -17.7))]
