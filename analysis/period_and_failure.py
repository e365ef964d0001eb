"""Metacontrol's advantage over no adaptation, by the visibility's period and the time of the
thruster failure.

The same runs are made under both managers at each pair of values; differences are paired by run.
The columns that begin with `failure` are what the failure itself does to the manager none: its
missions less those in which the thruster fails only when they are nearly over.

    python analysis/period_and_failure.py [--out DIR] [--runs N] [--workers N]
"""

from __future__ import annotations

from itertools import product

import numpy as np
import pandas
import studies
from matplotlib.colors import CenteredNorm
from matplotlib.figure import Figure

SCENARIO = "seams2023"
PERIODS_S = (40.0, 60.0, 80.0, 120.0, 160.0, 240.0)
FAILURES_S = (5.0, 35.0, 65.0, 95.0, 155.0, 290.0)
PAPERS = (80.0, 35.0)
PERIOD, FAILURE = "signals.water_visibility.period_s", "thruster_events.0.time_s"


def study(
    runs: int, workers: int, chosen: list[tuple[float, float]] | None = None
) -> pandas.DataFrame:
    """Run every pair of values; a row for each and metric: metacontrol less none."""
    wanted = list(product(PERIODS_S, FAILURES_S)) if chosen is None else chosen
    pairs = list(dict.fromkeys([*wanted, *((period_s, FAILURES_S[-1]) for period_s, _ in wanted)]))
    sweep = {
        "zip": {
            PERIOD: [period_s for period_s, _ in pairs],
            FAILURE: [failure_s for _, failure_s in pairs],
        }
    }
    frame = studies.missions(SCENARIO, ["none", "metacontrol"], runs, workers, sweep=sweep)
    rows = []
    for (period_s, failure_s), metric in product(wanted, studies.METRICS):
        here = frame[frame[PERIOD] == period_s]
        ours, theirs, unharmed = (
            studies.by_run(here[(here["manager"] == manager) & (here[FAILURE] == time_s)], metric)
            for manager, time_s in (
                ("metacontrol", failure_s),
                ("none", failure_s),
                ("none", FAILURES_S[-1]),
            )
        )
        effect = studies.paired(theirs, unharmed)
        row = {"period_s": period_s, "failure_s": failure_s, "metric": metric}
        row |= {"metacontrol": ours.mean(), "none": theirs.mean(), **studies.paired(ours, theirs)}
        row |= {"failure_difference": effect["mean_difference"]}
        rows.append(row | {f"failure_{end}": effect[end] for end in ("low95", "high95")})
    return pandas.DataFrame(rows)


def draw(figure: Figure, rows: pandas.DataFrame) -> None:
    """Draw a panel for each metric: differences by period and time of the failure."""
    for panel, metric, of_metric in studies.metric_panels(figure, rows, sharey=True):
        own = of_metric.set_index(["failure_s", "period_s"])
        table = own["mean_difference"].unstack()
        colours = "RdBu" if metric == "distance_inspected_m" else "RdBu_r"
        image = panel.imshow(
            table.to_numpy(float), cmap=colours, norm=CenteredNorm(), aspect="auto"
        )
        panel.grid(False)
        for (line, failure_s), (column, period_s) in product(
            enumerate(table.index), enumerate(table.columns)
        ):
            cell = own.loc[(failure_s, period_s)]
            text = f"{cell['mean_difference']:+.0f}"
            dark = abs(cell["mean_difference"]) > 0.7 * np.abs(table.to_numpy()).max()
            text = text if cell["low95"] > 0.0 or cell["high95"] < 0.0 else f"({text})"
            panel.text(
                column,
                line,
                text,
                ha="center",
                va="center",
                fontsize=6.5,
                color="white" if dark else "black",
            )
        panel.set_xticks(range(len(table.columns)), [f"{each:g}" for each in table.columns])
        panel.set_yticks(range(len(table.index)), [f"{each:g}" for each in table.index])
        panel.set_xlabel("period of the visibility (s)")
        title = studies.METRICS[metric]
        figure.colorbar(image, ax=panel).set_label(f"metacontrol - none: {title}")
    figure.axes[0].set_ylabel("failure of thruster 1 at (s)")


def conclude(rows: pandas.DataFrame) -> str:
    """Say how the advantage depends on both."""
    sentences = []
    for metric, unit, digits, better in (
        ("search_time_s", "s", 0, -1),
        ("distance_inspected_m", "m", 1, 1),
    ):
        own = rows[rows["metric"] == metric]
        papers = own[(own["period_s"] == PAPERS[0]) & (own["failure_s"] == PAPERS[1])].iloc[0]
        least, most = (
            own.loc[(better * own["mean_difference"]).agg(kind)] for kind in ("idxmin", "idxmax")
        )
        sure = int(((own["low95"] > 0.0) if better > 0 else (own["high95"] < 0.0)).sum())
        sentences.append(
            f"- {studies.METRICS[metric].capitalize()}: metacontrol is better in {sure} of {len(own)} pairs of values;"
            f" the difference is {studies.shown(papers, unit, digits)} with the paper's values, at best"
            f" {studies.shown(most, unit, digits)} {_named(most)}, at worst {studies.shown(least, unit, digits)}"
            f" {_named(least)}."
        )
    papers = rows[(rows["period_s"] == PAPERS[0]) & (rows["failure_s"] == PAPERS[1])].set_index(
        "metric"
    )
    effect = papers.filter(regex="^failure_(difference|low95|high95)").rename(columns=_EFFECT)
    sentences.append(
        "- With the paper's values the failure itself changes none's search time by"
        f" {studies.shown(effect.loc['search_time_s'])} and its distance by"
        f" {studies.shown(effect.loc['distance_inspected_m'], 'm', 1)}."
    )
    return "\n".join(sentences)


_EFFECT = {
    "failure_difference": "mean_difference",
    "failure_low95": "low95",
    "failure_high95": "high95",
}


def _named(row: pandas.Series) -> str:
    return f"with a period of {row['period_s']:g} s and the failure at {row['failure_s']:g} s"


def main() -> None:
    """Simulate every pair of values, write the table and the figure."""
    chosen = studies.options(__file__, __doc__ or "", runs=24)
    rows = study(chosen.runs, chosen.workers)
    studies.write(chosen, "period_and_failure", rows, draw, conclude, height=2.8)


if __name__ == "__main__":
    main()
