"""Real missions from one or several files, each with its condition, and what a faithful simulation
must be near.

The conditions of a campaign are the points of its sweep: start, time of a failure, shift of the
visibility. A real mission is compared with simulated ones of its own condition, so that what
differs between conditions is not taken for chance. Missions come in clusters: a file of targets
names regions of search time, distance and place of detection, and the share of missions that there
may be in them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import combinations
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
from suave_des.records.metrics import FOUND, SEARCH_TIME, metric_of
from suave_des.records.runs import (
    CONDITION,
    FRAME_COLUMNS,
    NUMBER_COLUMNS,
    TIME_LIMIT,
    Runs,
    check_one_mission,
    read_runs,
)
from suave_des.resources import shipped_folder
from suave_des.results.horizon import SAME_LIMIT_S
from suave_des.scenario.loader import Replacements, load_scenario
from suave_des.scenario.models import Number, Strict, in_order, wrong
from suave_des.scenario.yamlfile import read_yaml, validated

PAPERS_RUNS = "seams2023_runs.csv"
"""The 60 missions published with the SUAVE paper, for scenarios that have none of their own."""
_RELATIVE, _ABSOLUTE = 1e-3, 0.01
"""Data files give conditions rounded; values as near as this are the same."""
_STARTS = {"start.x_m": "initial_x_m", "start.y_m": "initial_y_m"}
"""Parameters that place the vehicle, and columns that say where missions began."""
_START_M = 0.25
"""Starts under the same condition differ by no more, apart from a shift that all have."""
_DRAW = "draw the conditions of the population as those of the real missions were drawn"
_BEYOND, _BEYOND_OF_FEW = 0.05, 5.0
"""How far a real condition may be beyond those drawn, in parts of their range: so much, and so much
divided by the number of draws.
"""
_SURELY = 0.001
"""p below which real conditions are not of a population."""
_OF_CAMPAIGNS = ("source", "ensemble_member")
_GIVE_NUMBERS = (
    f"add a column {CONDITION} with the number of each mission's condition in the campaign, from 1"
)
_TOLERANCE = 1e-6
"""Places come from sums of steps; an interval must contain the values that it names."""
_Numbers = NDArray[np.int64]
"""Of the conditions of missions, from 1."""

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

    def count(self, runs: pandas.DataFrame) -> tuple[int, int]:
        """Count the missions in this share, and those that it is a share of; runs have the columns
        of records.runs.COLUMNS.
        """
        own = runs[runs["manager"] == self.manager]
        if self.of == "detections":
            own = own[own["detection_x_m"].notna()]
        among = own[_inside(own, self.among)]
        return int(_inside(among, self.where).sum()), len(among)


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


def numbered(
    runs: pandas.DataFrame,
    conditions: pandas.DataFrame,
    runs_each: int | None = None,
    starts: pandas.DataFrame | None = None,
) -> pandas.DataFrame:
    """Return missions with a column `condition`, the number of each one's condition, from 1; as
    they are without any.

    Of columns named like the parameters, those that are there must agree; without any, one of
    NUMBER_COLUMNS has the numbers; without that, missions are in order, as the exemplar's runner
    makes them: of each condition equally many in a row, and of the last as many or fewer.

    Args:
        runs: missions.
        conditions: as of conditions_of.
        runs_each: how many missions of a condition are made in a row, if that is known.
        starts: where missions of each condition begin, initial_x_m and initial_y_m; by default as
            the conditions have it.

    Raises:
        InputError: about a row, counted from 0 as its place: it is of no condition, or of several;
            or, without a place, the order of a manager's missions does not tell their conditions.
    """
    if not len(conditions):
        return runs
    if named := [str(name) for name in conditions if name in runs]:
        return runs.assign(**{CONDITION: _by_values(conditions, runs, named)})
    column = next((name for name in NUMBER_COLUMNS if name in runs), None)
    if column is None:
        starts = _starts_of(conditions) if starts is None else starts
        return runs.assign(**{CONDITION: _in_order(runs, len(conditions), runs_each, starts)})
    numbers = pandas.to_numeric(runs[column], errors="coerce").to_numpy(float)
    for row in np.flatnonzero(~np.isin(numbers, np.arange(1, len(conditions) + 1)))[:1]:
        problem = f"{column}: there is no condition {runs[column].iloc[row]}"
        raise InputError(
            problem, place=str(row), remedy=f"the campaign has {len(conditions)}, counted from 1"
        )
    return runs.assign(**{CONDITION: numbers.astype(np.int64)})


def _by_values(
    conditions: pandas.DataFrame, runs: pandas.DataFrame, named: Sequence[str]
) -> _Numbers:
    columns = [runs[name] for name in named]
    points = conditions[named].itertuples(index=False, name=None)
    fits = np.array([np.all([*map(_same, columns, values)], axis=0) for values in points])
    for row in np.flatnonzero(fits.sum(axis=0) != 1)[:1]:
        given = ", ".join(f"{name}={runs[name].iloc[row]}" for name in named)
        fitting = ", ".join(str(number) for number in 1 + np.flatnonzero(fits[:, row])) or "none"
        shown = "; ".join(
            _condition_text(conditions, number) for number in range(1, min(len(conditions), 8) + 1)
        )
        problem = f"conditions of the campaign that have {given}: {fitting}"
        raise InputError(problem, place=str(row), remedy=f"name one; the campaign has {shown}")
    return np.asarray(1 + fits.argmax(axis=0), dtype=np.int64)


def _starts_of(conditions: pandas.DataFrame) -> pandas.DataFrame:
    """Return where the vehicle is placed under each condition, as far as conditions differ in
    it.
    """
    return conditions[[name for name in _STARTS if name in conditions]].rename(columns=_STARTS)


def _in_order(
    runs: pandas.DataFrame, conditions: int, runs_each: int | None, starts: pandas.DataFrame
) -> _Numbers:
    """Number the conditions of missions by their order, manager by manager."""
    numbers = np.zeros(len(runs), dtype=np.int64)
    for manager, rows in runs.groupby("manager", sort=False).indices.items():
        own = runs.iloc[rows]
        block = _block(own, conditions, runs_each, starts)
        if isinstance(block, str):
            problem = f"has {number_of(len(own), 'mission')} of manager {manager}, {block}"
            raise InputError(problem, remedy=_GIVE_NUMBERS)
        numbers[rows] = _in_blocks(own, block)
    return numbers


def _block(
    missions: pandas.DataFrame, conditions: int, runs_each: int | None, starts: pandas.DataFrame
) -> int | str:
    """Return how many missions of each condition are in a row, of the last as many or fewer; or why
    that is not known.
    """
    number = len(missions)
    possible = _possible_blocks(number, conditions)
    fitting = [
        each for each in possible if _starts_fit(missions, _in_blocks(missions, each), starts)
    ]
    if runs_each in fitting:
        return runs_each
    if possible and not fitting:
        return f"which do not begin where the {conditions} conditions have their starts, in order"
    is_uneven = number % conditions > 0
    if not possible or (is_uneven and missions.columns.intersection(starts.columns).empty):
        return f"which {conditions} conditions do not share evenly"
    if len(fitting) > 1:
        each = f"{fitting[0]} or {fitting[1]}"
        return f"which may be {each} in a row of each of {conditions} conditions"
    return fitting[0]


def _possible_blocks(number: int, conditions: int) -> list[int]:
    """Return how many missions in a row may be of one condition, the last of which may have fewer,
    so that there are so many conditions.
    """
    return [each for each in range(1, number + 1) if -(-number // each) == conditions]


def _in_blocks(missions: pandas.DataFrame, block: int) -> _Numbers:
    return np.arange(len(missions), dtype=np.int64) // block + 1


def _starts_fit(missions: pandas.DataFrame, numbers: _Numbers, starts: pandas.DataFrame) -> bool:
    """Return whether each mission begins where its condition has its start, as far as that is
    known.
    """
    own = missions.assign(**{CONDITION: numbers})
    return all(
        (_starts_off(own, starts, name).abs() <= _START_M).all() for name in map(str, starts)
    )


def _starts_off(
    missions: pandas.DataFrame, starts: pandas.DataFrame, name: str
) -> pandas.Series[float]:
    """Return how far missions with numbers of conditions begin from their condition's start, apart
    from a shift that all have; empty if that is not known.
    """
    if name not in missions:
        return pandas.Series(dtype=float)
    recorded = pandas.to_numeric(missions[name], errors="coerce")
    planned = pandas.to_numeric(starts[name], errors="coerce").to_numpy(float)
    off: pandas.Series[float] = recorded - planned[missions[CONDITION].to_numpy() - 1]
    return (off - off.median()).dropna()


def _check_starts(missions: pandas.DataFrame, starts: pandas.DataFrame) -> None:
    """Check that real missions with numbers of conditions begin where their conditions have their
    starts, on average.

    Raises:
        InputError: those of one manager and condition begin elsewhere.
    """
    for name in map(str, starts):
        off = _starts_off(missions, starts, name)
        rows = missions.loc[off.index].assign(off=off)
        means = rows.groupby(["manager", CONDITION], as_index=False, observed=True)["off"].mean()
        for each in means[means["off"].abs() > _START_M].to_dict("records")[:1]:
            whose = f"{name} of manager {each['manager']} under condition {each[CONDITION]}"
            problem = f"{whose} is {each['off']:+.2f} m from where the other missions let expect it"
            remedy = "give the conditions in the order, or with the numbers, that the missions have"
            raise InputError(problem, remedy=remedy)


def _same(column: pandas.Series[Any], value: Any) -> NDArray[np.bool_]:
    if isinstance(value, int | float) and not isinstance(value, bool):
        numbers = pandas.to_numeric(column, errors="coerce").to_numpy(float)
        return np.asarray(
            np.isclose(numbers, value, rtol=_RELATIVE, atol=_ABSOLUTE), dtype=np.bool_
        )
    return (column.astype(str) == ("" if value is None else str(value))).to_numpy(bool)


# Missions


@plain_arguments
def read_real(
    paths: Sequence[str | Path],
    conditions: pandas.DataFrame | None = None,
    runs_each: int | None = None,
) -> Runs:
    """Read real missions.

    Example:
        real = read_real(["bt.csv", "metacontrol.csv"])
        print(real.frame.groupby("manager")["search_time_s"].mean())

    Args:
        paths: of files such as read_runs takes; the exemplar writes one for each manager.
        conditions: of the campaign in which the missions were made, as of read_conditions. Which one
            a mission is of follows from columns that are named like the campaign's parameters, or
            `condition` or `block` with its number from 1, or else by order: equally many missions
            of each, one condition after the other, as the exemplar's runner makes them.
        runs_each: how many missions of a condition are made in a row, if that is known.

    Raises:
        InputError: with file and line: a file cannot be read, two are the same, a manager has
            several of the exemplar's missions, or a condition cannot be determined.
    """
    read = [read_runs(path) for path in paths]
    files = _each_once(read)
    notes = [f"{note}." for runs in read for note in runs.notes]
    frame = pandas.concat([runs.frame for runs in read], ignore_index=True)
    check_one_mission(frame, ", ".join(map(str, files)))
    if conditions is None or conditions.empty:
        return Runs(files, frame, tuple(notes))
    named = frame.columns.intersection([*conditions, *NUMBER_COLUMNS])
    with _at_their_lines(read):
        frame = numbered(frame, conditions, runs_each)
        _check_starts(frame, _starts_of(conditions))
    frame = frame.drop(columns=named.difference([CONDITION]))
    if named.empty:
        notes.append(
            "The data do not name the conditions of their missions: they are taken in order,"
            f" {_missions_each(frame)}."
        )
    for number in range(1, len(conditions) + 1):
        notes.append(f"Condition {number}: {_condition_text(conditions, number)}")
    return Runs(files, frame, tuple(notes))


def _each_once(read: Sequence[Runs]) -> dict[Path, str]:
    """Return the files of missions with their digests; no two may have the same content."""
    known: dict[str, Path] = {}
    for runs in read:
        for path, digest in runs.files.items():
            if digest in known:
                problem = f"has the same content as {known[digest]}"
                raise InputError(problem, file=path, remedy="give each file once")
            known[digest] = path
    return {path: digest for digest, path in known.items()}


@contextmanager
def _at_their_lines(read: Sequence[Runs]) -> Iterator[None]:
    """Give errors about a row of all these missions its file and line, and others the files."""
    try:
        yield
    except InputError as error:
        lines = [(path, line) for runs in read for path in runs.files for line in runs.frame.index]
        if error.place is not None:
            path, line = lines[int(error.place)]
            raise line_error(path, int(line), error.problem, error.remedy) from None
        files = ", ".join(dict.fromkeys(str(path) for path, _ in lines))
        raise InputError(error.problem, file=files, remedy=error.remedy) from None


def _missions_each(frame: pandas.DataFrame) -> str:
    """Say how many missions each manager has of each condition."""
    sizes = frame.groupby(["manager", CONDITION], sort=False).size().unstack(fill_value=0)
    texts = sizes.astype(str).agg(", ".join, axis=1)
    if texts.nunique() == 1:
        return f"{texts.iloc[0]} of each manager"
    return "; ".join(f"{text} of {name}" for name, text in texts.items())


# Time limits


def common_limit_s(sides: Mapping[str, pandas.DataFrame]) -> float:
    """Check that missions that are compared had one time limit, and return it in whole seconds;
    infinite if it is not known.

    A limit is that of a column `time_limit_s`, or else the time at which the missions of a manager
    ended that lasted longest, of those whose duration is known or that never found the pipeline.

    Args:
        sides: missions, by what errors call them.

    Raises:
        InputError: the missions of a manager had several limits.
    """
    limits_s = {place: _limits_s(frame, place) for place, frame in sides.items()}
    longest_s = {
        place: frame.groupby("manager", observed=True)[SEARCH_TIME].max()
        for place, frame in sides.items()
    }
    for (other, theirs), (place, ours) in combinations(limits_s.items(), 2):
        for manager in ours.index.intersection(theirs.index):
            ends_s = _end_s(ours[manager], theirs[manager], longest_s[place][manager])
            others_s = _end_s(theirs[manager], ours[manager], longest_s[other][manager])
            if abs(ends_s - others_s) > SAME_LIMIT_S:
                problem = f"missions of {manager} end after {ends_s:.0f} s, {other} after {others_s:.0f} s"
                remedy = (
                    f"give missions with one time limit, or, if they had one, a column {TIME_LIMIT}"
                )
                raise InputError(problem, place=place, remedy=remedy)
    known_s = [each.max() for each in limits_s.values() if each.notna().any()]
    return math.floor(min(known_s)) if known_s else math.inf


def _end_s(limit_s: float, others_s: float, longest_s: float) -> float:
    """Return a limit, or, where it is not known, the others', unless a search took longer."""
    if math.isnan(limit_s):
        return max(float(others_s), float(longest_s))
    return float(limit_s)


