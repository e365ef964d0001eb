"""A task that ends within a cycle of metacontrol: in 2023 the plan under way is executed all the
same, when that cycle's inference is over.
"""

from typing import ClassVar

import pytest

from suave_des import Simulator, load_scenario
from suave_des.managing.metacontrol import Metacontrol


class Noting(Metacontrol):
    """Notes when its cycles begin, and of which other time it asks for the latency."""

    began_s: ClassVar[set[float]] = set()
    asked_s: ClassVar[list[float]] = []

    def adapt(self):
        self.began_s.add(self.system.now_s)
        return super().adapt()

    def _latency_s(self, began_s):
        if began_s != self.system.now_s:
            self.asked_s.append(began_s)
        return super()._latency_s(began_s)


@pytest.fixture(scope="module")
def missions():
    values = {
        "managers.metacontrol.reasoning_period_s": 0.7,
        "latencies.inference_s": {"distribution": "uniform", "minimum": 0.6, "maximum": 0.69},
        "mission.time_limit_s": 200.0,
    }
    simulator = Simulator(load_scenario("seams2023", values=values))
    for run in range(1, 9):
        simulator.run(Noting, run, seed=1, record=True)
    return Noting


def test_some_task_ends_within_a_cycle(missions):
    assert len(missions.asked_s) > 3


def test_its_latency_is_that_of_a_cycle_that_began(missions):
    assert set(missions.asked_s) <= missions.began_s
