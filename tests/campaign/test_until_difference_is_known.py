"""A campaign stops when the difference of two managers, run by run, is known well enough."""

from __future__ import annotations

import json
import random
from pathlib import Path

import numpy as np
import pandas
import pytest

from suave_des.campaign.campaign import CampaignInterrupted, Progress, resume_campaign, run_campaign
from suave_des.campaign.progress import PAIR_STEP, PairTracker
from suave_des.campaign.stopping import FEWEST_PAIRS, parse_until_ci
from suave_des.errors import InputError
from suave_des.estimates import estimate

LIMIT = "metacontrol - bt: search_time_s: 8"
FILES = ("runs.csv", "summary.csv", "manifest.json")


def files_of(folder: Path) -> dict[str, bytes]:
    return {name: (folder / name).read_bytes() for name in FILES}


def test_all_managers_end_after_the_first_run_at_which_the_difference_is_known(tmp_path: Path) -> None:
    out = tmp_path / "out"
    run_campaign("seams2023", ["none", "bt", "metacontrol"], 400, 1, out=out, until_ci=LIMIT)
    frame = pandas.read_csv(out / "runs.csv", keep_default_na=False)
    last = frame.groupby("manager")["run"].max()
    assert last.nunique() == 1
    assert frame.groupby("manager").size().tolist() == [last.iloc[0]] * 3
    times = frame.pivot(index="run", columns="manager", values="search_time_s")
    differences = (times["metacontrol"] - times["bt"]).tolist()

    def half_width(n: int) -> float:
        low, high = estimate(differences[:n]).mean_interval or (0.0, 0.0)
        return (high - low) / 2.0

    assert half_width(len(differences)) < 8.0
    for n in range(FEWEST_PAIRS, len(differences), PAIR_STEP):
        assert half_width(n) >= 8.0
    (told,) = json.loads((out / "manifest.json").read_text())["until_ci"]["differences"]
    assert told["n"] == len(differences)
    assert told["is_narrow"]
    assert told["difference"] == pytest.approx(np.mean(differences), abs=1e-6)
    assert told["half_width"] == pytest.approx(half_width(len(differences)), abs=1e-6)


@pytest.mark.usefixtures("quick_workers")
def test_the_same_bytes_on_two_workers_and_after_interruptions(tmp_path: Path) -> None:
    managers = ["bt", "metacontrol"]
    run_campaign("seams2023", managers, 200, 3, 1, tmp_path / "one", until_ci=LIMIT)
    run_campaign("seams2023", managers, 200, 3, 2, tmp_path / "two", until_ci=LIMIT)
    assert files_of(tmp_path / "two") == files_of(tmp_path / "one")
    chance = random.Random(1)

    def ctrl_c(progress: Progress) -> None:
        if chance.random() < 0.03:
            raise KeyboardInterrupt

    out = tmp_path / "stopped"
    try:
        run_campaign("seams2023", managers, 200, 3, 1, out, until_ci=LIMIT, on_progress=ctrl_c)
    except CampaignInterrupted:
        resume_campaign(out)
    assert files_of(out) == files_of(tmp_path / "one")


def test_the_intervals_at_which_campaigns_stop_cover_the_true_difference() -> None:
    chance = np.random.default_rng(2)
    repetitions, covered, sizes = 2_000, 0, []
    for _ in range(repetitions):
        shared = chance.normal(150.0, 50.0, 400)
        first, second = shared + chance.normal(6.0, 7.0, 400), shared + chance.normal(0.0, 7.0, 400)
        tracker = PairTracker(1.5)
        for run, (x, y) in enumerate(zip(first, second, strict=True), 1):
            tracker.add(0, run, float(x))
            tracker.add(1, run, float(y))
            if tracker.last_run is not None:
                break
        found = tracker.differences
        assert found.half_width is not None and found.half_width < 1.5
        covered += abs(found.mean - 6.0) <= found.half_width
        sizes.append(found.n)
    assert 0.94 <= covered / repetitions <= 0.96
    assert 150 < np.mean(sizes) < 190  # unpaired it would take some 8,700 runs


def test_the_order_in_which_runs_finish_makes_no_difference() -> None:
    chance = random.Random(4)
    values = [(chance.gauss(5.0, 8.0), chance.gauss(0.0, 8.0)) for _ in range(200)]
    found = []
    for seed in range(5):
        outcomes = [(side, run, value[side]) for run, value in enumerate(values, 1) for side in (0, 1)]
        if seed:
            random.Random(seed).shuffle(outcomes)
        tracker = PairTracker(2.5)
        for outcome in outcomes:
            tracker.add(*outcome)
        found.append((tracker.last_run, tracker.progress(0)))
    assert all(each == found[0] for each in found)
    assert found[0][0] is not None


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("metacontrol - : search_time_s: 2", "expected a difference of two managers"),
        ("bt - bt: search_time_s: 2", "expected a difference of two managers"),
        ("metacontrol - bt: 2", "expected a difference of two managers"),
        ("metacontrol - bt: search_time: 2", "no metric 'search_time'"),
        ("metacontrol - bt: search_time_s: 0", "is not a half-width"),
        ("metacontrol - random: search_time_s: 2", "needs 'random', which is not among the managers"),
    ],
)
def test_a_difference_that_makes_no_sense_is_refused(text: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=words):
        run_campaign("seams2023", ["bt", "metacontrol"], 5, 1, out=tmp_path / "out", until_ci=text)
    assert not (tmp_path / "out").exists()


def test_managers_of_ones_own_may_be_named() -> None:
    found = parse_until_ci("reactive:Reactive - own.module:Manager: distance_inspected_m: 1.5")
    assert found.pair == ("reactive:Reactive", "own.module:Manager")
    assert (found.metric, found.half_width) == ("distance_inspected_m", 1.5)
