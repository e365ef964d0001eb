"""When it pays to adapt the altitude of the search: metacontrol against searching always at 1, 2 or
3 m.

Metacontrol searches as high as the visibility allows. Which fixed altitude it beats, and by how
much, depends on where the vehicle is when the water is clear. For each visibility, start and
pipeline below, the same runs are made under metacontrol and with each fixed altitude, without a
thruster failure, so that nothing but the search differs; differences are paired by run. A vehicle
that is at every set-point within its second, and sees and decides without delay, shows what of it
is the exemplar's logic and not the vehicle's: `ideal_*` are its search times.

    python analysis/when_adapting_pays.py [--out DIR] [--runs N] [--workers N]
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas
import studies
from matplotlib.axes import Axes
from matplotlib.colors import TwoSlopeNorm
from matplotlib.figure import Figure

SCENARIO, LATER = "seams2023", "release15"
"""All cases are of the first; of the later revision of the exemplar only the paper's."""
POINT_HEIGHTS_M = {SCENARIO: 0.75, LATER: 0.0}
"""How far above the sea bed the detection of the scenario's revision has the pipeline's points."""
LIMIT_S = 300
ALTITUDES_M = {"fd_spiral_low": 1.0, "fd_spiral_medium": 2.0, "fd_spiral_high": 3.0}
EXPECTED_M = {"fd_spiral_high": 3.25, "fd_spiral_medium": 2.25, "fd_spiral_low": 1.25}

Values = dict[str, Any]
Case = tuple[str, str, float, str]
"""Scenario, visibility, y of the start, pipeline."""
NAMES = ["scenario", "visibility", "start_y_m", "pipeline"]


def _sinusoid(
    period_s: float, minimum: float = 1.25, maximum: float = 3.75, shift_s: float = 0.0
) -> Values:
    signal = {
        "kind": "sinusoid",
        "period_s": period_s,
        "minimum": minimum,
        "maximum": maximum,
        "shift_s": shift_s,
    }
    return {"signals.water_visibility": signal}


VISIBILITIES: dict[str, Values] = {
    "period 40 s": _sinusoid(40.0),
    "period 80 s (paper)": _sinusoid(80.0),
    "period 80 s, from murky": _sinusoid(80.0, shift_s=40.0),
    "period 120 s": _sinusoid(120.0),
    "period 240 s": _sinusoid(240.0),
    "1 m less of it": _sinusoid(80.0, 0.25, 2.75),
    "always 2 m": {"signals.water_visibility": {"kind": "constant", "value": 2.0}},
}
EXEMPLARS, EASTERN = "exemplar's", "to the east"
PLACES = {
    (1.5, EXEMPLARS): "1.5 m",
    (2.57, EXEMPLARS): "2.57 m\n(paper)",
    (3.5, EXEMPLARS): "3.5 m",
    (5.0, EXEMPLARS): "5 m",
    (2.57, EASTERN): "3 m to\nthe east",
}
"""Starts, as y, and pipelines, in the words of the figure: how far away the pipeline is."""
PIPELINES_M = {
    EXEMPLARS: ((-15, 0), (-25, 0), (-35, 0), (-37.41, -1), (-44.49, -8.07), (-51.56, -15.14)),
    EASTERN: ((-14, -15), (-14, -5), (-14, 5), (-14, 15)),
}
"""Vertices x, y; the second one lies across the first one's direction."""
PAPERS = (SCENARIO, "period 80 s (paper)", 2.57, EXEMPLARS)


def cases() -> Iterator[Case]:
    """Yield every case."""
    yield from ((SCENARIO, visibility, *place) for place in PLACES for visibility in VISIBILITIES)
    yield (LATER, *PAPERS[1:])


def values_of(_: str, visibility: str, y_m: float, pipeline: str) -> Values:
    """Return what a case changes in the scenario, by key path."""
    vertices_m = [[x_m, y_m, -20.0] for x_m, y_m in PIPELINES_M[pipeline]]
    changed: Values = {"thruster_events": [], "start.y_m": y_m, "pipeline.vertices_m": vertices_m}
    return {**changed, **VISIBILITIES[visibility]}


def study(runs: int, workers: int, chosen: list[Case] | None = None) -> pandas.DataFrame:
    """Run the cases; a row for each and fixed altitude: metacontrol's search time less that of the
    fixed altitude.
    """
    wanted = list(cases()) if chosen is None else chosen
    scenarios = dict.fromkeys(case[0] for case in wanted)
    return pandas.concat(
        [_study([case for case in wanted if case[0] == each], runs, workers) for each in scenarios]
    )


