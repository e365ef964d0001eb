"""Read real missions from one or several files, each with its condition where a campaign's conditions are known."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Unpack

import numpy as np
import pandas
from numpy.typing import NDArray

from suave_des.campaign.spec import read_campaign_file
from suave_des.campaign.variation import Variation, vary
from suave_des.errors import InputError, number_of
from suave_des.registry import manager_class
from suave_des.report.runs import Runs, choose_names, read_runs
from suave_des.resources import shipped_folder
from suave_des.scenario.loader import LoadedScenario, Replacements, load_scenario
from suave_des.validation.conditions import CONDITION, NUMBER_COLUMNS, Conditions
from suave_des.validation.shares import ConditionLimits, Share, read_targets, shares_beside

PAPERS_RUNS = "seams2023_runs.csv"
"""The 60 missions published with the SUAVE paper, for scenarios that have none of their own."""
_REMEDY = f"add a column {CONDITION} with the number of each mission's condition in the campaign, from 1"


@dataclass(frozen=True)
class RealRuns:
    """Real missions of one or several files.

    Attributes:
        files: as read, in the order given.
        frame: a row for each mission with the columns of report.runs.COLUMNS, file by file; with `condition` if the
            conditions are known.
        notes: what a reader of the comparison should know about the data.
    """

    files: tuple[Runs, ...]
    frame: pandas.DataFrame
    notes: tuple[str, ...]

    @property
    def managers(self) -> Mapping[str, Runs]:
        """Managers in the order of their first missions, each with the first file that has it."""
        found: dict[str, Runs] = {}
        for file in self.files:
            for manager in file.managers:
                found.setdefault(manager, file)
        return found

    def choose(self, wanted: str | None) -> tuple[str, ...]:
        """Choose the managers to compare: those named, separated by commas, or all.

        Raises:
            InputError: one is named twice, or has no mission.
        """
        return choose_names(wanted, self.managers, ", ".join(str(file.path) for file in self.files))

    def check_can_be_run(self, managers: Iterable[str]) -> None:
        """Check that missions of some of its managers can be simulated.

        Raises:
            InputError: there is no such manager, with the line that names it.
        """
        for name in managers:
            try:
                manager_class(name)
            except InputError as error:
                remedy = f"{error.remedy}; or choose others with --managers" if error.remedy else None
                file = self.managers[name]
                raise file.error(file.managers[name], error.problem, remedy) from None


def read_real(paths: Sequence[str | Path], conditions: Conditions | None = None) -> RealRuns:
    """Read real missions.

    Example:
        real = read_real(["bt.csv", "metacontrol.csv"])
        print(real.frame.groupby("manager")["search_time_s"].mean())

    Args:
        paths: of files such as read_runs takes; the exemplar writes one for each manager.
        conditions: of the campaign in which the missions were made. Which one a mission is of follows from columns that
            are named like the campaign's parameters, or `condition` or `block` with its number from 1, or else by
            order: equally many missions of each, one condition after the other, as the exemplar's runner makes them.

    Raises:
        InputError: with file and line: a file cannot be read, two are the same, or a condition cannot be determined.
    """
    names = () if conditions is None else (*conditions.names, *NUMBER_COLUMNS)
    files = [read_runs(path, where_present=names) for path in paths]
    for place, file in enumerate(files):
        for other in files[:place]:
            if file.sha256 == other.sha256:
                raise InputError(f"has the same content as {other.path}", file=file.path, remedy="give each file once")
    notes = [note for file in files if (note := _averages_note(file))]
    frame = pandas.concat([file.frame for file in files], ignore_index=True)
    if conditions is not None:
        parts = [_numbered(file, conditions) for file in files]
        known = [part for part in parts if part is not None]
        if 0 < len(known) < len(parts):
            lacking = next(file.path for file, part in zip(files, parts, strict=True) if part is None)
            problem = "does not say under which condition its missions were made"
            raise InputError(problem, file=lacking, remedy=_REMEDY)
        if not known:
            known = [_in_order(files, frame, conditions)]
            each = f"one after the other, as many missions of each of the {len(conditions)}"
            notes.append(f"The data do not name the conditions of their missions: they are taken in order, {each}.")
        frame[CONDITION] = np.concatenate(known)
        frame = frame[[column for column in frame if column not in names or column == CONDITION]]
    return RealRuns(tuple(files), frame, tuple(notes))


def read_varied(campaign: str | Path, **replacements: Unpack[Replacements]) -> tuple[LoadedScenario, Variation, str]:
    """Read a campaign file's scenario, and what the file sweeps and perturbs; of a scenario, that nothing varies.

    Args:
        campaign: path of a campaign or scenario file, or name of a shipped one.
        replacements: of the scenario's files, as of load_scenario.

    Returns:
        The scenario, what varies in it, and the scenario's own file as a further scenario can name it.

    Raises:
        InputError: a file cannot be used.
    """
    file = read_campaign_file(campaign)
    if file is None:
        return load_scenario(campaign, **replacements), Variation(), str(campaign)
    settings, loaded = file.settings, load_scenario(file.scenario, **replacements)
    try:
        varied = vary(loaded, settings.sweep, settings.perturbations, settings.runs_per_draw, settings.seed)
    except InputError as error:
        raise file.located(error) from None
    return *varied, str(file.scenario)


def read_conditions(campaign: str | Path, **replacements: Unpack[Replacements]) -> Conditions | None:
    """Read the conditions that a campaign file sweeps; none of another file, or if it sweeps none.

    Arguments and errors are those of read_varied.
    """
    file = read_campaign_file(campaign)
    if file is None or not file.settings.sweep:
        return None
    return Conditions.of(read_varied(campaign, **replacements)[1].sweep)


def published_for(scenario: str | Path) -> Path | None:
    """Return the file of the real missions that were published for a scenario or campaign file, if there are any."""
    own = shipped_folder("scenarios/published") / f"{Path(scenario).stem.removesuffix('_campaign')}_runs.csv"
    return own if own.is_file() else None


def targets_of(
    real: RealRuns, given: Path | None = None
) -> tuple[tuple[Share, ...], Mapping[str, ConditionLimits], tuple[Path, ...]]:
    """Read the shares and limits of the file given, or of those beside the data, and name the files.

    Raises:
        InputError: with file and line: one cannot be read, or is not valid.
    """
    paths = (given,) if given else tuple(path for file in real.files if (path := shares_beside(file.path)))
    lists = [read_targets(path) for path in paths]
    shares: list[Share] = []
    for each in lists:
        shares += [share for share in each.shares if share not in shares]
    limits: dict[str, ConditionLimits] = {metric: limit for each in lists for metric, limit in each.conditions.items()}
    return tuple(shares), limits, paths


def _numbered(file: Runs, conditions: Conditions) -> NDArray[np.int64] | None:
    try:
        return conditions.numbers(file.frame)
    except InputError as error:
        raise file.error(file.lines[int(error.place or 0)], error.problem, error.remedy) from None


def _in_order(files: Sequence[Runs], frame: pandas.DataFrame, conditions: Conditions) -> NDArray[np.int64]:
    numbers = conditions.in_order(frame["manager"])
    if numbers is None:
        counts = frame["manager"].value_counts(sort=False)
        manager, count = next((name, count) for name, count in counts.items() if count % len(conditions))
        own = f"{number_of(count, 'mission')} of manager {manager}"
        problem = f"has {own}, which {len(conditions)} conditions do not share evenly"
        raise InputError(problem, file=", ".join(str(file.path) for file in files), remedy=_REMEDY)
    return numbers


def _averages_note(file: Runs) -> str | None:
    if not file.averages:
        return None
    lines = ", ".join(map(str, file.averages))
    return f"{file.path}: line{'s' * (len(file.averages) > 1)} {lines} left out: averages, not missions."