def _limits_s(frame: pandas.DataFrame, place: str) -> pandas.Series[float]:
    """Return the time limit of missions by manager; nan if it is not known."""
    managers = frame["manager"].astype(str)
    declared = frame.get(TIME_LIMIT, pandas.Series(math.nan, frame.index)).astype(float)
    if declared.max() - declared.min() > SAME_LIMIT_S:
        problem = f"there are time limits of {declared.min():g} and of {declared.max():g} s"
        raise InputError(problem, place=place, remedy="give missions with one time limit")
    lost_s = frame[SEARCH_TIME].where(frame[FOUND].astype("Float64").eq(0.0).fillna(False))
    durations_s = frame.get("mission_duration_s", lost_s).astype(float)
    ends_s = declared.fillna(declared.max()).fillna(durations_s).fillna(lost_s)
    return ends_s.groupby(managers).max()


def matched(
    real: pandas.DataFrame,
    same: pandas.DataFrame,
    population: pandas.DataFrame,
    names: Sequence[str],
) -> tuple[pandas.DataFrame, pandas.DataFrame, pandas.DataFrame]:
    """Return real missions and those that assist them: with the numbers of their conditions, those
    simulated under the same conditions, likewise, and a population with the numbers of its draws.

    Conditions are the points of a sweep of these names. Those of real missions are found as by
    `numbered`; simulated ones are in the order of the points. Missions of a population that have
    the same values are of one draw.

    Raises:
        InputError: nothing is swept, the real missions are not of these conditions, or the
            population is of another scenario, or drawn otherwise than the real conditions were.
    """
    if not names:
        remedy = (
            "give a campaign that sweeps the conditions, such as import-config --runner-seed writes"
        )
        raise InputError("these missions sweep no conditions", place="assisted by", remedy=remedy)
    names = list(names)
    by_point = same.groupby(names, sort=False, dropna=False)
    starts = by_point[[name for name in _STARTS.values() if name in same]].mean()
    with located(place="real missions"):
        conditions = same[names].drop_duplicates().astype(object).reset_index(drop=True)
        real = numbered(real, conditions, starts=starts)
        _check_starts(real, starts)
    same = same.assign(**{CONDITION: by_point.ngroup() + 1})
    with located(place="population"):
        _check_scenario(same, population, names)
        draws = population[names].drop_duplicates()
        flown = conditions.loc[sorted(set(real[CONDITION] - 1))]
        for name in names:
            _check_drawn(name, flown[name], draws[name])
        for both in map(list, combinations(names, 2)):
            if _vary_together(flown[both]) and not _vary_together(draws[both]):
                problem = f"it draws {' and '.join(both)} apart, which the real conditions do not"
                raise InputError(problem, remedy=_DRAW)
    by_draw = population.groupby(names, sort=False, dropna=False)
    return real, same, population.assign(draw=by_draw.ngroup())