def _study(wanted: list[Case], runs: int, workers: int) -> pandas.DataFrame:
    """Run the cases of one scenario."""
    scenario = wanted[0][0]
    columns = {path: [values_of(*case).get(path) for case in wanted] for path in _paths(wanted)}
    modes = "default_modes.f_generate_search_path"
    adapted = _by_case(
        wanted, studies.missions(scenario, ["metacontrol"], runs, workers, sweep={"zip": columns})
    )
    rows = []
    for mode, altitude_m in ALTITUDES_M.items():
        sweep = {"zip": {**columns, modes: [mode] * len(wanted)}}
        fixed = _by_case(wanted, studies.missions(scenario, ["none"], runs, workers, sweep=sweep))
        for case in wanted:
            ours, theirs = (
                studies.by_run(side[case], "search_time_s") for side in (adapted, fixed)
            )
            row = {**dict(zip(NAMES, case, strict=True)), "against_m": altitude_m}
            row |= {
                "adapted_s": ours.mean(),
                "fixed_s": theirs.mean(),
                **studies.paired(ours, theirs),
            }
            rows.append(
                {**row, "ideal_adapted_s": ideal(case, None), "ideal_fixed_s": ideal(case, mode)}
            )
    return pandas.DataFrame(rows)


def _paths(wanted: list[Case]) -> list[str]:
    return list(dict.fromkeys(path for case in wanted for path in values_of(*case)))


def _by_case(wanted: list[Case], frame: pandas.DataFrame) -> dict[Case, pandas.DataFrame]:
    """Split missions, which come point by point, into the cases."""
    each = len(frame) // len(wanted)
    return {
        case: frame.iloc[place * each : (place + 1) * each] for place, case in enumerate(wanted)
    }


# The exemplar's logic alone: the spiral's arithmetic, the view, the thresholds.


def ideal(case: Case, mode: str | None, start_s: int = 10) -> float:
    """Return when a vehicle finds the pipeline that is at each set-point at once; the time limit if
    it does not.

    Args:
        case: scenario, visibility, y of the start, pipeline.
        start_s: when it begins its spiral: in guided mode, and at the altitude of the search.
        mode: of the search; none: the highest whose expected visibility the water has at the
            moment.
    """
    scenario, visibility, y_m, pipeline = case
    signal = VISIBILITIES[visibility]["signals.water_visibility"]
    points = _points(PIPELINES_M[pipeline])
    radius, step, before = 0.0, 0, None
    for t_s in range(start_s, LIMIT_S):
        clear_m = _visibility(signal, t_s)
        now = mode or next(
            (each for each, needed_m in EXPECTED_M.items() if clear_m >= needed_m), "fd_spiral_low"
        )
        altitude_m = ALTITUDES_M[now]
        step += 1 + (before not in (None, now) or before is None)
        before = now
        radius += 2.0 * altitude_m * math.tan(math.radians(30.0)) * 0.1 / math.tau
        x, y = (
            -17.0 + radius * math.cos(0.1 * (step - 1)),
            y_m + radius * math.sin(0.1 * (step - 1)),
        )
        height_m = altitude_m - POINT_HEIGHTS_M[scenario]
        half_m = height_m * math.tan(math.radians(30.0))
        in_view = (np.abs(points[:, 0] - x) <= half_m) & (np.abs(points[:, 1] - y) <= half_m)
        if height_m <= clear_m and in_view.any():
            return float(t_s)
    return float(LIMIT_S)


def _visibility(signal: Values, t_s: float) -> float:
    if signal["kind"] == "constant":
        return float(signal["value"])
    swing = (signal["maximum"] - signal["minimum"]) / 2.0
    phase = math.tau * (math.floor(t_s) + signal["shift_s"]) / signal["period_s"]
    return float(swing * math.cos(phase) + swing + signal["minimum"])


def _points(vertices_m: tuple[tuple[float, float], ...]) -> np.ndarray[Any, Any]:
    """Return the 20 points of each straight piece, shape (n, 2), as the exemplar's detection has
    them.
    """
    pieces = zip(np.array(vertices_m)[:-1], np.array(vertices_m)[1:], strict=True)
    return np.concatenate([np.linspace(first, last, 21)[1:] for first, last in pieces])


# The figure.


