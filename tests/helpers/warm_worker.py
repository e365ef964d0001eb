"""What a process has imported and loaded before its first mission: modules and machine code."""

import suave_des.cli.main  # noqa: F401
from suave_des.campaign.executors import mission_runner  # noqa: F401
from suave_des.scenario.loader import load_scenario
from suave_des.simulation.simulator import Simulator

Simulator(load_scenario("seams2023")).run("none", 1, 1)