def _check_scenario(
    same: pandas.DataFrame, population: pandas.DataFrame, names: Sequence[str]
) -> None:
    """Check that a population is of the scenario of the missions under the real conditions, and
    varies in what these vary in.
    """
    ours = sorted(set(same["scenario"]) - {""})
    theirs = sorted(set(population["scenario"]) - {""})
    if ours and theirs and ours != theirs:
        problem = f"it is of scenario {theirs[0]}, and the missions under the real conditions of {ours[0]}"
        raise InputError(problem, remedy="give campaigns of one scenario")
    for name in names:
        if name not in population:
            problem = f"it does not draw {name}, in which the real conditions differ"
            raise InputError(problem, remedy=_DRAW)
    known = {*FRAME_COLUMNS, *same, *_OF_CAMPAIGNS}
    for name in map(str, population):
        if name not in known and metric_of(name) is None and population[name].nunique() > 1:
            problem = (
                f"it draws {name}, which is one for all the missions under the real conditions"
            )
            raise InputError(problem, remedy=_DRAW)


def _check_drawn(name: str, flown: pandas.Series[Any], drawn: pandas.Series[Any]) -> None:
    """Check that the values of a parameter under the real conditions may be from those drawn."""
    from scipy.stats import ks_2samp

    values = pandas.to_numeric(flown, errors="coerce")
    numbers = pandas.to_numeric(drawn, errors="coerce")
    if values.isna().any() or numbers.isna().any():
        known = set(drawn.astype(str))
        for value in flown[~flown.astype(str).isin(known)][:1]:
            raise InputError(f"it never draws {name}={value}, a real condition", remedy=_DRAW)
        return
    low = float(numbers.min())
    high = float(numbers.max())
    beyond = (high - low) * (_BEYOND + _BEYOND_OF_FEW / len(numbers)) + _ABSOLUTE
    for value in values[(values < low - beyond) | (values > high + beyond)][:1]:
        problem = f"it draws {name} from {low:g} to {high:g}, and a real condition has {value:g}"
        raise InputError(problem, remedy=_DRAW)
    if ks_2samp(values, numbers).pvalue < _SURELY:
        problem = f"it draws {name} otherwise than the real conditions are spread"
        ends = f"{low:g} to {high:g}, and these {values.min():g} to {values.max():g}"
        raise InputError(f"{problem}: from {ends} (Kolmogorov-Smirnov p < {_SURELY})", remedy=_DRAW)


