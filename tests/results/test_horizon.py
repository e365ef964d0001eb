"""Missions that end without the pipeline are censored: their times count up to a horizon that all
have in common, and none of them is sooner than another.
"""

from pathlib import Path

import pandas
import pytest

from suave_des.campaign.campaign import run_campaign
from suave_des.results.compare import compare_folders
from suave_des.results.comparison import Comparison
from tests.helpers.compared import compare_frame, difference, row, rows

TIMES_S = [80.0, 95.0, 120.0, 149.0, 160.0, 180.0, 220.0, 400.0, 400.0, 400.0]
"""When the pipeline would be found."""
LATER_S = [time_s + 10.0 for time_s in TIMES_S]


def missions(
    manager: str, times_s: list[float], limit_s: float, written_s: float
) -> pandas.DataFrame:
    """Missions that find the pipeline at given times, unless that is after a time limit; for others
    a file has `written_s`.
    """
    found = [time_s <= limit_s for time_s in times_s]
    known_s = [
        time_s if is_found else written_s for time_s, is_found in zip(times_s, found, strict=True)
    ]
    frame = pandas.DataFrame({"search_time_s": known_s, "pipeline_found": found})
    return frame.assign(
        manager=manager, run=range(1, len(frame) + 1), seed=1, distance_inspected_m=1.0
    )


def compared(*frames: pandas.DataFrame, unpaired: bool = False) -> Comparison:
    return compare_frame(pandas.concat(frames), metrics=["search_time_s"], unpaired=unpaired)


@pytest.mark.parametrize("unpaired", [False, True])
def test_lost_missions_are_equal_whatever_time_a_file_has_for_them(unpaired):
    frames = missions("real", TIMES_S, 250.0, 250.0), missions("copy", TIMES_S, 250.0, 251.0)
    found = difference(compared(*frames, unpaired=unpaired), "real", "copy")
    assert (found.difference, found.p) == (0.0, 1.0)
    assert found.share_greater == found.share_less


def test_in_a_pair_of_lost_missions_neither_is_greater():
    frames = missions("real", TIMES_S, 250.0, 250.0), missions("copy", TIMES_S, 250.0, 251.0)
    found = difference(compared(*frames), "real", "copy")
    assert (found.share_greater, found.share_less) == (0.0, 0.0)


def test_missions_with_different_limits_are_compared_up_to_the_shorter_one():
    comparison = compared(
        missions("short", TIMES_S, 150.0, 150.0), missions("long", LATER_S, 300.0, 300.0)
    )
    short, long = rows(comparison.summaries)
    assert (short.horizon_s, long.horizon_s) == (150.0, 150.0)
    assert short.mean == pytest.approx((80 + 95 + 120 + 149 + 6 * 150) / 10)
    assert long.mean == pytest.approx((90 + 105 + 130 + 7 * 150) / 10)
    assert any("time limits differ (long had more time)" in note for note in comparison.notes)


def test_time_limits_that_make_no_difference_before_the_shorter_one_are_not_told_apart():
    frames = missions("short", TIMES_S, 150.0, 150.0), missions("long", TIMES_S, 300.0, 300.0)
    comparison = compared(*frames)
    assert difference(comparison, "short", "long").difference == 0.0
    assert "sooner" not in comparison.conclusion


def aborting(ended_s: float, *, has_duration: bool) -> Comparison:
    """Compare one that aborts half of its missions with one that needs 10 s longer."""
    hasty = missions("hasty", [90.0, 400.0, 92.0, 400.0, 94.0, 400.0] * 4, 300.0, ended_s)
    slow = missions("slow", [100.0, 101.0, 102.0, 103.0, 104.0, 105.0] * 4, 300.0, ended_s)
    frame = pandas.concat([hasty, slow], ignore_index=True)
    if has_duration:
        duration_s = frame["search_time_s"].where(~frame["pipeline_found"], 300.4)
        frame = frame.assign(scenario="s", mission_duration_s=duration_s)
    return compare_frame(frame, metrics=["search_time_s"])


def test_missions_that_are_aborted_count_with_the_time_limit():
    comparison = aborting(20.0, has_duration=True)
    assert row(comparison.summaries, group="hasty").mean == pytest.approx((92.0 + 300.0) / 2)
    assert comparison.conclusion.startswith("slow finds the pipeline 93.50 s sooner than hasty")
    assert any("hasty after 20 s), which is no short search" in note for note in comparison.notes)


