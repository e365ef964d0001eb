"""Real missions from one or several files, each with its condition, and what a faithful simulation
must be near.

The conditions of a campaign are the points of its sweep: start, time of a failure, shift of the
visibility. A real mission is compared with simulated ones of its own condition, so that what
differs between conditions is not taken for chance. Missions come in clusters: a file of targets
names regions of search time, distance and place of detection, and the share of missions that there
may be in them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, Self, Unpack

import numpy as np
import pandas
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, model_validator

from suave_des.arguments import plain_arguments
from suave_des.campaign.spec import read_campaign_file
from suave_des.campaign.variation import Sweep, cell_of, check_drawn, vary
from suave_des.errors import InputError, line_error, located, number_of
from suave_des.records.runs import Runs, read_runs
from suave_des.resources import shipped_folder
from suave_des.scenario.loader import Replacements, load_scenario
from suave_des.scenario.models import Number, Strict, in_order, wrong
from suave_des.scenario.yamlfile import read_yaml, validated

PAPERS_RUNS = "seams2023_runs.csv"
"""The 60 missions published with the SUAVE paper, for scenarios that have none of their own."""
CONDITION = "condition"
"""Column of a frame of missions: number of the condition, from 1."""
NUMBER_COLUMNS = (CONDITION, "block")
"""Columns of data files that may have that number."""
_RELATIVE, _ABSOLUTE = 1e-3, 0.01
"""Data files give conditions rounded; values as near as this are the same."""
_START_M = 0.25
"""Starts under the same condition differ by no more, apart from a shift that all have."""
_TOLERANCE = 1e-6
"""Places come from sums of steps; an interval must contain the values that it names."""

# Targets

Column = Literal[
    "search_time_s",
    "distance_inspected_m",
    "detection_x_m",
    "pipeline_found",
    "mean_reaction_time_s",
]
Bounds = Annotated[tuple[Number, Number], AfterValidator(in_order)]
Region = dict[Column, Annotated[tuple[Bounds, ...], Field(min_length=1)]]
"""By column the intervals, ends included, one of which must contain the value; an unknown place is
in none.
"""


class Share(Strict):
    """A share of a manager's missions that is compared."""

    manager: str
    name: Annotated[str, Field(min_length=1, max_length=100)]
    """What is counted, in words."""
    of: Literal["runs", "detections"] = "runs"
    """Of all runs, or of those whose place of detection is known."""
    among: Region = Field(default_factory=dict)
    """Only runs in this region are counted; left out: all."""
    where: Annotated[Region, Field(min_length=1)]
    """The region whose share is taken."""
    target: Bounds | None = None
    """Least and greatest share that a faithful simulation may have; left out: the share is only
    printed.
    """

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.target is not None and (self.target[0] < 0 or self.target[1] > 1):
            raise wrong("a share is between 0 and 1", "such as target: [0.25, 0.65]", "target")
        return self


class ConditionLimits(Strict):
    """How near a metric must come where the conditions of the real missions are known."""

    median_difference: Number | None = None
    """Greatest median over the conditions of |simulated - real median|, in the metric's unit; left
    out: any.
    """
    std_ratio: Number | None = None
    """Greatest simulated / real standard deviation within a condition, each a median over the
    conditions.
    """


class Targets(Strict):
    """A file of shares and of other targets."""

    shares: tuple[Share, ...] = ()
    """In the order in which they are printed."""
    conditions: dict[
        Literal["search_time_s", "distance_inspected_m", "mean_reaction_time_s"], ConditionLimits
    ] = Field(default_factory=dict)
    """By metric, over all managers."""


def count(share: Share, runs: pandas.DataFrame) -> tuple[int, int]:
    """Count the missions in a share, and those that it is a share of; runs have the columns of
    records.runs.COLUMNS.
    """
    own = runs[runs["manager"] == share.manager]
    if share.of == "detections":
        own = own[own["detection_x_m"].notna()]
    among = own[_inside(own, share.among)]
    return int(_inside(among, share.where).sum()), len(among)


def _inside(runs: pandas.DataFrame, region: Region) -> pandas.Series[bool]:
    inside = pandas.Series(True, index=runs.index)
    for column, intervals in region.items():
        values = runs[column].astype(float)
        in_one = [values.between(low - _TOLERANCE, high + _TOLERANCE) for low, high in intervals]
        inside &= pandas.concat(in_one, axis=1).any(axis=1)
    return inside


# Conditions


def conditions_of(sweep: Sweep) -> pandas.DataFrame:
    """Return the points of a sweep as conditions: a row for each, with a column for each parameter.

    Example:
        conditions = conditions_of(Sweep(zip={"start.y_m": [2.5, 2.8], "thruster_events.0.time_s":
        [146.4, 91.2]}))
    """
    points = [[*map(cell_of, sweep.values(point).values())] for point in range(sweep.points)]
    return pandas.DataFrame(points, columns=list(sweep.parameters), dtype=object)