def _vary_together(values: pandas.DataFrame) -> bool:
    """Return whether two parameters vary, and differ by the same in all conditions."""
    one, other = values.apply(pandas.to_numeric, errors="coerce").to_numpy(float).T
    return len(set(one)) > 2 and bool(np.ptp(one - other) <= _ABSOLUTE)


@plain_arguments
def read_conditions(campaign: str | Path, **replacements: Unpack[Replacements]) -> pandas.DataFrame:
    """Read the conditions that a campaign file sweeps: a row for each, with a column for each
    parameter; none if it sweeps none, or is a scenario.

    Example:
        real = read_real(["my_real_runs.csv"], read_conditions("my_campaign.yaml"))

    Args:
        campaign: path of a campaign or scenario file, or name of a shipped one.
        replacements: as of load_scenario.

    Raises:
        InputError: a file cannot be used.
    """
    file = read_campaign_file(campaign)
    if file is None or not file.settings.sweep:
        return pandas.DataFrame()
    loaded = load_scenario(file.scenario, **replacements)
    settings = file.settings
    try:
        varied = vary(loaded, settings.sweep, settings.perturbations, settings.runs_per_draw)
        check_drawn(*varied)
    except InputError as error:
        raise file.located(error) from None
    return conditions_of(varied[1].sweep)