def test_without_a_time_limit_means_with_aborted_missions_are_not_compared():
    comparison = aborting(20.0, has_duration=False)
    found = difference(comparison, "hasty", "slow")
    assert found.difference is None
    assert found.share_less == found.share_greater == 0.5
    assert comparison.conclusion.startswith(
        "The mean search time of hasty and slow cannot be compared, as no time limit is known."
    )
    assert "By ranks, slow finds the pipeline sooner than hasty" in comparison.conclusion


def test_a_find_after_the_horizon_is_no_find_by_then():
    comparison = compared(
        missions("short", TIMES_S, 150.0, 150.0), missions("long", TIMES_S, 300.0, 300.0)
    )
    assert row(comparison.summaries, group="long").censored_median_s is None
    assert comparison.conclusion.startswith(
        "The pipeline was not found by short in 6 of 10 missions, long in 6 of 10 missions, which have 150 s as their"
    )


def test_missions_that_never_saw_the_pipeline_are_censored_in_the_time_of_detection():
    careful = missions("careful", [100.0, 110.0, 120.0, 130.0], 300.0, 300.0)
    hasty = missions("hasty", [90.0, 400.0, 400.0, 400.0], 300.0, 300.0)
    frame = pandas.concat([careful, hasty]).assign(scenario="s")
    frame["detection_time_s"] = frame["search_time_s"].where(frame["pipeline_found"])
    found = difference(
        compare_frame(frame, metrics=["detection_time_s"]), "careful", "hasty", "detection_time_s"
    )
    assert (found.n, found.difference) == (4, pytest.approx(115.0 - (90.0 + 3 * 300.0) / 4))


def test_points_of_a_sweep_over_the_limit_are_averaged_up_to_the_shortest():
    frame = pandas.concat(
        missions("a", TIMES_S, limit_s, limit_s).assign(**{"mission.time_limit_s": limit_s})
        for limit_s in (150.0, 300.0)
    )
    (found,) = rows(compare_frame(frame, metrics=["search_time_s"]).summaries)
    assert found.mean == pytest.approx((80 + 95 + 120 + 149 + 6 * 150) / 10)


def test_managers_at_points_with_different_limits_are_compared_up_to_the_limit_of_each():
    frame = pandas.concat(
        missions(name, times_s, limit_s, limit_s).assign(**{"mission.time_limit_s": limit_s})
        for name, times_s in (("a", TIMES_S), ("b", LATER_S))
        for limit_s in (150.0, 300.0)
    )
    by = ["mission.time_limit_s"]
    comparison = compare_frame(frame, metrics=["search_time_s"], by=by)
    horizons_s = [each.horizon_s for each in rows(comparison.summaries)]
    assert sorted(horizons_s) == [150.0, 150.0, 300.0, 300.0]
    assert not any("time limits differ" in note for note in comparison.notes)


@pytest.fixture(scope="module")
def with_empty_batteries(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A campaign in which the battery ends most missions of none at 116 s."""
    folder = tmp_path_factory.mktemp("battery")
    battery = "base: extended.yaml\nbattery: {mission_ends_at_level: 0.0, discharge_time_s: 116}\n"
    (folder / "empty.yaml").write_text(battery)
    managers = ["none", "bt_extended"]
    run_campaign(folder / "empty.yaml", managers, 5, 1, out=folder / "out", suave_format=True)
    return folder / "out"


@pytest.mark.parametrize("managers", [["none", "bt_extended"], ["none"]])
def test_an_empty_battery_means_the_same_in_files_of_either_format(with_empty_batteries, managers):
    ours, theirs = (
        rows(compare_folders([folder], managers=managers, metrics=["search_time_s"]).summaries)
        for folder in (with_empty_batteries, with_empty_batteries / "suave")
    )
    horizon_s = 300.0 if len(managers) == 2 else 116.0
    found = {each.group: (each.horizon_s, each.mean, each.restricted_mean_s) for each in ours}
    assert found == {
        each.group: (each.horizon_s, each.mean, each.restricted_mean_s) for each in theirs
    }
    assert found["none"][0] == horizon_s


def test_a_limit_that_a_file_states_counts_though_all_missions_ended_earlier(tmp_path):
    lines = ["manager,run,time_limit_s,search_time_s,pipeline_found,distance_inspected_m"]
    lines += [f"a,{run},300,{40 + run},False,0" for run in range(1, 4)]
    (tmp_path / "real.csv").write_text("\n".join(lines) + "\n")
    (found,) = rows(compare_folders([tmp_path / "real.csv"], metrics=["search_time_s"]).summaries)
    assert (found.horizon_s, found.mean) == (300.0, 300.0)
