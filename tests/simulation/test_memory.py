"""What a mission leaves in memory."""

import gc

from tests.helpers import OUTSIDE
from tests.helpers.outside_managers import Counted

SHORT = {"mission": {"time_limit_s": 2.0}}


def test_a_mission_is_freed_when_the_next_one_begins(simulator) -> None:
    missions = simulator(**SHORT)
    missions.run(f"{OUTSIDE}:Counted", 1, 1)
    gc.collect()
    for run in range(2, 7):
        missions.run(f"{OUTSIDE}:Counted", run, 1)
    assert len(Counted.existing) == 1


def test_what_lives_longer_is_freed_now_and_then(simulator) -> None:
    missions = simulator(**SHORT)
    gc.collect()
    for run in range(1, 1001):
        missions.run(f"{OUTSIDE}:Lingering", run, 1)
    assert len(Counted.existing) < 400
