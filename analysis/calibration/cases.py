"""Read what a calibration fits: scenarios with their real missions, and the parameters that are
free.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from statistics import fmean
from typing import Any

import pandas
import yaml

from suave_des import (
    InputError,
    find,
    load_scenario,
    read_conditions,
    read_real,
    read_targets,
    with_values,
)

CONDITION = "condition"
"""Column with the number of a mission's condition."""
PAPERS_RUNS = "seams2023_runs"
"""The 60 missions published with the SUAVE paper, for scenarios that have none of their own."""
FOLDER = Path(__file__).parent
"""Where files of free parameters are."""
ONLY_CONDITION = 1
"""Number of the condition of missions whose conditions are not known, or do not differ."""


@dataclass(frozen=True)
class Case:
    """A scenario, and the real missions that its simulated ones are to resemble.

    Attributes:
        name: that of its file, without `_campaign`.
        loaded: the scenario.
        real: a row for each real mission, with the columns of records.runs.FRAME_COLUMNS and the
            number of its condition.
        conditions: by number, the values of each condition by key path; none of a scenario that is
            no campaign's.
        shares: shares of missions in clusters, each with that of the real missions.
        base: the scenario's file as another scenario names it.
        digests: SHA-256 of each file of real missions, by its name.
        notes: what a reader should know about these files.
    """

    name: str
    loaded: Any
    real: pandas.DataFrame
    conditions: Mapping[int, Mapping[str, Any]] = field(
        default_factory=lambda: {ONLY_CONDITION: {}}
    )
    shares: tuple[tuple[Any, float], ...] = ()
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
        """Return the same with some of its conditions, and the real missions that were made under
        them.

        Raises:
            InputError: there is no condition of a number.
        """
        unknown = sorted(set(numbers) - set(self.conditions))
        if unknown or not numbers:
            listed = ", ".join(map(str, unknown)) or "left"
            raise InputError(
                f"{self.name}: there is no condition {listed}",
                remedy=f"it has {list(self.conditions)}",
            )
        real = self.real[self.real[CONDITION].isin(numbers)].reset_index(drop=True)
        shares = _counted([share for share, _ in self.shares], real)
        return replace(
            self,
            real=real,
            conditions={number: self.conditions[number] for number in numbers},
            shares=shares,
        )


def read_cases(
    scenarios: Sequence[str], data: Sequence[str] = (), managers: str | None = None
) -> tuple[Case, ...]:
    """Read scenarios or campaign files with the real missions of each.

    Args:
        scenarios: scenario or campaign files, or names of shipped ones.
        data: files of real missions. Of one scenario: their names; of several: NAME=FILE with the
            scenario's name. Left out for a scenario, those published for it; of one scenario alone,
            else those of the SUAVE paper.
        managers: names, separated by commas, of those to compare; left out: all in the data.

    Raises:
        InputError: a file cannot be used, or a scenario has no real missions.
    """
    found: dict[str, Case] = {}
    for given in scenarios:
        case = _read_case(given, _files_of(given, data, only=len(scenarios) == 1), managers)
        if case.name in found:
            raise InputError(f"scenario {case.name} is given twice", remedy="name each once")
        found[case.name] = case
    return tuple(found.values())


def _files_of(given: str, data: Sequence[str], *, only: bool) -> list[Path]:
    """Return the files of real missions of one scenario."""
    name = Path(given).stem.removesuffix("_campaign")
    words = [
        word if only else word.removeprefix(f"{name}=")
        for word in data
        if only or word.startswith(f"{name}=")
    ]
    files = [find(word.removeprefix(f"{name}="), "scenarios/published") for word in words]
    published = find(PAPERS_RUNS, "scenarios/published")
    own = published.with_name(f"{name}_runs.csv")
    if not files and not own.is_file() and not only:
        raise InputError(
            f"{name}: there are no published runs of this scenario",
            remedy=f"give --data {name}=FILE",
        )
    return files or [own if own.is_file() else published]


