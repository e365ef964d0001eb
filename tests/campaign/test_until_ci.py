"""A campaign stops a manager when its mean is known well enough, always at the same run."""

from __future__ import annotations

import csv
import json
import random
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks import chaos
from suave_des.campaign.campaign import CampaignInterrupted, Progress, resume_campaign, run_campaign
from suave_des.campaign.missions import COLUMNS, MissionFailure, MissionOutcome
from suave_des.campaign.progress import GroupTracker, OnProgress
from suave_des.campaign.stopping import FEWEST_RUNS, METRICS
from suave_des.errors import InputError
from suave_des.estimates import RunningMean, estimate
from tests.helpers import AWKWARD

LIMIT = "initial_y_m:0.002"
"""Of a drawn start position, so that missions may be short: reached after some eighty runs."""
FILES = ("runs.csv", "summary.csv", "manifest.json")


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    path = tmp_path / "short.yaml"
    path.write_text(chaos.SHORT)
    return path


def row(value: float | None) -> MissionOutcome:
    return tuple(value if column == "search_time_s" else None for column in COLUMNS)


def rows_of(folder: Path) -> list[dict[str, str]]:
    with (folder / "runs.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def files_of(folder: Path) -> dict[str, bytes]:
    return {name: (folder / name).read_bytes() for name in FILES}


class TestGroupTracker:
    @given(
        st.lists(st.one_of(st.none(), st.just("failed"), st.floats(0.0, 300.0)), min_size=1, max_size=60),
        st.floats(0.5, 80.0),
        st.randoms(use_true_random=False),
    )
    def test_stops_after_the_first_run_with_a_narrow_interval_in_whatever_order_outcomes_come(
        self, values: list[float | str | None], half_width: float, chance: random.Random
    ) -> None:
        outcomes = [
            MissionFailure("none", 1, None, "failed") if value == "failed" else row(value)  # type: ignore[arg-type]
            for value in values
        ]
        last = len(values)
        for run in range(1, len(values) + 1):
            known = [value for value in values[:run] if isinstance(value, float)]
            if len(known) >= FEWEST_RUNS:
                low, high = estimate(known).mean_interval or (0.0, 0.0)
                if abs((high - low) / 2.0 - half_width) < 1e-9:
                    return  # too close to say which of two ways to sum is right
                if (high - low) / 2.0 < half_width:
                    last = run
                    break
        tracker = GroupTracker(len(values), "search_time_s", half_width)
        order = list(range(1, len(values) + 1))
        chance.shuffle(order)
        for run in order:
            tracker.add(run, outcomes[run - 1])
        assert (tracker.runs, tracker.done) == (last, last)
        assert tracker.failed == values[:last].count("failed")

    def test_does_not_stop_before_the_twentieth_value_however_narrow_the_interval_is(self) -> None:
        tracker = GroupTracker(50, "search_time_s", 5.0)
        for run in range(1, 51):
            tracker.add(run, row(100.0 + 0.001 * (run % 2)))
        assert tracker.runs == 20

    def test_a_run_that_comes_twice_counts_once(self) -> None:
        tracker = GroupTracker(5, "search_time_s", None)
        for run in (2, 2, 1, 1, 2, 3):
            tracker.add(run, row(10.0 * run))
        assert (tracker.done, tracker.values.n, tracker.values.mean) == (3, 3, 20.0)


@given(st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=50))
def test_running_sums_give_what_the_whole_sample_gives(values: list[float]) -> None:
    running = RunningMean()
    for value in values:
        running.add(value)
    whole = estimate(values)
    assert whole.mean_interval is not None
    assert running.mean == pytest.approx(whole.mean, rel=1e-9, abs=1e-6)
    low, high = whole.mean_interval
    assert running.half_width == pytest.approx((high - low) / 2.0, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 3))])
@pytest.mark.usefixtures("quick_workers")
def test_the_same_bytes_on_any_number_of_workers_and_after_any_interruption(
    seed: int, scenario: Path, tmp_path: Path
) -> None:
    managers = ["none", "random"]
    run_campaign(scenario, managers, 400, seed, 1, tmp_path / "one", until_ci=LIMIT)
    whole = files_of(tmp_path / "one")
    run_campaign(scenario, managers, 400, seed, 2, tmp_path / "two", until_ci=LIMIT)
    assert files_of(tmp_path / "two") == whole

    chance = random.Random(seed)

    def ctrl_c(progress: Progress) -> None:
        if chance.random() < 0.02:
            raise KeyboardInterrupt

    out = tmp_path / "stopped"
    times = 0
    try:
        run_campaign(scenario, managers, 400, seed, 1, out, until_ci=LIMIT, on_progress=ctrl_c)
    except CampaignInterrupted:
        while times < 20:
            times += 1
            try:
                resume_campaign(out, 1, on_progress=ctrl_c)
            except CampaignInterrupted:
                continue
            break
    resume_campaign(out)
    assert files_of(out) == whole

    rows = rows_of(out)
    for manager in managers:
        starts = [float(each["initial_y_m"]) for each in rows if each["manager"] == manager]
        assert FEWEST_RUNS <= len(starts) < 400
        low, high = estimate(starts).mean_interval or (0.0, 0.0)
        assert (high - low) / 2.0 < 0.002
        if len(starts) > FEWEST_RUNS:
            low, high = estimate(starts[:-1]).mean_interval or (0.0, 0.0)
            assert (high - low) / 2.0 >= 0.002


