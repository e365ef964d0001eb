"""Split check: parameters fitted without a manager's runs must predict that manager's means."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from suave_des.estimates import estimate
from suave_des.validation.comparison import sample
from suave_des.validation.runs import METRICS

if TYPE_CHECKING:
    import pandas

WITHIN_STD = 0.5
"""Greatest difference of a predicted mean, in published standard deviations, that counts as predicted."""


def split_check(fitted: Mapping[str, pandas.DataFrame], published: pandas.DataFrame) -> pandas.DataFrame:
    """Predicted and published figures of each manager that was left out of a fit.

    Args:
        fitted: by left-out manager, missions simulated with what was fitted without it; of each frame only the rows of
            that manager count. Columns as of runs.COLUMNS, the place of detection apart.
        published: the published missions, likewise.

    Returns:
        A row for each manager and metric: left_out, metric, published_n, published_mean, published_std, predicted_n,
        predicted_mean, predicted_std, difference (predicted less published mean), difference_in_std (by the published
        standard deviation; nan if that is nought), within (whether that is at most WITHIN_STD either way).

    Raises:
        ValueError: a manager has no row in its frame, or fewer than two published ones.
    """
    import pandas

    rows = [_row(manager, metric, published, frame) for manager, frame in fitted.items() for metric in METRICS]
    return pandas.DataFrame(rows)


def _row(manager: str, metric: str, published: pandas.DataFrame, frame: pandas.DataFrame) -> dict[str, object]:
    theirs = estimate(sample(published, manager, metric).tolist())
    ours = estimate(sample(frame, manager, metric).tolist())
    if theirs.mean is None or theirs.std is None or ours.mean is None:
        raise ValueError(f"manager {manager}: {theirs.n} published and {ours.n} simulated missions are too few")
    difference = ours.mean - theirs.mean
    in_std = difference / theirs.std if theirs.std else float("nan")
    return {
        "left_out": manager,
        "metric": metric,
        "published_n": theirs.n,
        "published_mean": theirs.mean,
        "published_std": theirs.std,
        "predicted_n": ours.n,
        "predicted_mean": ours.mean,
        "predicted_std": ours.std,
        "difference": difference,
        "difference_in_std": in_std,
        "within": abs(in_std) <= WITHIN_STD,
    }
