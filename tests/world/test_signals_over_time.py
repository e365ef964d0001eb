"""Signals: what they are at a mission time."""

import pytest

from suave_des.world.signals import constant, sinusoid, step, table

PAPER = sinusoid(80.0, 1.25, 3.75)


@pytest.mark.parametrize(
    ("t_s", "value"), [(0.0, 3.75), (20.0, 2.5), (40.0, 1.25), (60.0, 2.5), (80.0, 3.75), (240.0, 3.75)]
)
def test_sinusoid_starts_at_its_maximum(t_s: float, value: float) -> None:
    assert PAPER(t_s) == pytest.approx(value)


def test_shift_moves_the_sinusoid_to_earlier_times() -> None:
    assert sinusoid(80.0, 1.25, 3.75, shift_s=30.0)(10.0) == pytest.approx(1.25)


def test_constant_never_changes() -> None:
    assert constant(2.0)(0.0) == constant(2.0)(1e6) == 2.0


def test_step_has_its_new_value_from_its_time_on() -> None:
    signal = step(10.0, 3.0, 1.0)
    assert [signal(9.999), signal(10.0), signal(11.0)] == [3.0, 1.0, 1.0]


TIMES, VALUES = (0.0, 10.0, 20.0), (1.0, 3.0, 2.0)


@pytest.mark.parametrize(("t_s", "value"), [(-5.0, 1.0), (0.0, 1.0), (9.9, 1.0), (10.0, 3.0), (19.0, 3.0), (99.0, 2.0)])
def test_table_keeps_the_value_before(t_s: float, value: float) -> None:
    assert table(TIMES, VALUES)(t_s) == value


@pytest.mark.parametrize(
    ("t_s", "value"), [(-5.0, 1.0), (5.0, 2.0), (10.0, 3.0), (15.0, 2.5), (20.0, 2.0), (99.0, 2.0)]
)
def test_linear_table_draws_straight_lines(t_s: float, value: float) -> None:
    assert table(TIMES, VALUES, linear=True)(t_s) == pytest.approx(value)
