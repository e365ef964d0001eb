"""Figures are drawn from result files alone."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from suave_des.campaign.campaign import run_campaign
from suave_des.campaign.single import run_mission
from suave_des.errors import InputError
from suave_des.report import mission_map
from suave_des.report.figures import draw_distributions, draw_folder, draw_sweep, swept_parameters


@pytest.fixture(scope="module")
def mission(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("mission") / "out"
    run_mission("seams2023", "random", 1, 1, folder)
    return folder


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("campaign") / "out"
    run_campaign("seams2023", ["none", "random"], 3, 1, out=folder)
    return folder


@pytest.mark.parametrize(("ending", "begins"), [(".png", b"\x89PNG"), (".pdf", b"%PDF"), (".svg", b"<?xml")])
def test_the_ending_says_what_kind_of_picture_it_is(ending: str, begins: bytes, mission: Path, tmp_path: Path) -> None:
    draw_folder(mission, tmp_path / f"map{ending}")
    assert (tmp_path / f"map{ending}").read_bytes().startswith(begins)
    assert [path.name for path in tmp_path.iterdir()] == [f"map{ending}"]


def test_the_map_shows_every_mode_and_what_happened(mission: Path) -> None:
    figure = mission_map.draw(mission)
    legend = figure.axes[0].get_legend()
    assert legend is not None
    told = [text.get_text() for text in legend.get_texts()]
    trajectory = (mission / "trajectory.csv").read_text()
    for mode in ("fd_spiral_low", "fd_spiral_medium", "__DEFAULT__", "fd_follow_pipeline"):
        assert (mode in told) == (mode in trajectory)
    assert any(text.startswith("thruster 1 failed, 35") for text in told)
    assert any(text.startswith("pipeline detected, ") for text in told)


def test_the_distributions_have_a_curve_for_each_manager_that_reaches_1(campaign: Path) -> None:
    figure = draw_distributions(campaign / "runs.csv")
    for axes in figure.axes:
        curves = [line for line in axes.get_lines() if len(line.get_xdata()) > 1]
        assert [line.get_label() for line in curves] == ["none (n = 3)", "random (n = 3)"]
        assert all(line.get_ydata()[-1] == 1.0 for line in curves)


def test_a_campaign_is_drawn_too(campaign: Path, tmp_path: Path) -> None:
    draw_folder(campaign, tmp_path / "runs.png")
    assert (tmp_path / "runs.png").is_file()


@pytest.mark.parametrize("missing", ["mission.json", "events.csv"])
def test_a_missing_file_is_named(missing: str, mission: Path, tmp_path: Path) -> None:
    shutil.copytree(mission, tmp_path / "copy")
    (tmp_path / "copy" / missing).unlink()
    with pytest.raises(InputError, match=f"{missing}: no such file"):
        draw_folder(tmp_path / "copy", tmp_path / "map.png")
    assert not (tmp_path / "map.png").exists()


def test_a_picture_that_cannot_be_written_is_told(mission: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"map\.png: cannot be written"):
        draw_folder(mission, tmp_path / "nowhere" / "map.png")


def test_a_campaign_without_missions_is_told(campaign: Path, tmp_path: Path) -> None:
    header = (campaign / "runs.csv").read_text().splitlines()[0]
    (tmp_path / "runs.csv").write_text(header + "\n")
    with pytest.raises(InputError, match=r"runs\.csv: line 1: has no missions"):
        draw_folder(tmp_path, tmp_path / "runs.png")


def test_a_sweep_is_drawn_with_a_mean_for_each_manager_at_each_value(tmp_path: Path) -> None:
    values = {"visibility.period_s": [40.0, 80.0], "default_modes.f_generate_search_path": ["fd_spiral_low"]}
    result = run_campaign("seams2023", ["none", "random"], 3, 1, out=tmp_path / "out", sweep=values)
    assert swept_parameters(tmp_path / "out") == list(values)
    figure = draw_sweep(tmp_path / "out", list(values))
    frame = result.frame()
    panel = figure.axes[0]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["none", "random"]
    for manager, container in zip(("none", "random"), panel.containers, strict=True):
        own = frame[frame["manager"] == manager].groupby("visibility.period_s")["search_time_s"].mean()
        assert list(container[0].get_ydata()) == pytest.approx(list(own))
    assert [tick.get_text() for tick in figure.axes[3].get_xticklabels()] == ["fd_spiral_low"]
    draw_folder(tmp_path / "out", tmp_path / "sweep.svg")
    assert b"visibility.period_s" in (tmp_path / "sweep.svg").read_bytes()


def test_many_values_are_drawn_in_bins_of_equally_many_missions(tmp_path: Path) -> None:
    values = {"start.x_m": [-18.0 + 0.1 * step for step in range(24)]}
    run_campaign("seams2023", ["none"], 1, 1, out=tmp_path / "out", sweep=values)
    figure = draw_sweep(tmp_path / "out", ["start.x_m"])
    xs = list(figure.axes[0].containers[0][0].get_xdata())
    assert xs == pytest.approx([-17.9 + 0.3 * number for number in range(8)])
