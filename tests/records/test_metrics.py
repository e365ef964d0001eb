"""The metrics of missions: their cells, and how tables and sentences write them."""

import math
from dataclasses import fields, replace

import pytest

from suave_des import Mission
from suave_des.estimates import Estimate
from suave_des.metrics.result import MissionMetrics
from suave_des.records.metrics import COLUMNS, METRICS, further_of, metric_of, row_of

SEARCH_TIME, FOUND = METRICS["search_time_s"], METRICS["pipeline_found"]


@pytest.fixture(scope="module")
def result():
    return Mission("seams2023", "none").result()


def test_a_row_has_a_cell_for_each_field_of_the_metrics(result):
    assert tuple(field.name for field in fields(MissionMetrics)) == COLUMNS


def test_its_cells_are_rounded_to_six_decimals(result):
    row = row_of(replace(result.metrics, search_time_s=87.123456789))
    assert row[COLUMNS.index("search_time_s")] == 87.123457


def test_further_cells_are_rounded_likewise(result):
    assert further_of(replace(result, further={"depth_m": 0.123456789})) == (0.123457,)


def test_a_share_is_written_in_per_cent():
    assert FOUND.number(0.535).endswith("%")
    assert float(FOUND.number(0.535).rstrip("%")) == pytest.approx(53.5, abs=0.5)


@pytest.mark.parametrize("missing", [None, math.nan])
def test_a_missing_value_is_empty(missing):
    assert SEARCH_TIME.number(missing) == ""


def test_a_difference_of_shares_is_in_percentage_points():
    assert FOUND.amount(0.167).endswith(" percentage points")


def test_a_difference_has_the_unit_of_the_metric():
    assert SEARCH_TIME.amount(39.9) == "39.90 s"


def test_a_heading_has_the_unit():
    assert SEARCH_TIME.heading.endswith(" (s)")


def test_a_metric_without_a_unit_has_none_in_its_heading():
    assert "(" not in METRICS["adaptations"].heading


def test_an_interval_that_is_not_known_is_empty():
    assert SEARCH_TIME.interval(Estimate(100.0, math.nan, math.nan)) == ""


def test_a_requirement_is_a_metric_of_which_more_is_better():
    metric = metric_of("requirement_depth")
    assert metric is not None
    assert (metric.title, metric.better) == ("satisfaction of depth", 1)


def test_a_swept_value_is_none():
    assert metric_of("signals.water_visibility.period_s") is None


def test_a_metric_of_which_one_direction_is_better_has_the_words_to_say_so():
    metrics = [*METRICS.values(), metric_of("requirement_depth")]
    assert all(each.less and each.more and each.most for each in metrics if each.better)
