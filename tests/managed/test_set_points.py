"""Set-points on their way to the autopilot: lost messages and frame errors."""

import random

import pytest
import simpy

from suave_des.managed.node import SetPointSender
from tests.helpers.stand_ins import Place, PlacedVehicle


def sent(count: int, loss_probability: float, frame_error_m: Place = (0.0, 0.0, 0.0)) -> list[Place]:
    """What arrives of so many set-points."""
    vehicle = PlacedVehicle()
    sender = SetPointSender(vehicle, simpy.Environment(), frame_error_m, loss_probability, random.Random(1))
    for n in range(count):
        sender.send(float(n), 0.0, -18.0)
    return vehicle.commanded


def test_without_loss_every_set_point_arrives() -> None:
    assert len(sent(100, 0.0)) == 100


def test_a_lost_set_point_leaves_the_autopilot_with_the_one_before() -> None:
    numbers = [int(x) for x, _, _ in sent(20, 0.5)]
    assert numbers == sorted(set(numbers)) and 0 < len(numbers) < 20


@pytest.mark.parametrize("probability", [0.1, 0.6])
def test_share_of_lost_set_points(probability: float) -> None:
    assert 1.0 - len(sent(4000, probability)) / 4000 == pytest.approx(probability, abs=0.03)


def test_frame_error_shifts_every_set_point() -> None:
    assert sent(1, 0.0, (0.1, -0.2, 0.3)) == [pytest.approx((0.1, -0.2, -17.7))]