def draw(figure: Figure, rows: pandas.DataFrame) -> None:
    """Draw a panel for each fixed altitude: differences by visibility and by where the pipeline
    is.
    """
    panels = figure.subplots(1, len(ALTITUDES_M), sharey=True)
    norm = TwoSlopeNorm(0.0, -200.0, 200.0)
    for panel, altitude_m in zip(panels, ALTITUDES_M.values(), strict=True):
        own = rows[rows["against_m"] == altitude_m].set_index(NAMES)
        cells = [
            [own.loc[(SCENARIO, visibility, *place)] for place in PLACES]
            for visibility in VISIBILITIES
        ]
        means = [[cell["mean_difference"] for cell in line] for line in cells]
        image = panel.imshow(means, cmap="RdBu_r", norm=norm, aspect="auto")
        panel.grid(False)
        for line, column in np.ndindex(len(VISIBILITIES), len(PLACES)):
            _write(panel, cells[line][column], line, column)
        panel.set_xticks(range(len(PLACES)), list(PLACES.values()), fontsize=6.0)
        panel.set_yticks(range(len(VISIBILITIES)), list(VISIBILITIES))
        panel.set_title(f"against always {altitude_m:g} m")
    figure.supxlabel("distance between start and pipeline", fontsize=8)
    bar = figure.colorbar(image, ax=panels, shrink=0.8, extend="both")
    bar.set_label("metacontrol - fixed altitude:\nsearch time (s); below 0 adapting pays")


def _write(panel: Axes, row: pandas.Series[Any], line: int, column: int) -> None:
    """Write a difference; in brackets if its interval contains 0."""
    unsure = not (row["low95"] > 0.0 or row["high95"] < 0.0)
    text = f"({row['mean_difference']:+.0f})" if unsure else f"{row['mean_difference']:+.0f}"
    colour = "white" if abs(row["mean_difference"]) > 120.0 else "black"
    panel.text(column, line, text, ha="center", va="center", fontsize=6.0, color=colour)


def conclude(rows: pandas.DataFrame) -> str:
    """Say in sentences where adapting pays."""
    every, later = (
        rows[rows["scenario"] == SCENARIO],
        rows[rows["scenario"] == LATER].set_index("against_m"),
    )
    sentences = []
    for altitude_m, own in every.groupby("against_m"):
        pays, costs = int((own["high95"] < 0.0).sum()), int((own["low95"] > 0.0).sum())
        papers, best = own.set_index(NAMES).loc[PAPERS], own.loc[own["mean_difference"].idxmin()]
        sentences.append(
            f"- Against always {altitude_m:g} m metacontrol finds the pipeline sooner in {pays} of {len(own)} cases and"
            f" later in {costs}. The difference is {studies.shown(papers)} with the paper's values"
            f" ({studies.shown(later.loc[altitude_m])} on {LATER}), and at best {studies.shown(best)}, with"
            f" {_named(best)}."
        )
    mean, worst = (
        every.groupby("against_m")["mean_difference"].mean(),
        every.groupby("against_m")["fixed_s"].max(),
    )
    listed = ", ".join(
        f"{value:+.0f} s against {altitude_m:g} m" for altitude_m, value in mean.items()
    )
    limits = ", ".join(f"{value:.0f} s at {altitude_m:g} m" for altitude_m, value in worst.items())
    sentences.append(
        f"- The mean over all cases: {listed}. The worst case: {limits}, {every['adapted_s'].max():.0f} s with"
        " metacontrol."
    )
    apart = every[(every["low95"] > 0.0) | (every["high95"] < 0.0)]
    ideal_difference = apart["ideal_adapted_s"] - apart["ideal_fixed_s"]
    same = int((np.sign(ideal_difference) == np.sign(apart["mean_difference"])).sum())
    sentences.append(
        f"- Of the {len(apart)} differences whose 95% intervals do not contain 0, {same} have the same sign for a"
        f" vehicle that is at each set-point at once and decides without delay. The {len(every)} intervals are not"
        " corrected for their number."
    )
    return "\n".join(sentences)


def _named(row: pandas.Series[Any]) -> str:
    place = PLACES[row["start_y_m"], row["pipeline"]].replace("\n", " ")
    return f"visibility: {row['visibility']}, pipeline: {place}"


def main() -> None:
    """Run every case, write the table and the figure."""
    chosen = studies.options(__file__, __doc__ or "", runs=20)
    rows = study(chosen.runs, chosen.workers)
    studies.write(chosen, "when_adapting_pays", rows, draw, conclude, height=3.2)


if __name__ == "__main__":
    main()
