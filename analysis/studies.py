"""What the studies share: their options, differences paired by run, their files, and the look of
their figures.

A study's table has for each of its figures the one over the first few runs, too, in columns that
begin with `first_`: runs of one number draw the same random numbers however many there are, so that
a small repetition gives these again.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib.style
import numpy as np
import pandas
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from suave_des import mean_of, run_campaign

FIRST_RUNS = 3
SEED = 1
FEW = 500
"""Missions that are done in this process before others have started."""
METRICS = {"search_time_s": "search time (s)", "distance_inspected_m": "distance inspected (m)"}
WIDTH_IN = 7.0
"""Text width of a two-column paper."""
BLUE, VERMILION, GREY = "#0072B2", "#D55E00", "#8A8A8A"
COLOURS = {"none": BLUE, "random": "#E69F00", "metacontrol": "#009E73", "bt": "#CC79A7"}
"""Of managers, as in all figures: Okabe and Ito's."""


@dataclass(frozen=True)
class Options:
    """How a study is run.

    Attributes:
        out: folder for its files.
        runs: missions for each manager and case.
        workers: processes.
    """

    out: Path
    runs: int
    workers: int


def options(script: str, text: str, runs: int) -> Options:
    """Read a study's options from the command line.

    Args:
        script: its file; the results go into the folder of its name.
        text: its docstring.
        runs: missions for each manager and case, by default.
    """
    parser = argparse.ArgumentParser(
        description=text, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--out", type=Path, default=Path(script).with_suffix(""), help="folder for the results"
    )
    parser.add_argument(
        "--runs",
        type=int,
        default=runs,
        help=f"missions for each manager and case (default: {runs})",
    )
    parser.add_argument("--workers", type=int, default=2, help="processes (default: 2)")
    chosen = parser.parse_args()
    if chosen.runs < FIRST_RUNS:
        parser.error(f"--runs: {FIRST_RUNS} or more")
    return Options(chosen.out, chosen.runs, chosen.workers)


def missions(
    scenario: str | Path, managers: Sequence[str], runs: int, workers: int, **more: Any
) -> pandas.DataFrame:
    """Run missions; a row for each, with the columns of runs.csv. Further arguments as of
    run_campaign.
    """
    few = "sweep" not in more and runs * len(managers) < FEW
    return run_campaign(
        scenario,
        managers,
        runs=runs,
        seed=SEED,
        workers=1 if few else workers,
        progress=False,
        **more,
    )


def by_run(frame: pandas.DataFrame, metric: str) -> pandas.Series[float]:
    """Return a metric of one manager's missions, by run."""
    return frame.set_index("run")[metric].astype(float).sort_index()


def paired(ours: pandas.Series[float], theirs: pandas.Series[float]) -> dict[str, float]:
    """Estimate the mean of ours - theirs over the runs that both have.

    Returns:
        n, mean_difference, low95 and high95 (Student's t), and first_difference, over the first
        runs.
    """
    difference = (ours - theirs).dropna()
    low, high = mean_of(difference.tolist()).interval or (np.nan, np.nan)
    if difference.nunique() == 1:  # of equal values nothing is known of their spread
        low, high = np.nan, np.nan
    first = difference[difference.index <= FIRST_RUNS].mean()
    return {
        "n": len(difference),
        "mean_difference": difference.mean(),
        "low95": low,
        "high95": high,
        "first_difference": first,
    }


def shown(row: Mapping[str, Any], unit: str = "s", digits: int = 0) -> str:
    """Write a difference with its interval, such as "-12 s (-20 to -4)"."""

    def number(value: float) -> str:
        return f"{round(value, digits) + 0.0:+.{digits}f}"  # never "-0"

    ends = f"{number(row['low95'])} to {number(row['high95'])}"
    return f"{number(row['mean_difference'])} {unit} ({ends})"


Draw = Callable[[Figure, pandas.DataFrame], None]


def write(
    chosen: Options,
    name: str,
    rows: pandas.DataFrame,
    draw: Draw,
    conclude: Callable[[pandas.DataFrame], str],
    *,
    height: float,
) -> None:
    """Write a study's table, and figure and conclusion as they follow from the table; print the
    conclusion.

    Args:
        chosen: where to.
        name: of the study, and of its files.
        rows: the table.
        draw: draws the figure.
        conclude: says in sentences what the table shows.
        height: of the figure, in inches.
    """
    chosen.out.mkdir(parents=True, exist_ok=True)
    table = chosen.out / f"{name}.csv"
    with table.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(rows.columns)
        writer.writerows([_cell(value) for value in row] for row in rows.itertuples(index=False))
    written = pandas.read_csv(table)
    figure_of(draw, written, height=height).savefig(chosen.out / f"{name}.png", dpi=160)
    conclusion = conclude(written).strip()
    (chosen.out / "conclusion.md").write_text(conclusion + "\n", encoding="utf-8")
    print(conclusion)


def _cell(value: Any) -> Any:
    return f"{value:.4f}".rstrip("0").rstrip(".") if isinstance(value, float) else value


def figure_of(draw: Callable[..., None], *drawn: Any, height: float) -> Figure:
    """Draw a figure in the look of all figures: `draw` gets it, and what is to be drawn."""
    with matplotlib.style.context("suave_des.figures"):
        figure = Figure(figsize=(WIDTH_IN, height), layout="constrained")
        draw(figure, *drawn)
    return figure


def metric_panels(
    figure: Figure, rows: pandas.DataFrame, **look: Any
) -> Iterator[tuple[Axes, str, pandas.DataFrame]]:
    """Yield a panel for each metric, side by side, with the metric's name and its rows."""
    panels = figure.subplots(1, len(METRICS), **look)
    for panel, metric in zip(panels, METRICS, strict=True):
        yield panel, metric, rows[rows["metric"] == metric]


def draw_intervals(
    panel: Axes, rows: pandas.DataFrame, places: Iterable[float], *, across: bool = False
) -> None:
    """Draw mean differences with their intervals; those that could be chance are grey.

    Args:
        panel: to draw in.
        rows: with the columns of `paired`.
        places: on the other axis.
        across: whether differences go from left to right.
    """
    for place, (_, row) in zip(places, rows.iterrows(), strict=True):
        mean = row["mean_difference"]
        ends = [mean if np.isnan(end) else end for end in (row["low95"], row["high95"])]
        colour = BLUE if ends[0] > 0.0 or ends[1] < 0.0 else GREY
        errors = np.abs([[ends[0] - mean], [ends[1] - mean]])
        look = {"fmt": "o", "ms": 3.0, "color": colour, "capsize": 2.0}
        if across:
            panel.errorbar(mean, place, xerr=errors, **look)
        else:
            panel.errorbar(place, mean, yerr=errors, **look)
