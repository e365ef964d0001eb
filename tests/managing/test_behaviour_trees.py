"""The behaviour tree managers bt and bt_extended."""

import math

import numpy as np
import pytest

from suave_des.managing.bt import least_that_reaches
from tests.helpers.managers_at_work import FOLLOW, MOTION, SEARCH, AtWork

RECHARGE = "generate_recharge_path"
BOTH_REVISIONS = pytest.mark.parametrize("revision", ["2023", "1.5"])
BOTH_TREES = pytest.mark.parametrize("name", ["bt", "bt_extended"])


def searching(name: str = "bt", revision: str = "1.5", **options: bool) -> AtWork:
    at_work = AtWork(name, revision, **options)
    at_work.request("search_pipeline")
    return at_work


@BOTH_TREES
def test_the_tree_ticks_every_tenth_of_a_second(name):
    manager = AtWork(name).manager
    assert manager.period_s == 0.1 and 0.0 <= manager.starts_s < 0.1


@BOTH_REVISIONS
@BOTH_TREES
@pytest.mark.parametrize(
    ("visibility_m", "mode"),
    [
        (3.75, "fd_spiral_high"),
        (3.25, "fd_spiral_high"),
        (3.249, "fd_spiral_medium"),
        (2.25, "fd_spiral_medium"),
        (2.249, "fd_spiral_low"),
        (1.25, "fd_spiral_low"),
        (0.5, "fd_spiral_low"),
    ],
)
def test_search_is_as_high_as_the_visibility_allows(name, revision, visibility_m, mode):
    at_work = searching(name, revision)
    at_work.measured("water_visibility", visibility_m)
    assert (SEARCH, mode) in at_work.adapt()


@BOTH_TREES
def test_a_visibility_not_yet_measured_counts_as_good(name):
    assert (SEARCH, "fd_spiral_high") in searching(name).adapt()


@BOTH_REVISIONS
@BOTH_TREES
@pytest.mark.parametrize(
    ("reports", "mode"),
    [
        ([], "fd_all_thrusters"),
        ([(1, "FALSE")], "fd_recover_thrusters"),
        ([(1, "FALSE"), (4, "FALSE"), (1, "RECOVERED")], "fd_recover_thrusters"),
        ([(4, "FALSE"), (4, "RECOVERED")], "fd_all_thrusters"),
    ],
)
def test_thrusters_are_recovered_while_one_is_lost(name, revision, reports, mode):
    at_work = searching(name, revision)
    for report in reports:
        at_work.reported(*report)
    assert (MOTION, mode) in at_work.adapt()


def test_a_failure_from_before_the_task_is_not_forgotten():
    at_work = AtWork("bt")
    at_work.reported(1, "FALSE")
    at_work.request("search_pipeline")
    assert (MOTION, "fd_recover_thrusters") in at_work.adapt()


@BOTH_REVISIONS
@BOTH_TREES
def test_after_the_search_it_follows(name, revision):
    at_work = searching(name, revision)
    at_work.cancel("search_pipeline")
    at_work.request("inspect_pipeline")
    asked = dict(at_work.adapt())
    assert asked[FOLLOW] == "fd_follow_pipeline" and SEARCH not in asked


def test_before_any_task_revision_15_asks_for_nothing():
    assert AtWork("bt", "1.5").adapt() == []


def test_in_2023_maintain_motion_is_kept_between_tasks():
    at_work = searching("bt", "2023")
    at_work.cancel("search_pipeline")
    assert at_work.adapt() == [(MOTION, "fd_all_thrusters")]


# The extended tree


def with_battery(level: float | None = None) -> AtWork:
    at_work = searching("bt_extended", battery=True)
    if level is not None:
        at_work.measured("battery_level", level)
    return at_work


@pytest.mark.parametrize(
    ("level", "search", "recharge"),
    [
        (None, "fd_spiral_high", None),
        (0.25, "fd_spiral_high", None),
        (0.2475, "fd_unground", "normal"),
    ],
)
def test_with_a_low_battery_it_goes_to_recharge(level, search, recharge):
    asked = dict(with_battery(level).adapt())
    assert (asked[SEARCH], asked.get(RECHARGE)) == (search, recharge)


def test_recharging_still_recovers_thrusters():
    at_work = with_battery(0.2)
    at_work.reported(2, "FALSE")
    assert (MOTION, "fd_recover_thrusters") in at_work.adapt()


@pytest.fixture
def recharged() -> dict[str, str]:
    """What is asked for once a battery that was low is full again."""
    at_work = with_battery(0.2)
    at_work.adapt()
    at_work.measured("battery_level", 1.0)
    return dict(at_work.adapt())


def test_recharged_it_goes_on(recharged):
    assert recharged[SEARCH] == "fd_spiral_high"


def test_recharged_it_ends_the_way_to_the_station(recharged):
    assert recharged[RECHARGE] == "inactive"


@pytest.mark.parametrize(
    ("level", "recharges"),
    [(0.24999999999999933, False), (0.24999999254941940, False), (0.2499999925494193, True)],
)
def test_it_compares_the_battery_s_level_in_single_precision(level, recharges):
    """As std::stof reads it: the number between is halfway to the next lower one, 0.24999999."""
    assert (RECHARGE in dict(with_battery(level).adapt())) == recharges


@pytest.mark.parametrize("threshold", [0.25, 0.1, 0.3, 3.25, -0.25, 1e-3])
def test_a_threshold_in_single_precision(threshold):
    least = least_that_reaches(threshold)
    assert np.float32(least) >= np.float32(threshold)
    assert np.float32(math.nextafter(least, -math.inf)) < np.float32(threshold)


def test_following_is_interrupted_by_a_low_battery_too():
    at_work = with_battery()
    at_work.cancel("search_pipeline")
    at_work.request("inspect_pipeline")
    at_work.measured("battery_level", 0.1)
    assert (FOLLOW, "fd_unground") in at_work.adapt()


@pytest.mark.parametrize(("name", "has_battery"), [("bt_extended", False), ("bt", True)])
def test_without_a_battery_or_as_the_plain_tree_it_never_recharges(name, has_battery):
    at_work = searching(name, battery=has_battery)
    at_work.measured("battery_level", 0.1)
    asked = dict(at_work.adapt())
    assert asked[SEARCH] == "fd_spiral_high" and RECHARGE not in asked
