"""Figures are drawn from result files alone."""

from itertools import product
from pathlib import Path

import pandas
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text

from suave_des import run_mission
from suave_des.campaign.campaign import run_campaign
from suave_des.errors import InputError
from suave_des.estimates import mean_of
from suave_des.records.mission_folder import MissionRecord, read_mission
from suave_des.records.missions import Missions, missions_of, read_missions
from suave_des.resources import find
from suave_des.results import style
from suave_des.results.figures import (
    draw_distributions,
    draw_folder,
    draw_heat_map,
    draw_missions,
    draw_results,
    draw_sweep,
    write_picture,
)
from suave_des.results.groups import grouped
from suave_des.results.mission import (
    adaptations,
    draw_map,
    draw_timeline,
    failure_spans,
    mode_spans,
)


@pytest.fixture(scope="module")
def mission(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("mission") / "out"
    run_mission("seams2023", "random", 2, 1, folder)
    return folder


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("campaign") / "out"
    run_campaign("seams2023", ["none", "random"], 3, 1, out=folder)
    return folder


@pytest.fixture(scope="module")
def legend_of_the_map(mission: Path) -> list[str]:
    figure = draw_map(read_mission(mission))
    return [text.get_text() for text in figure.axes[0].get_legend().get_texts()]


@pytest.mark.parametrize(
    ("mode", "text"),
    [
        ("fd_spiral_low", "search, low"),
        ("fd_spiral_medium", "search, medium"),
        ("__DEFAULT__", "search, default altitude"),
        ("fd_follow_pipeline", "follow the pipeline"),
    ],
)
def test_the_map_shows_the_modes_of_the_mission(mission, legend_of_the_map, mode, text):
    assert (text in legend_of_the_map) == (mode in (mission / "trajectory.csv").read_text())


@pytest.mark.parametrize("text", ["thruster 1 failed, 36 s", "pipeline detected, "])
def test_the_map_shows_what_happened(legend_of_the_map, text):
    assert any(each.startswith(text) for each in legend_of_the_map)


def test_a_mode_of_ones_own_is_said_in_words():
    assert style.mode_words("fd_spiral_very_low") == "search, very low"


def test_no_mode_has_the_colour_of_failures():
    assert style.VERMILION not in style.OTHER_MODES


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("signals.water_visibility.period_s", "water visibility: period (s)"),
        ("managers.metacontrol.reasoning_period_s", "metacontrol: reasoning period (s)"),
        ("managers.lab.mine:Mine.gain_s", "Mine: gain (s)"),
    ],
)
def test_axes_name_what_is_swept_without_modules(key, words):
    assert style.key_words(key).replace("\N{NO-BREAK SPACE}", " ") == words


def test_the_distributions_have_a_curve_for_each_manager_that_reaches_1(campaign):
    figure = draw_distributions(grouped(read_missions([campaign])))
    for axes in figure.axes:
        curves = [line for line in axes.get_lines() if len(line.get_xdata()) > 2]
        assert [line.get_label() for line in curves] == ["none (n = 3)", "random (n = 3)"]
        assert all(line.get_ydata()[-1] == 1.0 for line in curves)


@pytest.mark.parametrize(("ending", "date"), [(".pdf", b"CreationDate"), (".svg", b"dc:date")])
def test_no_picture_has_the_time_at_which_it_was_written(ending, date, tmp_path):
    write_picture(Figure(), tmp_path / f"empty{ending}")
    assert date not in (tmp_path / f"empty{ending}").read_bytes()


def test_a_sweep_is_drawn_with_a_mean_for_each_manager_at_each_value(tmp_path):
    designs = ["fd_spiral_low", "fd_spiral_medium"]
    values = {"visibility.period_s": [40.0, 80.0], "default_modes.f_generate_search_path": designs}
    result = run_campaign("seams2023", ["none", "random"], 3, 1, out=tmp_path / "out", sweep=values)
    missions = read_missions([tmp_path / "out"])
    assert missions.swept == tuple(values)
    figure = draw_sweep(missions)
    frame = result.frame()
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "none",
        "random",
        "95% interval of the mean",
    ]
    for manager, container in zip(("none", "random"), figure.axes[0].containers, strict=True):
        own = (
            frame[frame["manager"] == manager]
            .groupby("visibility.period_s")["search_time_s"]
            .mean()
        )
        assert list(container[0].get_ydata()) == pytest.approx(list(own))
    assert [tick.get_text() for tick in figure.axes[3].get_xticklabels()] == [
        "search, low",
        "search, medium",
    ]
    draw_folder(tmp_path / "out", tmp_path / "sweep.svg")
    assert "visibility: period" in (tmp_path / "sweep.svg").read_text()


