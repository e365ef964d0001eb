"""A million missions are drawn from fewer points and counts: what figures show stays the same."""

from __future__ import annotations

import numpy as np
import pandas

from suave_des.results import style
from suave_des.results.campaign_figures import (
    draw_differences,
    draw_distributions,
)
from suave_des.results.missions import grouped, missions_of


def _times_s(n: int) -> np.ndarray:
    """Make search times in clusters, as turns of the spiral make them."""
    rng = np.random.default_rng(7)
    return np.abs(rng.choice((60.0, 110.0, 190.0), n) + rng.normal(0.0, 8.0, n))


def test_figures_of_many_missions_are_written_from_few_points() -> None:
    n = 30_000
    frame = pandas.DataFrame(
        {"manager": "none", "run": np.arange(1, n + 1), "seed": 1, "search_time_s": _times_s(n)}
    ).assign(distance_inspected_m=20.0, pipeline_found=True, scenario="seams2023")
    groups, _ = grouped(missions_of(pandas.concat([frame, frame.assign(manager="bt")])))
    for axes in draw_differences(groups).axes:
        assert all(len(line.get_xdata()) <= 2_000 for line in axes.lines)


def test_a_legend_of_long_names_stays_within_the_figure() -> None:
    names = [f"a manager with a long name {number}" for number in range(4)]
    frame = pandas.DataFrame({"manager": names * 10, "run": np.repeat(np.arange(1, 11), 4), "seed": 1})
    groups, _ = grouped(missions_of(frame.assign(search_time_s=_times_s(40), distance_inspected_m=20.0)))
    for draw in (draw_differences, draw_distributions):
        with style.publication():
            figure = draw(groups)
            figure.draw_without_rendering()
        box = figure.legends[0].get_window_extent()
        assert box.x0 >= 0.0
        assert box.x1 <= figure.bbox.x1