def runs_in_a_row(campaign: str | Path) -> int | None:
    """Return how many missions of each condition a campaign file asks for, if it does."""
    file = read_campaign_file(campaign)
    if file is None or "runs" not in file.settings.model_fields_set:
        return None
    return file.settings.runs


def published_for(scenario: str | Path) -> Path | None:
    """Return the file of the real missions that were published for a scenario or campaign file, if
    there are any.
    """
    name = Path(scenario).stem.removesuffix("_campaign")
    own = shipped_folder("scenarios/published") / f"{name}_runs.csv"
    return own if own.is_file() else None


@plain_arguments
def read_targets(
    real: Runs, given: Path | None = None
) -> tuple[tuple[Share, ...], Mapping[str, ConditionLimits], tuple[Path, ...]]:
    """Read what a faithful simulation must be near, for `validate`.

    Example:
        real = read_real(["my_real_runs.csv"])
        shares, limits, files = read_targets(real)

    Args:
        real: as of read_real.
        given: the file; left out: NAME.targets.yaml beside each NAME.csv of the real missions.

    Returns:
        Shares of missions, limits by metric, and the files.

    Raises:
        InputError: with file and line: one cannot be read, or is not valid.
    """
    beside = (path.with_suffix(".targets.yaml") for path in real.files)
    paths = (given,) if given else tuple(filter(Path.is_file, beside))
    shares: list[Share] = []
    limits: dict[str, ConditionLimits] = {}
    for path in paths:
        targets = validated(read_yaml(path), Targets)
        shares += [share for share in targets.shares if share not in shares]
        limits.update(targets.conditions.items())
    return tuple(shares), limits, paths