def _read_case(given: str, files: Sequence[Path], managers: str | None) -> Case:
    base, perturbations = _scenario_of(given)
    loaded = with_values(load_scenario(base), perturbations)
    swept = read_conditions(given)
    conditions: dict[int, dict[str, Any]] = {
        number: dict(values) for number, values in enumerate(swept.to_dict("records"), 1)
    }
    if len(conditions) > 1:
        real = read_real(files, swept)
    else:
        loaded = with_values(loaded, conditions.get(ONLY_CONDITION, {}))
        real = read_real(files)
        conditions = {ONLY_CONDITION: {}}
    own = real.choose(managers.split(",") if managers else ())
    frame = real.frame[real.frame["manager"].isin(own)].reset_index(drop=True)
    if CONDITION not in frame:
        frame[CONDITION] = ONLY_CONDITION
    made = {
        number: values for number, values in conditions.items() if number in set(frame[CONDITION])
    }
    shares = _counted([share for share in read_targets(real)[0] if share.manager in own], frame)
    digests = {path.name: digest for path, digest in real.files.items()}
    name = Path(given).stem.removesuffix("_campaign")
    return Case(name, loaded, frame, made, shares, base, digests, real.notes)


def _scenario_of(given: str) -> tuple[str, dict[str, Any]]:
    """Return the scenario that a campaign file names, and what it perturbs; of a scenario itself
    nothing.
    """
    file = find(given, "scenarios")
    content = yaml.safe_load(file.read_text(encoding="utf-8"))
    if "campaign" not in content:
        return given, {}
    beside = file.with_name(content["scenario"])
    base = str(beside) if beside.is_file() else content["scenario"]
    return base, content.get("perturbations", {})


def _counted(shares: Sequence[Any], real: pandas.DataFrame) -> tuple[tuple[Any, float], ...]:
    """Count shares in real missions; those of which nothing is known are left out."""
    counted = [(each, *each.count(real)) for each in shares]
    return tuple((each, number / n) for each, number, n in counted if n)


@dataclass(frozen=True, slots=True)
class FreeParameter:
    """A parameter to fit.

    Attributes:
        path: key path in the scenarios.
        lower: least value.
        upper: greatest value.
        start: the value that the search starts from.
        scenarios: names of the cases that have it; none: all.
    """

    path: str
    lower: float
    upper: float
    start: float
    scenarios: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Its key path, after the scenarios' names if not all have it."""
        return f"{', '.join(self.scenarios)}: {self.path}" if self.scenarios else self.path

    def is_of(self, case: Case) -> bool:
        """Return whether a case has it."""
        return not self.scenarios or case.name in self.scenarios

    def value(self, unit: float) -> float:
        """Value for a coordinate in [0, 1]; coordinates outside are reflected into it."""
        folded = abs(unit) % 2.0
        return self.lower + (self.upper - self.lower) * (2.0 - folded if folded > 1.0 else folded)


@dataclass(frozen=True, slots=True)
class Problem:
    """What is fitted to what.

    Attributes:
        cases: the scenarios, each with its real missions.
        parameters: what is free.
        runs: simulated missions for each manager of a case and evaluation, in equal parts under its
            conditions.
        seed: seed of the simulated missions; all evaluations use the same streams, so that
            differences between them come from the parameters.
    """

    cases: tuple[Case, ...]
    parameters: tuple[FreeParameter, ...]
    runs: int
    seed: int

    def values_at(self, units: Sequence[float]) -> list[float]:
        """Return the values of the parameters at coordinates, see FreeParameter.value."""
        return [
            parameter.value(float(unit))
            for parameter, unit in zip(self.parameters, units, strict=True)
        ]

    def values_of(self, case: Case, values: Sequence[float]) -> dict[str, float]:
        """Return those of the parameters' values that a case has, by key path."""
        named = zip(self.parameters, values, strict=True)
        return {parameter.path: float(value) for parameter, value in named if parameter.is_of(case)}