def sweep_frame(points: int, runs: int) -> pandas.DataFrame:
    """Missions in which the run alone decides the search time, at many points of a sweep."""
    frame = pandas.DataFrame(
        product(range(points), range(1, runs + 1)), columns=["start.x_m", "run"]
    )
    frame = frame.astype({"start.x_m": float}).assign(manager="a", seed=1, distance_inspected_m=1.0)
    swept = {"search_time_s": 100.0 + 10.0 * frame["run"], "start.y_m": frame["start.x_m"] % 2}
    return frame.assign(pipeline_found=True, **swept)


def test_the_intervals_of_a_sweep_are_those_of_its_runs():
    figure = draw_sweep(missions_of(sweep_frame(6, 5)), ["start.y_m"])
    (container,) = figure.axes[0].containers
    low, high = container[2][0].get_segments()[0][:, 1]
    expected = mean_of([110.0, 120.0, 130.0, 140.0, 150.0]).interval
    assert (low, high) == pytest.approx(expected)


def test_many_values_are_drawn_in_bins_of_equally_many_missions():
    figure = draw_sweep(missions_of(sweep_frame(24, 2)), ["start.x_m"])
    assert list(figure.axes[0].containers[0][0].get_xdata()) == pytest.approx(
        [1.0 + 3.0 * n for n in range(8)]
    )


def test_no_parameter_is_left_out_silently():
    frame = sweep_frame(4, 2)
    frame["key_3"] = frame["start.x_m"] * 3
    figure = draw_sweep(missions_of(frame))
    assert len({axes.get_xlabel() for axes in figure.axes} - {""}) == 3
    frame["key_4"] = frame["start.x_m"]
    with pytest.raises(InputError, match=r"4 parameters do not fit .* \(choose 3 or fewer"):
        draw_sweep(missions_of(frame))


def test_a_manager_looks_the_same_in_every_figure():
    assert style.looks(["none", "random", "metacontrol", "bt"]) == [0, 1, 2, 3]
    assert style.looks(["mine", "metacontrol", "yours", "none"]) == [4, 2, 5, 0]
    assert style.looks(["mine", "yours"]) == [4, 5]
    both = style.looks(["none (a)", "none (b)", "mine", "bt"])
    assert (both[0], both[3]) == (0, 3)
    assert len({style.line(number)["color"] for number in both}) == 4
    frame = sweep_frame(3, 4)
    both = missions_of(
        pandas.concat([frame.assign(manager=name) for name in ("metacontrol", "bt")])
    )
    curves = draw_distributions(grouped(both)).axes[0].get_lines()
    means = draw_sweep(both, ["start.x_m"]).axes[0].containers
    expected = [style.line(2)["color"], style.line(3)["color"]]
    assert (
        list(dict.fromkeys(curve.get_color() for curve in curves if len(curve.get_xdata()) > 2))
        == expected
    )
    assert [container[0].get_color() for container in means] == expected


def test_a_single_mission_of_a_manager_with_an_awkward_name_is_drawn(tmp_path):
    text = "scenario,manager,run,seed,search_time_s,distance_inspected_m,pipeline_found,detection_x_m,adaptations\n"
    (tmp_path / "runs.csv").write_text(text + "a,_$x^<b>&\\,1,1,300,0,False,,3\n")
    draw_results([tmp_path], tmp_path / "out.svg")
    assert "&lt;b&gt;" in (tmp_path / "out.svg").read_text()


