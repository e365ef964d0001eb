"""Read the scenarios that a calibration fits, each with the real missions that belong to it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from suave_des.errors import InputError, did_you_mean
from suave_des.report.runs import choose_names
from suave_des.resources import find
from suave_des.scenario.loader import LoadedScenario, Replacements
from suave_des.validation.conditions import CONDITION, Conditions
from suave_des.validation.real import PAPERS_RUNS, RealRuns, published_for, read_real, read_varied, targets_of
from suave_des.validation.shares import Share, count

if TYPE_CHECKING:
    import pandas

ONLY_CONDITION = 1
"""Number of the condition of missions whose conditions are not known, or do not differ."""


@dataclass(frozen=True)
class Case:
    """A scenario, and the real missions that its simulated ones are to resemble.

        case, = read_cases(["planta_exp1_campaign.yaml"])
        print(case.managers, case.conditions[2])

    Attributes:
        name: by which parameter files and results call it: that of its file, without `_campaign`.
        loaded: the scenario.
        real: a row for each real mission, with the columns of report.runs.COLUMNS and the number of its condition.
        conditions: by number, the values of each condition by key path; none of a scenario that is no campaign's.
        shares: shares of missions in clusters, each with that of the real missions.
        base: the file whose name a fitted scenario has as its base.
        digests: SHA-256 of each file of real missions, by its name.
        notes: what a reader should know about these files.
    """

    name: str
    loaded: LoadedScenario
    real: pandas.DataFrame
    conditions: Mapping[int, Mapping[str, Any]] = field(default_factory=lambda: {ONLY_CONDITION: {}})
    shares: tuple[tuple[Share, float], ...] = ()
    base: str = ""
    digests: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def managers(self) -> tuple[str, ...]:
        """Managers of the real missions, in the order of their names."""
        return tuple(sorted(set(self.real["manager"])))

    @property
    def has_conditions(self) -> bool:
        """Whether its real missions were made under several conditions that are known."""
        return any(self.conditions.values())

    def only(self, numbers: Collection[int]) -> Case:
        """Return the same with some of its conditions and the real missions that were made under them.

        Raises:
            InputError: there is no condition of a number, or no real mission was made under any of them.
        """
        for number in numbers:
            if number not in self.conditions:
                known = ", ".join(map(str, self.conditions))
                remedy = f"its conditions: {known}" if self.has_conditions else "only campaign files have conditions"
                raise InputError(f"{self.name}: there is no condition {number}", remedy=remedy)
        real = self.real[self.real[CONDITION].isin(numbers)].reset_index(drop=True)
        if not len(real):
            listed = ", ".join(map(str, sorted(numbers)))
            raise InputError(f"{self.name}: no real mission was made under conditions {listed}", remedy="choose others")
        shares = _counted([share for share, _ in self.shares], real)
        return replace(
            self, real=real, conditions={number: self.conditions[number] for number in numbers}, shares=shares
        )


def read_cases(
    scenarios: Sequence[str],
    data: Sequence[str] = (),
    managers: str | None = None,
    **replacements: Unpack[Replacements],
) -> tuple[Case, ...]:
    """Read scenarios or campaign files with the real missions of each.

    Args:
        scenarios: scenario or campaign files, or names of shipped ones.
        data: files of real missions. Of one scenario: their names; of several: NAME=FILE with the scenario's name. Left
            out for a scenario, those published for it; of one scenario alone, else those of the SUAVE paper.
        managers: names, separated by commas, of those to compare; left out: all in the data.
        replacements: of the scenarios' files and values, as of load_scenario.

    Raises:
        InputError: a file cannot be used, a scenario is given twice or has no real missions, or no file has a manager.
    """
    names = [Path(each).stem.removesuffix("_campaign") for each in scenarios]
    for place, name in enumerate(names):
        if name in names[:place]:
            remedy = "name each once; several scenarios need files of different names"
            raise InputError(f"scenario {name!r} is given twice", remedy=remedy)
    files = _files(dict(zip(names, scenarios, strict=True)), data)
    read = [_read(given, files[name], replacements) for name, given in zip(names, scenarios, strict=True)]
    known = dict.fromkeys(manager for _, real, _, _ in read for manager in real.managers)
    sources = ", ".join(str(path) for paths in files.values() for path in paths)
    wanted = choose_names(managers, known, sources)
    cases = []
    for name, (loaded, real, conditions, base) in zip(names, read, strict=True):
        own = [manager for manager in wanted if manager in real.managers]
        if not own:
            remedy = f"it has {', '.join(real.managers)}"
            raise InputError(f"{name}: the data have no missions of {', '.join(wanted)}", remedy=remedy)
        real.check_can_be_run(own)
        frame = real.frame[real.frame["manager"].isin(own)].reset_index(drop=True)
        if CONDITION not in frame:
            frame[CONDITION] = ONLY_CONDITION
        made = {number: values for number, values in conditions.items() if number in set(frame[CONDITION])}
        targets, _, _ = targets_of(real)
        shares = _counted([share for share in targets if share.manager in own], frame)
        digests = {file.path.name: file.sha256 for file in real.files}
        cases.append(Case(name, loaded, frame, made, shares, base, digests, real.notes))
    return tuple(cases)


def _files(scenarios: Mapping[str, str], data: Sequence[str]) -> Mapping[str, list[Path]]:
    """Return the files of real missions of each scenario."""
    found: dict[str, list[Path]] = {name: [] for name in scenarios}
    for word in data:
        name, equals, file = word.partition("=")
        if equals and name in scenarios:
            found[name].append(find(file, "scenarios/published"))
        elif len(scenarios) == 1:
            found[next(iter(scenarios))].append(find(word, "scenarios/published"))
        elif equals:
            raise InputError(
                f"there is no scenario {name!r}", place="--data", remedy=did_you_mean(name, scenarios, "given")
            )
        else:
            remedy = f"for instance --data {next(iter(scenarios))}={word}"
            raise InputError(f"{word} could belong to any of {len(scenarios)} scenarios", place="--data", remedy=remedy)
    for name, given in scenarios.items():
        if not found[name]:
            path = published_for(given)
            if path is None and len(scenarios) == 1:
                path = find(PAPERS_RUNS, "scenarios/published")
            if path is None:
                remedy = f"give them with --data {name}=FILE"
                raise InputError(f"{name}: there are no published runs of this scenario", remedy=remedy)
            found[name].append(path)
    return found


def _read(
    given: str, files: Sequence[Path], replacements: Replacements
) -> tuple[LoadedScenario, RealRuns, Mapping[int, Mapping[str, Any]], str]:
    loaded, variation, base = read_varied(given, **replacements)
    if variation.sweep.points == 1:
        return variation.scenario(loaded, 0), read_real(files), {ONLY_CONDITION: {}}, base
    real = read_real(files, Conditions.of(variation.sweep))
    points = (variation.sweep.values(point) for point in range(variation.sweep.points))
    conditions = {
        number: {variation.paths[name]: value for name, value in values.items()}
        for number, values in enumerate(points, 1)
    }
    return loaded, real, conditions, base


def _counted(shares: Sequence[Share], real: pandas.DataFrame) -> tuple[tuple[Share, float], ...]:
    """Count shares in real missions; those of which nothing is known are left out."""
    counted = [(each, count(each, real).share) for each in shares]
    return tuple((each, share) for each, share in counted if share is not None)
