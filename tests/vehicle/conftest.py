from collections.abc import Callable

import pytest

from suave_des.vehicle.model import Autopilot, Pose
from suave_des.vehicle.vehicle import Vehicle
from tests.helpers.stand_ins import BLUEROV2

START = Pose(0.0, 0.0, -18.0, 0.0, 0.0, 0.0)
MakeVehicle = Callable[..., Vehicle]


@pytest.fixture(scope="session")
def make_vehicle() -> MakeVehicle:
    """Makes a BlueROV2 at (0, 0, -18), at rest, unless told otherwise; `lost` thrusters give no
    thrust from t = 0.
    """

    def make(
        start: Pose = START,
        duration_s: float = 150.0,
        *,
        lost: tuple[int, ...] = (),
        **options: object,
    ) -> Vehicle:
        vehicle = Vehicle(BLUEROV2, Autopilot(), start, duration_s, **options)  # type: ignore[arg-type]
        for thruster in lost:
            vehicle.set_thruster(0.0, thruster, "dead")
        return vehicle

    return make