class TestTimeline:
    @pytest.fixture(scope="class")
    @staticmethod
    def figure(mission: Path) -> Figure:
        return draw_timeline(read_mission(mission))

    def test_has_a_row_for_tasks_before_those_of_modes(self, figure):
        rows = [tick.get_text() for tick in figure.axes[1].get_yticklabels()]
        assert rows[:2] == ["task", "search"]

    def test_has_a_row_for_a_failure(self, figure):
        assert "thruster 1" in [tick.get_text() for tick in figure.axes[1].get_yticklabels()]

    def test_lists_all_adaptations(self, figure, mission):
        record = read_mission(mission)
        listed = [text.get_text() for text in figure.axes[-1].texts]
        assert len(listed) == len(adaptations(record)) == record.metrics["adaptations"] > 3
        assert listed[0].startswith("A  ")

    def test_the_modes_of_a_function_are_all_in_its_bars_or_all_in_the_legend(self, tmp_path):
        run_mission("seams2023", "metacontrol", 8, 1, tmp_path / "out")
        lines = draw_timeline(read_mission(tmp_path / "out")).axes[1]
        in_bars = [text.get_text() for text in lines.texts]
        in_legend = [text.get_text() for text in lines.get_legend().get_texts()]
        searches = {"search: high", "search: medium", "search: low"}
        assert searches <= set(in_legend)
        assert not {"high", "medium", "low"} & set(in_bars)
        assert "search pipeline" in in_bars

    def test_a_failure_ends_with_the_recovery(self, tmp_path):
        run_mission("seams2023", "metacontrol", 1, 1, tmp_path / "out")
        (span,) = failure_spans(read_mission(tmp_path / "out"))["c_thruster_1"]
        assert 35.0 < span.begin_s < 37.0
        assert 10.0 < span.end_s - span.begin_s < 16.0


class TestBattery:
    @pytest.fixture(scope="class")
    @staticmethod
    def record(tmp_path_factory: pytest.TempPathFactory) -> MissionRecord:
        folder = tmp_path_factory.mktemp("battery")
        (folder / "battery.yaml").write_text(
            "base: extended\nleak: {time_s: 280}\nbattery: {discharge_time_s: 100}\n"
        )
        run_mission(folder / "battery.yaml", "bt_extended", 1, 1, folder / "out")
        return read_mission(folder / "out")

    def test_the_mode_is_that_of_the_function_that_moves_the_vehicle(self, record):
        spans = mode_spans(record)["f_generate_search_path"]
        spirals = [span for span in spans if span.what.startswith("fd_spiral")]
        way = record.trajectory.set_index("t_s")["mode"]
        modes = [set(way[span.begin_s + 0.1 : span.end_s - 0.1]) for span in spirals]
        assert len(spirals) > 1
        assert modes == [{span.what} for span in spirals]

    def test_its_level_is_drawn(self, record):
        assert any("battery" in axes.get_ylabel() for axes in draw_map(record).axes)

    def test_its_level_is_named_as_a_cause(self, record):
        causes = [each.cause for each in adaptations(record)]
        assert len(causes) == record.metrics["adaptations"]
        assert "battery recharged" in causes
        assert any(cause.startswith("battery at 2") for cause in causes)


LONG = (
    "a_module_with_quite_a_long_name_for_a_paper:AClassThatHasAnEvenLongerName"
    + "ForItsManager" * 5
)


@pytest.mark.parametrize("kind", ["distributions", "differences"])
def test_a_long_name_is_shown_whole(kind, campaign, tmp_path):
    frame = read_missions([campaign]).frame
    frame = frame.assign(manager=frame["manager"].astype(str) + LONG)
    with style.publication():
        figure = draw_missions(missions_of(frame), kind)
        figure.savefig(tmp_path / "figure.png", dpi=figure.dpi)
        width_px = figure.bbox.width
        texts = [each for each in figure.findobj(Text) if LONG[:8] in each.get_text()]
        boxes = [each.get_window_extent() for each in texts]
    assert boxes and all(box.x0 >= 0.0 and box.x1 <= width_px for box in boxes)


@pytest.mark.parametrize("kind", ["auto", "heatmap"])
def test_a_campaign_without_the_swept_parameter_is_reported(kind, campaign, tmp_path):
    values = {"start.y_m": [2.0, 2.5], "start.x_m": [-17.0, -16.5]}
    run_campaign("seams2023", managers=["none"], runs=1, sweep=values, out=tmp_path / "swept")
    with pytest.raises(InputError, match=r"does not sweep start\.y_m, start\.x_m"):
        draw_results([campaign, tmp_path / "swept"], tmp_path / "figure.png", kind)


@pytest.fixture(scope="module")
def two_limits(tmp_path_factory: pytest.TempPathFactory) -> pandas.DataFrame:
    """Two runs at each of two points of a sweep: with and without the time to find the pipeline."""
    folder = tmp_path_factory.mktemp("swept") / "out"
    swept = {"mission.time_limit_s": [10.0, 300.0]}
    run_campaign("seams2023", managers=["none"], runs=2, sweep=swept, out=folder)
    return read_missions([folder]).frame