def _condition_text(conditions: pandas.DataFrame, number: int) -> str:
    """Return a condition's values, such as "start.y_m=2.455"."""
    return ", ".join(f"{name}={value}" for name, value in conditions.iloc[number - 1].items())


def numbered(runs: pandas.DataFrame, conditions: pandas.DataFrame) -> pandas.DataFrame:
    """Return missions with a column `condition`, the number of each one's condition, from 1; as
    they are without any.

    Of columns named like the parameters, those that are there must agree; without any, one of
    NUMBER_COLUMNS has the numbers; without that, missions are in order, as the exemplar's runner
    makes them: equally many of each condition.

    Raises:
        InputError: about a row, counted from 0 as its place: it is of no condition, or of several;
            or, without a place, a manager's missions do not divide evenly.
    """
    if not len(conditions):
        return runs
    if named := [str(name) for name in conditions if name in runs]:
        return runs.assign(**{CONDITION: _by_values(conditions, runs, named)})
    column = next((name for name in NUMBER_COLUMNS if name in runs), None)
    if column is None:
        return runs.assign(**{CONDITION: _in_order(runs["manager"], len(conditions))})
    numbers = pandas.to_numeric(runs[column], errors="coerce").to_numpy(float)
    for row in np.flatnonzero(~np.isin(numbers, np.arange(1, len(conditions) + 1)))[:1]:
        problem = f"{column}: there is no condition {runs[column].iloc[row]}"
        raise InputError(
            problem, place=str(row), remedy=f"the campaign has {len(conditions)}, counted from 1"
        )
    return runs.assign(**{CONDITION: numbers.astype(np.int64)})


def _by_values(
    conditions: pandas.DataFrame, runs: pandas.DataFrame, named: Sequence[str]
) -> NDArray[np.int64]:
    points = conditions[named].itertuples(index=False, name=None)
    fits = np.array(
        [np.all([*map(_same, (runs[name] for name in named), values)], axis=0) for values in points]
    )
    for row in np.flatnonzero(fits.sum(axis=0) != 1)[:1]:
        given = ", ".join(f"{name}={runs[name].iloc[row]}" for name in named)
        fitting = ", ".join(str(number) for number in 1 + np.flatnonzero(fits[:, row])) or "none"
        shown = "; ".join(
            _condition_text(conditions, number) for number in range(1, min(len(conditions), 8) + 1)
        )
        problem = f"conditions of the campaign that have {given}: {fitting}"
        raise InputError(problem, place=str(row), remedy=f"name one; the campaign has {shown}")
    return np.asarray(1 + fits.argmax(axis=0), dtype=np.int64)


