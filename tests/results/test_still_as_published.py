"""A small guard: the shipped calibration still gives missions like the published ones.

Sixty missions a manager, and 24 for the runs of 2025, with fixed seeds, against bounds that are wide for these numbers;
`suave-des validate` with 2,000 missions is the real check, and docs/background/fidelity.md shows what it found.
"""

import pandas as pd
import pytest
from scipy.stats import ks_2samp

from suave_des.campaign.campaign import run_campaign
from suave_des.records.metrics import PAPER_METRICS
from suave_des.records.runs import read_runs
from suave_des.resources import find

MANAGERS = ("none", "random", "metacontrol")


@pytest.fixture(scope="module")
def published() -> pd.DataFrame:
    return read_runs(find("seams2023_runs.csv", "scenarios/published")).frame


@pytest.fixture(scope="module")
def simulated() -> pd.DataFrame:
    return run_campaign("seams2023", MANAGERS, 60, 1).frame()


@pytest.mark.parametrize("metric", PAPER_METRICS)
@pytest.mark.parametrize("manager", MANAGERS)
def test_a_cell_of_the_papers_table_is_still_near(
    published: pd.DataFrame, simulated: pd.DataFrame, manager: str, metric: str
) -> None:
    theirs = published[published["manager"] == manager][metric]
    ours = simulated[simulated["manager"] == manager][metric]
    assert abs(ours.mean() - theirs.mean()) < 0.8 * theirs.std()
    assert 0.5 < ours.std() / theirs.std() < 2.0
    assert ks_2samp(ours, theirs).pvalue > 0.001


@pytest.mark.parametrize("metric", PAPER_METRICS)
def test_metacontrol_is_still_the_best_by_far(simulated: pd.DataFrame, metric: str) -> None:
    means = simulated.groupby("manager", observed=True)[metric].mean()
    sign = -1.0 if metric == "search_time_s" else 1.0
    others = max(sign * means["none"], sign * means["random"])
    assert sign * means["metacontrol"] > others + (20.0 if metric == "search_time_s" else 8.0)


def test_metacontrols_two_clusters_are_still_there(simulated: pd.DataFrame) -> None:
    times = simulated[simulated["manager"] == "metacontrol"]["search_time_s"]
    assert times.between(65, 95).mean() > 0.25
    assert times.between(118, 135).mean() > 0.12
    late = simulated[(simulated["manager"] == "metacontrol") & simulated["search_time_s"].between(120, 130)]
    assert late["detection_x_m"].between(-19.5, -18.5).mean() > 0.6


@pytest.mark.parametrize(
    ("metric", "least", "most"), [("search_time_s", 0.5, 6.0), ("distance_inspected_m", -5.0, -0.4)]
)
def test_as_in_the_runs_of_2025_metacontrol_comes_a_little_after_bt(metric: str, least: float, most: float) -> None:
    runs = run_campaign("planta_exp1_campaign.yaml", ("bt", "metacontrol"), 4, 1).frame()
    means = runs.groupby("manager", observed=True)[metric].mean()
    assert least < means["metacontrol"] - means["bt"] < most
