"""The first start: what has to be compiled then."""

from tests.helpers.command import python

MISSIONS = """
from suave_des import load_scenario
from suave_des.managed.flight import fly
from suave_des.simulation.simulator import Simulator
from suave_des.vehicle.kernel import advance

for name in ("seams2023", "planta_exp1", "extended"):
    simulator = Simulator(load_scenario(name))
    for manager in ("none", "random", "bt"):
        simulator.run(manager, 1, 1)
print(len(fly.signatures), len(advance.signatures))
"""


def test_the_flight_is_compiled_for_one_signature_whatever_is_flown(tmp_path):
    """To compile it again, as for times that are whole numbers, would take seconds."""
    script = tmp_path / "missions.py"
    script.write_text(MISSIONS)
    ended = python(script, cwd=tmp_path)
    assert (ended.stdout, ended.stderr) == ("1 1\n", "")