def _in_order(managers: pandas.Series[str], conditions: int) -> NDArray[np.int64]:
    by_manager = managers.groupby(managers, sort=False)
    places, sizes = by_manager.cumcount().to_numpy(), by_manager.transform("size").to_numpy()
    for row in np.flatnonzero(sizes % conditions)[:1]:
        own = f"{number_of(int(sizes[row]), 'mission')} of manager {managers.iloc[row]}"
        remedy = f"add a column {CONDITION} with the number of each mission's condition in the campaign, from 1"
        raise InputError(
            f"has {own}, which {conditions} conditions do not share evenly", remedy=remedy
        )
    return np.asarray(1 + places // (sizes // conditions), dtype=np.int64)


def _same(column: pandas.Series[Any], value: Any) -> NDArray[np.bool_]:
    if isinstance(value, int | float) and not isinstance(value, bool):
        numbers = pandas.to_numeric(column, errors="coerce").to_numpy(float)
        return np.asarray(
            np.isclose(numbers, value, rtol=_RELATIVE, atol=_ABSOLUTE), dtype=np.bool_
        )
    return (column.astype(str) == ("" if value is None else str(value))).to_numpy(bool)


# Missions


@plain_arguments
def read_real(paths: Sequence[str | Path], conditions: pandas.DataFrame | None = None) -> Runs:
    """Read real missions.

    Example:
        real = read_real(["bt.csv", "metacontrol.csv"])
        print(real.frame.groupby("manager")["search_time_s"].mean())

    Args:
        paths: of files such as read_runs takes; the exemplar writes one for each manager.
        conditions: of the campaign in which the missions were made, as of conditions_of. Which one
            a mission is of follows from columns that are named like the campaign's parameters, or
            `condition` or `block` with its number from 1, or else by order: equally many missions
            of each, one condition after the other, as the exemplar's runner makes them.

    Raises:
        InputError: with file and line: a file cannot be read, two are the same, or a condition
            cannot be determined.
    """
    read, files = [read_runs(path) for path in paths], dict[Path, str]()
    for path, digest in (item for runs in read for item in runs.files.items()):
        if same := next((other for other in files if files[other] == digest), None):
            raise InputError(
                f"has the same content as {same}", file=path, remedy="give each file once"
            )
        files[path] = digest
    notes = [f"{note}." for runs in read for note in runs.notes]
    frame = pandas.concat([runs.frame for runs in read], ignore_index=True)
    if conditions is not None and len(conditions):
        named = [name for name in (*conditions, *NUMBER_COLUMNS) if name in frame]
        try:
            frame = numbered(frame, conditions).drop(
                columns=[name for name in named if name != CONDITION]
            )
        except InputError as error:
            if error.place is not None:
                lines = [
                    (path, int(line))
                    for runs in read
                    for path in runs.files
                    for line in runs.frame.index
                ]
                raise line_error(*lines[int(error.place)], error.problem, error.remedy) from None
            raise InputError(
                error.problem, file=", ".join(map(str, files)), remedy=error.remedy
            ) from None
        if not named:
            each = f"one after the other, as many missions of each of the {len(conditions)}"
            notes.append(
                f"The data do not name the conditions of their missions: they are taken in order, {each}."
            )
        texts = (_condition_text(conditions, number) for number in range(1, len(conditions) + 1))
        notes += (f"Condition {number}: {text}" for number, text in enumerate(texts, 1))
    return Runs(files, frame, tuple(notes))


def matched(
    real: pandas.DataFrame, simulated: pandas.DataFrame, names: Sequence[str]
) -> tuple[pandas.DataFrame, pandas.DataFrame]:
    """Return real and simulated missions with the numbers of their conditions, the points of a
    sweep of these names.

    Conditions of real missions are found as by `numbered`; simulated ones are in the order of the
    points.

    Raises:
        InputError: nothing is swept, or the real missions are not of these conditions.
    """
    if not names:
        remedy = (
            "give a campaign that sweeps the conditions, such as import-config --runner-seed writes"
        )
        raise InputError("these missions sweep no conditions", place="assisted by", remedy=remedy)
    with located(place="real missions"):
        real = numbered(real, simulated[list(names)].drop_duplicates().astype(object))
    own = simulated.groupby(list(names), sort=False, dropna=False).ngroup() + 1
    simulated = simulated.assign(**{CONDITION: own})
    for name in real.columns.intersection(simulated.columns).intersection(
        ["initial_x_m", "initial_y_m"]
    ):
        off = real.groupby(CONDITION)[name].mean() - simulated.groupby(CONDITION)[name].mean()
        if ((off - off.median()).abs() > _START_M).any():
            worst = int((off - off.median()).abs().to_numpy().argmax())
            problem = f"{name} is {off.iloc[worst]:+.2f} m from the simulated one under condition {off.index[worst]}"
            remedy = f"under the others it is {off.median():+.2f} m: simulate the same conditions, in the same order"
            raise InputError(problem, place="real missions", remedy=remedy)
    return real, simulated


def read_conditions(campaign: str | Path, **replacements: Unpack[Replacements]) -> pandas.DataFrame:
    """Read the conditions that a campaign file sweeps, as of conditions_of; none if it sweeps none,
    or is a scenario.

    Raises:
        InputError: a file cannot be used.
    """
    file = read_campaign_file(campaign)
    if file is None or not file.settings.sweep:
        return pandas.DataFrame()
    loaded, settings = load_scenario(file.scenario, **replacements), file.settings
    try:
        varied = vary(loaded, settings.sweep, settings.perturbations, settings.runs_per_draw)
        check_drawn(*varied)
    except InputError as error:
        raise file.located(error) from None
    return conditions_of(varied[1].sweep)


def published_for(scenario: str | Path) -> Path | None:
    """Return the file of the real missions that were published for a scenario or campaign file, if
    there are any.
    """
    own = (
        shipped_folder("scenarios/published")
        / f"{Path(scenario).stem.removesuffix('_campaign')}_runs.csv"
    )
    return own if own.is_file() else None


def targets_of(
    real: Runs, given: Path | None = None
) -> tuple[tuple[Share, ...], Mapping[str, ConditionLimits], tuple[Path, ...]]:
    """Read the shares and limits of the file given, or of NAME.targets.yaml beside each NAME.csv,
    and name the files.

    Raises:
        InputError: with file and line: one cannot be read, or is not valid.
    """
    beside = [path.with_suffix(".targets.yaml") for path in real.files]
    paths = (given,) if given else tuple(path for path in beside if path.is_file())
    lists = [validated(read_yaml(path), Targets) for path in paths]
    shares: list[Share] = []
    for each in lists:
        shares += [share for share in each.shares if share not in shares]
    limits: dict[str, ConditionLimits] = {
        metric: limit for each in lists for metric, limit in each.conditions.items()
    }
    return tuple(shares), limits, paths
