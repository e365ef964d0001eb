"""The paper's table beside ours."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pandas
import pytest

from suave_des.results.paper import compare_with_paper

# Means and sample standard deviations as printed in the paper (SEAMS 2023, arXiv:2303.09220).
PAPER = {
    ("none", "search_time_s"): (187.85, 42.40),
    ("none", "distance_inspected_m"): (31.40, 13.00),
    ("random", "search_time_s"): (180.15, 82.05),
    ("random", "distance_inspected_m"): (3.88, 3.19),
    ("metacontrol", "search_time_s"): (106.95, 39.46),
    ("metacontrol", "distance_inspected_m"): (51.15, 12.01),
}


def frame(**search_times_s: list[float]) -> pandas.DataFrame:
    """Missions with given search times, and the distance that is left at 0.25 m/s until 300 s."""
    rows = [(manager, time_s, (300 - time_s) / 4) for manager, times_s in search_times_s.items() for time_s in times_s]
    return pandas.DataFrame(rows, columns=["manager", "search_time_s", "distance_inspected_m"])


def test_published_runs_give_the_figures_that_the_paper_prints() -> None:
    figures = compare_with_paper(frame()).figures
    assert list(figures) == [(*cell, each) for cell in PAPER for each in ("mean", "std")]
    for cell, values in PAPER.items():
        for each, value in zip(("mean", "std"), values, strict=True):
            assert figures[*cell, each][0].value == pytest.approx(value, abs=0.005)


def test_difference_is_ours_less_the_published_figure() -> None:
    comparison = compare_with_paper(frame(none=[100.0, 200.0, 300.0], random=[50.0]))
    paper, ours = comparison.figures["none", "search_time_s", "mean"]
    assert ours.value == 200.0
    assert paper.contains(ours.value)  # the paper's interval is 168.0 to 207.7
    rows = comparison.table("search_time_s").rows
    assert [row[:2] for row in rows[:2]] == [("none", "mean"), ("none", "std")]
    assert [row[-2:] for row in rows] == [
        ("+12.15", ""),
        ("+57.60", "*"),
        ("-130.15", "*"),
        ("", ""),
        ("", ""),
        ("", ""),
    ]


def test_managers_without_missions_do_not_count() -> None:
    comparison = compare_with_paper(frame(none=[140.0, 232.0], random=[], metacontrol=[]))
    remarks = list(comparison.remarks())
    assert "Here: 2 missions of none, 0 missions of random, 0 missions of metacontrol." in remarks[0]
    assert remarks[1].startswith("3 of 4 figures lie in the 95% intervals of the paper's; the one marked * does not.")
    assert comparison.markdown().count("\\* |") == 1
    alike = list(compare_with_paper(frame(none=[150.0, 210.0])).remarks())
    assert alike[1] == "All 4 figures lie in the 95% intervals of the paper's."
    far = list(compare_with_paper(frame(none=[50.0, 352.0])).remarks())
    assert far[1] == "1 of 4 figures lies in the 95% intervals of the paper's; those marked * do not."
    assert list(compare_with_paper(frame(bt=[150.0])).remarks())[1] == ("There are too few missions for any figure.")


def test_the_analysis_script_makes_the_table_from_a_runs_csv(tmp_path: Path) -> None:
    runs = frame(none=[180.0, 190.0], random=[170.0, 200.0], metacontrol=[90.0, 110.0])
    runs.to_csv(tmp_path / "runs.csv", index=False)
    script = Path(__file__).parents[2] / "analysis" / "paper_table.py"
    ended = subprocess.run(
        [sys.executable, str(script), str(tmp_path / "runs.csv"), "--out", str(tmp_path)],
        capture_output=True,
        text=True,
        check=True,
    )
    assert (tmp_path / "paper_table.md").read_text() == ended.stdout
    assert "| none | search time (s) | mean | 187.85 |" in ended.stdout
    assert "| 185.00 |" in ended.stdout


def test_what_could_be_chance_is_said_to_be_so() -> None:
    values = {"none": [200.0, 150.0, 190.0], "random": [100.0, 300.0, 120.0], "metacontrol": [100.0, 90.0, 110.0]}
    rows = [
        {"manager": manager, "search_time_s": time_s, "distance_inspected_m": 0.0}
        for manager, times_s in values.items()
        for time_s in times_s
    ]
    found = compare_with_paper(pandas.DataFrame(rows))
    (remark,) = (each for each in found.remarks() if "sooner" in each)
    assert remark.endswith("than the others, on average; the difference from random could be chance.")
