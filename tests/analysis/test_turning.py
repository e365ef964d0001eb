"""Variants of the kernel in analysis/turning.py: each turns and restarts as its constants say."""

import importlib
import math
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pandas
import pytest

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "analysis"


@pytest.fixture
def turning(monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    monkeypatch.syspath_prepend(str(FOLDER))
    return importlib.import_module("turning")


def kernel(turning: ModuleType, variant: str) -> dict[str, Any]:
    """Load a variant's kernel as plain Python."""
    text = (ROOT / turning.KERNEL).read_text(encoding="utf-8")
    text = turning.edited(text, turning.VARIANTS[variant].edits).replace("@compiled\n", "")
    names: dict[str, Any] = {"__name__": "suave_des.vehicle.kernel"}
    exec(compile(text.replace("@record\n", ""), "kernel", "exec"), names)
    return names


def test_every_variant_is_made_of_the_present_kernel(turning):
    for variant in turning.VARIANTS:
        assert "advance" in kernel(turning, variant)


@pytest.mark.parametrize("length", [0.02, 0.1, 0.3, 2.0])
def test_a_leg_ends_at_its_length_with_continuous_speed(turning, length):
    found = kernel(turning, "(c) S-curve")
    quarter, ramp, jerk = found["s_curve"](length)
    top = jerk * (quarter - ramp) * quarter
    distance, step = 0.0, quarter / 500.0
    for number in range(2000):  # the midpoint rule over the speed gives the distance
        time = (number + 0.5) * step
        here, speed = found["along_leg"](time, length, quarter, ramp, jerk, top)
        assert here == pytest.approx(distance + 0.5 * step * speed, abs=1e-5 * length)
        distance += step * speed
    assert distance == pytest.approx(length, rel=1e-4)


def test_a_leg_of_half_a_metre_takes_four_times_its_quarter(turning):
    quarter, ramp, jerk = kernel(turning, "(c) S-curve")["s_curve"](0.5)
    # jerk 1 m/s3, ramps of 0.3 s: 0.5 = 2 T^2 (T - 0.3)
    assert (ramp, jerk) == (0.3, 1.0)
    assert 2.0 * quarter**2 * (quarter - 0.3) == pytest.approx(0.5, rel=1e-9)


def test_the_yaw_rate_for_an_error_is_that_of_the_square_root_controller(turning):
    demanded = kernel(turning, "(a) heading slew")["demanded_rate"]
    assert demanded(math.radians(-2.0)) == pytest.approx(math.radians(-12.0))
    # sqrt(2 x 120 x (20 - 120 / 36 / 2)) degrees/s
    assert demanded(math.radians(20.0)) == pytest.approx(math.radians(math.sqrt(4400.0)))


@pytest.fixture
def tried(turning) -> list[dict[str, float]]:
    """Sets of values that are tried for a variant."""
    return turning.sets_of_values(turning.VARIANTS["(c), (d) target waits"])


def test_the_shipped_values_are_tried_first(tried):
    assert tried[0] == {}


def test_so_many_other_sets_of_values_are_tried(turning, tried):
    assert len(tried[1:]) == turning.SETS


def test_values_that_are_tried_are_within_their_bounds(turning, tried):
    for path, value in [item for values in tried[1:] for item in values.items()]:
        lower, upper = turning.BOUNDS[path]
        assert lower <= value <= upper


def test_the_jerk_that_a_variant_fixes_is_not_tried(turning, tried):
    assert not [values for values in tried[1:] if turning.JERK in values]


def test_values_of_ardusub_are_held_while_others_are_chosen(turning):
    sets = turning.sets_of_values(turning.VARIANTS["(b), (c)"])
    assert {values[turning.GAIN] for values in sets} == {turning.ARDUSUB_GAIN}
    assert len({values.get(turning.HEADING) for values in sets}) == 1 + turning.SETS


BARS = ["means", "medians", "2023", "spread", "spread without losses", "CPU"]


@pytest.mark.parametrize(
    "change, missed",
    [
        ({}, []),
        ({"means_met": 7}, ["means"]),
        ({"medians_apart_s": 2.25}, ["medians"]),
        ({"met_2023": 27}, ["2023"]),
        ({"single_met_2023": 17}, ["2023"]),
        ({"spread_of_none_m": 5.9}, ["spread"]),
        ({"spread_without_losses_m": 5.9}, ["spread without losses"]),
        ({"cpu_ratio": 1.06}, ["CPU"]),
    ],
)
def test_a_bar_is_met_if_it_is_with_the_values_of_either_half(turning, change, missed):
    good = {"variant": "a", "means_met": 8, "means": 8, "medians_apart_s": 2.0}
    good |= {"met_2023": 28, "targets_2023": 28, "single_met_2023": 18, "single_2023": 18}
    good |= {"spread_without_losses_m": 6.0, "spread_of_none_m": 9.0, "cpu_ratio": 1.05}
    met = turning.bars(pandas.DataFrame([good, good | change])).loc["a"]
    assert [name for name in BARS if not met[name]] == missed


def test_the_committed_conclusion_is_of_the_committed_table(turning):
    rows = pandas.read_csv(FOLDER / "turning" / "turning.csv")
    halves = [" ".join(map(str, half)) for half in turning.HALVES]
    expected = [(name, half) for name in turning.VARIANTS for half in halves]
    assert list(zip(rows["variant"], rows["chosen_on"], strict=True)) == expected
    assert (FOLDER / "turning" / "conclusion.md").read_text(
        encoding="utf-8"
    ).strip() == turning.conclude(rows).strip()
