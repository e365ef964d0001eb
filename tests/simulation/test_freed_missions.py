"""A mission that is over is freed at once, and not by the garbage collector, whose search through
all that a campaign keeps takes longer than some missions.
"""

import gc
import weakref

import pytest

from suave_des import Simulator, load_scenario
from suave_des.simulation.mission import Mission


@pytest.mark.parametrize("scenario", ["seams2023", "release15", "extended"])
@pytest.mark.parametrize("manager", ["none", "random", "threshold", "metacontrol"])
def test_nothing_refers_to_the_manager_of_a_closed_mission(scenario, manager):
    mission = Mission(Simulator(load_scenario(scenario)), manager)
    gc.disable()
    try:
        mission.result()
        managing = weakref.ref(mission.manager)
        mission.close()
        del mission
        assert managing() is None
    finally:
        gc.enable()
