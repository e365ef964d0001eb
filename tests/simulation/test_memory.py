"""What a mission leaves in memory."""

import gc

from tests.helpers import OUTSIDE
from tests.helpers.outside_managers import Counted

SHORT = {"mission": {"time_limit_s": 2.0}}


def test_missions_are_freed_now_and_then(simulator) -> None:
    missions = simulator(**SHORT)
    gc.collect()
    for run in range(1, 1001):
        missions.run(f"{OUTSIDE}:Lingering", run, 1)
    assert len(Counted.existing) < 400
