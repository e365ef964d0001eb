"""What a mission leaves in memory."""

import gc
from collections.abc import Iterator

import pytest

from tests.helpers import OUTSIDE
from tests.helpers.outside_managers import Counted

SHORT = {"mission": {"time_limit_s": 2.0}}


@pytest.fixture
def default_thresholds() -> Iterator[None]:
    """Python's own, in place of those that the tests have."""
    thresholds = gc.get_threshold()
    gc.set_threshold(700, 10, 10)
    yield
    gc.set_threshold(*thresholds)


@pytest.mark.usefixtures("default_thresholds")
def test_missions_are_freed_now_and_then(simulator) -> None:
    missions = simulator(**SHORT)
    gc.collect()
    for run in range(1, 1001):
        missions.run(f"{OUTSIDE}:Lingering", run, 1)
    assert len(Counted.existing) < 400
