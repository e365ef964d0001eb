"""Runs that share a draw are one value, however a campaign's missions are given; figures count as
comparisons do.
"""

import shutil
from pathlib import Path

import numpy as np
import pandas
import pytest
from matplotlib.text import Text

from suave_des.campaign.campaign import run_campaign
from suave_des.estimates import mean_of
from suave_des.records.missions import missions_of, read_missions
from suave_des.results.compare import compare_folders
from suave_des.results.figures import draw_heat_map, draw_missions, draw_sweep
from tests.helpers.compared import compare_frame

DRAWN = {"start.y_m": {"distribution": "uniform", "minimum": 1.5, "maximum": 3.5}}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A campaign of four draws of three runs."""
    out = tmp_path_factory.mktemp("draws") / "out"
    run_campaign("seams2023", ["none", "bt"], 12, 1, out=out, runs_per_draw=3, perturbations=DRAWN)
    return out


def test_the_file_of_a_campaign_has_the_draws_of_its_folder(folder):
    whole, file = compare_folders([folder]), compare_folders([folder / "runs.csv"])
    assert list(file.differences["n"]) == list(whole.differences["n"])
    assert file.differences["n"][0] == 4


@pytest.mark.parametrize("is_frame", [True, False])
def test_drawn_values_show_draws_where_nothing_else_does(folder, tmp_path, is_frame):
    shutil.copy(folder / "runs.csv", tmp_path / "alone.csv")
    if is_frame:
        comparison = compare_frame(pandas.read_csv(tmp_path / "alone.csv"))
    else:
        comparison = compare_folders([tmp_path / "alone.csv"])
    assert comparison.differences["n"][0] == 4


def frame_of(values: list[float], **changed: object) -> pandas.DataFrame:
    """Missions of a with a drawn value in each run."""
    frame = pandas.DataFrame({"x.y": values, "run": range(1, len(values) + 1)})
    times_s = 100.0 + frame["run"]
    frame = frame.assign(manager="a", seed=1, search_time_s=times_s, distance_inspected_m=1.0)
    return frame.assign(pipeline_found=True, **changed)


@pytest.mark.parametrize(
    ("values", "sharing"),
    [
        ([1.0, 1.0, 2.0, 2.0, 3.0, 3.0], 2),
        ([1.0, 1.0, 1.0, 1.0, 3.0, 3.0], 4),
        ([1.0, 2.0, 3.0, 4.0], 1),
        ([1.0, 1.0, 1.0, 1.0], 1),
        ([1.0, 1.0, 2.0, 2.0, 2.0, 3.0], 1),
    ],
)
def test_draws_begin_where_drawn_values_change(values, sharing):
    found = missions_of(frame_of(values)).frame["runs_sharing_draw"]
    assert set(found) == {sharing}


def texts_of(figure) -> list[str]:
    return [" ".join(each.get_text().split()) for each in figure.findobj(Text)]


def swept(frame: pandas.DataFrame) -> pandas.DataFrame:
    """Missions at four points of two swept parameters, each of which adds to the search time."""
    points = [(low, high) for low in (0.0, 1.0) for high in (0.0, 10.0)]
    parts = []
    for first, second in points:
        times_s = frame["search_time_s"] + first + second
        parts.append(frame.assign(**{"p.a": first, "p.b": second, "search_time_s": times_s}))
    return pandas.concat(parts, ignore_index=True)


def test_a_sweep_is_drawn_with_means_of_draws():
    frame = swept(frame_of([1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 3.0, 3.0, 3.0]))
    figure = draw_sweep(missions_of(frame), ["p.a"])
    assert "means of n = 3 draws of 3 runs, each averaged over p: b" in texts_of(figure)
    low, high = figure.axes[0].containers[0][2][0].get_segments()[0][:, 1]
    assert (low, high) == pytest.approx(mean_of([107.0, 110.0, 113.0]).interval)
    heat_map = draw_heat_map(missions_of(frame))
    below = "means of n = 3 draws of 3 runs; ± half their 95% intervals"
    assert below in texts_of(heat_map)


def test_runs_that_lack_a_point_are_left_out_of_figures_as_of_comparisons():
    frame = swept(frame_of([1.0, 2.0, 3.0, 4.0]))
    lacking = frame[~((frame["run"] == 4) & (frame["p.b"] == 10.0))]
    other = frame.assign(manager="b")
    missions = missions_of(pandas.concat([lacking, other]))
    figure = draw_sweep(missions, ["p.a"])
    drawn = figure.axes[0].containers[0][0].get_ydata()
    # Of a, run 4 has not both values of p.b.
    assert list(drawn) == pytest.approx([102.0 + 5.0, 102.0 + 1.0 + 5.0])
    assert any(text.startswith("means of n = 3 to 4 runs") for text in texts_of(figure))
    compared = compare_frame(pandas.concat([lacking, other]), by=["p.a"]).summaries
    means = compared.query("metric == 'search_time_s' and group.str.startswith('a')")["mean"]
    assert list(means) == pytest.approx(list(drawn))


def test_a_heat_map_leaves_them_out_too():
    frame = swept(frame_of([1.0, 2.0])).assign(**{"p.c": 0.0})
    both = pandas.concat([frame, frame.assign(**{"p.c": 1.0})])
    lacking = both[~((both["run"] == 2) & (both["p.c"] == 1.0) & (both["p.a"] == 0.0))]
    whole = both.assign(manager="b")
    figure = draw_heat_map(missions_of(pandas.concat([lacking, whole])), ["p.a", "p.b"])
    numbers = [text.get_text() for text in figure.axes[0].texts]
    means = [number for number in numbers if not number.startswith("±")]
    assert means == ["101.00", "102.50", "111.00", "112.50"]


def test_distributions_say_how_many_draws_their_missions_are_of(folder):
    texts = texts_of(draw_missions(read_missions([folder])))
    assert "none (n = 12 in 4 draws)" in texts


def test_a_distribution_ends_below_all_where_the_time_limit_is_not_known():
    frame = frame_of([1.0, 2.0, 3.0, 4.0])
    frame.loc[0, ["search_time_s", "pipeline_found"]] = [20.0, False]
    figure = draw_missions(missions_of(frame.drop(columns="x.y")))
    (curve,) = (line for line in figure.axes[0].get_lines() if len(line.get_xdata()) > 2)
    assert np.max(curve.get_ydata()) == 0.75
