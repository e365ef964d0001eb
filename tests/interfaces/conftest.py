import pytest

from suave_des import Simulator, load_scenario


@pytest.fixture(scope="session")
def simulator() -> Simulator:
    return Simulator(load_scenario("seams2023"))