def test_killed_at_random_moments_the_bytes_are_the_same(scenario: Path, tmp_path: Path) -> None:
    out, limit = tmp_path / "out", "initial_y_m:0.001"
    run_campaign(scenario, ["none", "random"], 5000, 1, out=tmp_path / "whole", until_ci=limit)

    def run(resumes: bool, on_progress: OnProgress) -> None:
        if resumes:
            resume_campaign(out, on_progress=on_progress)
        else:
            run_campaign(scenario, ["none", "random"], 5000, 1, out=out, until_ci=limit, on_progress=on_progress)

    done = chaos.survive_forked(5, random.Random(3), run, out)
    resume_campaign(out)
    assert max(done) > 0
    assert done == sorted(done)
    assert files_of(out) == files_of(tmp_path / "whole")


def test_failed_missions_do_not_count_and_the_manifest_says_where_each_manager_ended(tmp_path: Path) -> None:
    manager = f"{AWKWARD}:RaisesInHalf"
    result = run_campaign("seams2023", [manager, "none"], 60, 1, out=tmp_path / "out", until_ci="initial_y_m:0.003")
    raises, none = json.loads((tmp_path / "out" / "manifest.json").read_text())["until_ci"]["managers"]
    assert none["why"] == "the interval is narrow"
    assert none["n"] == none["last_run"] < 60
    rows = [each for each in rows_of(tmp_path / "out") if each["manager"] == manager]
    assert raises["n"] == len(rows) >= FEWEST_RUNS
    failed = [failure.run for failure in result.failures]
    assert raises["last_run"] == raises["n"] + len(failed)
    assert max(failed) <= raises["last_run"]
    assert (result.done + len(result.failures), result.planned) == (raises["last_run"] + none["last_run"],) * 2


def test_a_limit_that_is_not_reached_is_reported(scenario: Path, tmp_path: Path) -> None:
    result = run_campaign(scenario, ["none"], 25, 1, out=tmp_path / "out", until_ci="initial_y_m:0.00001")
    told = json.loads((tmp_path / "out" / "manifest.json").read_text())["until_ci"]
    assert told["managers"][0]["why"] == "all runs are done"
    assert told["managers"][0]["half_width"] > 0.00001
    assert (result.done, result.stops[0].is_narrow) == (25, False)


class TestResuming:
    def test_with_more_runs_goes_on_where_the_limit_was_not_reached(self, scenario: Path, tmp_path: Path) -> None:
        run_campaign(scenario, ["none", "random"], 30, 1, out=tmp_path / "out", until_ci="initial_y_m:0.002")
        resume_campaign(tmp_path / "out", runs=400)
        run_campaign(scenario, ["none", "random"], 400, 1, out=tmp_path / "whole", until_ci="initial_y_m:0.002")
        assert files_of(tmp_path / "out") == files_of(tmp_path / "whole")

    def test_with_a_narrower_interval_adds_runs(self, scenario: Path, tmp_path: Path) -> None:
        run_campaign(scenario, ["none"], 400, 1, out=tmp_path / "out", until_ci="initial_y_m:0.003")
        before = rows_of(tmp_path / "out")
        resume_campaign(tmp_path / "out", until_ci="initial_y_m:0.002")
        run_campaign(scenario, ["none"], 400, 1, out=tmp_path / "whole", until_ci="initial_y_m:0.002")
        after = rows_of(tmp_path / "out")
        assert files_of(tmp_path / "out") == files_of(tmp_path / "whole")
        assert after[: len(before)] == before
        assert len(after) > len(before)

    @pytest.mark.parametrize(
        ("before", "now", "words"),
        [
            ("initial_y_m:0.002", "initial_y_m:0.003", r"until_ci.half_width was 0.002, and is now 0.003"),
            ("initial_y_m:0.002", "initial_x_m:0.002", r"until_ci.metric was 'initial_y_m', and is now 'initial_x_m'"),
            (None, "initial_y_m:0.002", r"until_ci was .*, and is now .*"),
        ],
    )
    def test_with_another_limit_is_refused(
        self, before: str | None, now: str, words: str, scenario: Path, tmp_path: Path
    ) -> None:
        run_campaign(scenario, ["none"], 25, 1, out=tmp_path / "out", until_ci=before)
        files = files_of(tmp_path / "out")
        with pytest.raises(InputError, match=words):
            resume_campaign(tmp_path / "out", until_ci=now)
        assert files_of(tmp_path / "out") == files


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("search_time_s", r"no colon in it \(give METRIC:HALF_WIDTH, for instance search_time_s:5\)"),
        ("search_time:5", r"no metric 'search_time' \(did you mean search_time_s\? there are .*distance_inspected_m"),
        ("manager:5", r"no metric 'manager' \(there are "),
        ("run:5", r"no metric 'run'"),
        ("pipeline_found:0.1", r"no metric 'pipeline_found'"),
        (":5", r"no metric ''"),
        *((f"search_time_s:{number}", "is not a half-width") for number in ("", "0", "-5", "nan", "inf", "5 s", "1:2")),
    ],
)
def test_a_limit_that_makes_no_sense_is_refused(text: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=words):
        run_campaign("seams2023", ["none"], 1, 1, out=tmp_path / "out", until_ci=text)
    assert not (tmp_path / "out").exists()


def test_every_metric_that_is_named_is_a_number_in_runs_csv(tmp_path: Path) -> None:
    frame = run_campaign("seams2023", ["metacontrol"], 2, 1).frame()
    assert set(METRICS) == set(frame.select_dtypes(np.number).columns) - {"run", "seed"}