def read_problem(path: str | Path, cases: Sequence[Case], runs: int, seed: int) -> Problem:
    """Read a file of free parameters for cases, and put its form into their scenarios.

    Args:
        path: of the file, or its name without suffix if it is in this folder.
        cases: the scenarios to fit with their real missions.
        runs: simulated missions for each manager, as of Problem.
        seed: of the simulated missions.

    Raises:
        InputError: a value or bound is not one of a scenario, or not of this form.
    """
    own = FOLDER / f"{path}.yaml"
    file = own if own.is_file() else Path(path)
    try:
        content = yaml.safe_load(file.read_text(encoding="utf-8"))
        form, entries = content.get("form", {}), content["free"]
        formed = [replace(case, loaded=with_values(case.loaded, form)) for case in cases]
        parameters = tuple(_parameter(formed, **entry) for entry in entries)
    except InputError as error:
        raise InputError(
            f"{file}: {error.problem}", place=error.place, remedy=error.remedy
        ) from None
    except (AttributeError, KeyError, OSError, TypeError, ValueError, yaml.YAMLError) as error:
        problem = f"cannot be used: {error!r}"
        raise InputError(problem, file=file, remedy="analysis/README.md shows the form") from None
    return Problem(tuple(formed), parameters, runs, seed)


def _parameter(
    cases: Sequence[Case],
    path: str,
    lower: float,
    upper: float,
    start: float | None = None,
    scenarios: Sequence[str] | None = None,
) -> FreeParameter:
    own = [case for case in cases if scenarios is None or case.name in scenarios]
    if not own or (scenarios is not None and len(own) < len(scenarios)):
        raise InputError(
            f"{path}: not all of {scenarios} are fitted",
            remedy=f"{[case.name for case in cases]} are",
        )
    for case in own:
        if any(path in values for values in case.conditions.values()):
            raise InputError(
                f"{path} is free, but the conditions of {case.name} set it", remedy="remove it"
            )
        for bound in (lower, upper):
            with_values(case.loaded, {path: bound})
    start = fmean(value_at(case.loaded, path) for case in own) if start is None else start
    if not lower <= start <= upper:
        raise InputError(
            f"{path} starts at {start:g}, outside [{lower:g}, {upper:g}]", remedy="widen the bounds"
        )
    is_of_all = len(own) == len(cases)
    return FreeParameter(
        path, lower, upper, start, () if is_of_all else tuple(case.name for case in own)
    )


def value_at(loaded: Any, path: str) -> Any:
    """Return the value at a key path of a scenario, as plain data.

    Raises:
        KeyError, TypeError: the path leads nowhere.
    """
    value = loaded.scenario.model_dump(mode="json")
    for key in path.split("."):
        value = value[int(key) if isinstance(value, list) else key]
    return value


def fitted_scenario(problem: Problem, case: Case, values: Sequence[float], folder: Path) -> str:
    """Return a scenario file for a folder: the case's scenario with the values of the problem's
    parameters.
    """
    own = problem.values_of(case, values)
    fitted = with_values(case.loaded, own)
    data: dict[str, Any] = {}
    for path in sorted(own):
        *parents, last = path.split(".")
        value = value_at(fitted, path)
        above = value_at(fitted, ".".join(parents)) if parents else None
        if isinstance(above, dict) and "distribution" in above:  # it is replaced as a whole
            *parents, last = parents
            value = {key: each for key, each in above.items() if each is not None}
        here = data
        for part in parents:
            here = here.setdefault(part, {})
        here[last] = value
    if "revision" in data:
        data["revision"] = {"base": fitted.scenario.revision.name, **data["revision"]}
    file = find(case.base, "scenarios")
    is_shipped = file.is_relative_to(find("seams2023", "scenarios").parent)
    base = Path(case.base).name if is_shipped else Path(os.path.relpath(file, folder)).as_posix()
    text = yaml.safe_dump({"base": base, **data}, sort_keys=False, allow_unicode=True)
    return f"# Fitted by analysis/calibrate.py; calibration.json says how.\n{text}"