def texts_of(figure: Figure) -> list[str]:
    return [" ".join(each.get_text().split()) for each in figure.findobj(Text)]


@pytest.fixture(scope="module")
def texts_of_a_sweep(two_limits: pandas.DataFrame) -> list[str]:
    return texts_of(draw_missions(missions_of(two_limits), "distributions"))


def test_what_shows_missions_of_a_sweep_shows_all_of_them(texts_of_a_sweep):
    assert "none (n = 4)" in texts_of_a_sweep


def test_what_shows_missions_of_a_sweep_says_so(texts_of_a_sweep):
    words = "missions at all points of the sweep: mission: time limit"
    assert any(text.startswith(words) for text in texts_of_a_sweep)


class TestDifferences:
    """Differences between managers, run by run."""

    @pytest.fixture(scope="class")
    @staticmethod
    def axes() -> Axes:
        """Of five runs, in which b is sooner by 1, 2, 3, 4 and 40 s."""
        frame = sweep_frame(1, 5).drop(columns=["start.x_m", "start.y_m"])
        other = frame.assign(
            manager="b", search_time_s=frame["search_time_s"] - [1.0, 2.0, 3.0, 4.0, 40.0]
        )
        return draw_missions(missions_of(pandas.concat([frame, other])), "differences").axes[0]

    def test_show_each_run(self, axes):
        rain = next(line for line in axes.get_lines() if len(line.get_xdata()) == 5)
        assert sorted(rain.get_xdata()) == [1.0, 2.0, 3.0, 4.0, 40.0]

    def test_name_the_runs_at_the_ends(self, axes):
        assert [text.get_text() for text in axes.texts] == ["run 1", "run 5"]

    def test_names_of_runs_are_not_crossed_by_the_line_at_0(self, axes):
        assert all(text.get_bbox_patch() for text in axes.texts)

    def test_show_the_interval_of_the_mean(self, axes):
        low, high = axes.containers[0][2][0].get_segments()[0][:, 0]
        assert (low, high) == pytest.approx(mean_of([1.0, 2.0, 3.0, 4.0, 40.0]).interval)

    def test_of_a_sweep_are_of_means_of_runs(self, two_limits):
        both = pandas.concat([two_limits, two_limits.assign(manager="other")])
        texts = texts_of(draw_missions(missions_of(both), "differences"))
        assert any(text.endswith("other (n = 2)") for text in texts)
        assert any(
            text.startswith("means of each run over all points of the sweep: mission:")
            for text in texts
        )

    def test_need_runs_with_the_same_random_numbers(self):
        with pytest.raises(InputError, match="share their random numbers"):
            draw_missions(
                read_missions([find("seams2023_runs.csv", "scenarios/published")]), "differences"
            )


def of_three_parameters() -> Missions:
    return missions_of(sweep_frame(4, 2).assign(depth=lambda each: each["start.x_m"] // 2))


@pytest.fixture(scope="module")
def heat_map() -> Figure:
    return draw_heat_map(of_three_parameters(), ["depth", "start.y_m"])


def test_a_heat_map_has_the_means_as_numbers(heat_map):
    # half the interval of 110 and 120: 12.7062 (Student's t) times 7.0711 / sqrt(2)
    assert [text.get_text() for text in heat_map.axes[0].texts] == ["115.00", "±63.53"] * 4


def test_a_heat_map_says_of_how_many_runs_it_has_means(heat_map):
    words = "means of n = 2 runs, each averaged over start: x (m); ± half their 95% intervals"
    assert words in texts_of(heat_map)


def test_a_heat_map_of_three_parameters_is_refused():
    with pytest.raises(InputError, match="of two swept parameters, and there are 3"):
        draw_heat_map(of_three_parameters())


def test_a_sweep_says_of_how_many_runs_it_has_means():
    text = "means of n = 2 runs, each averaged over the parameters of the other panels"
    assert text in texts_of(draw_sweep(of_three_parameters()))


@pytest.mark.parametrize("kind", ["map", "timeline"])
def test_a_figure_of_one_mission_is_not_one_of_a_campaign(kind, campaign):
    with pytest.raises(InputError, match=rf"{kind} is a figure of one mission .give a folder"):
        draw_missions(read_missions([campaign]), kind)
