"""What a process has imported and loaded before its first mission, or its first campaign: modules
and machine code.
"""

import gc

import scipy.special  # noqa: F401

from suave_des.campaign import campaign, missions, progress  # noqa: F401
from suave_des.scenario.loader import load_scenario
from suave_des.simulation.simulator import Simulator

Simulator(load_scenario("seams2023")).run("none", 1, 1)
gc.freeze()  # or each process forked from this one would search all of that for cycles, and copy it thereby
