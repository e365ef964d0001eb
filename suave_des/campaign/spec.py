"""The specification of a campaign, campaign files, and the checks of both."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any, cast

from pydantic import Field

from suave_des.campaign.stopping import UntilCi, parse_until_ci
from suave_des.errors import InputError, shown
from suave_des.registry import is_built_in, manager_class
from suave_des.resources import find
from suave_des.scenario.layers import InputFiles, find_named
from suave_des.scenario.loader import Replacements
from suave_des.scenario.problems import validated
from suave_des.scenario.quantities import Number, Strict
from suave_des.scenario.yamlfile import Layer

FORMAT = 1
"""Version of the format of campaign files."""
RUNS_LIMIT = 1_000_000
RUNS_LIMIT_DEFAULT = 10_000
"""Runs at most, when a limit to the interval is given and no number of runs."""
SEED_LIMIT = 2**63 - 1
"""The greatest that tools which read the result files can hold."""
_WORKERS = 2
_FEW_MISSIONS = 300
"""So many take one process no longer than two, which load the compiler first."""
_WORKERS_PER_CORE = 4
_LONGEST_TIME_OUT_S = 1e6


class CampaignSettings(Strict):
    """What a campaign file may contain; values given on the command line or in a call take precedence.

    Attributes:
        campaign: version of the format: 1.
        scenario: to start from: a file named relative to this one, or the name of a shipped one.

    The others are described at CampaignSpec.
    """

    campaign: int
    scenario: str
    managers: tuple[str, ...] = ("none", "random", "metacontrol")
    runs: Annotated[int, Field(strict=True)] = 20
    seed: Annotated[int, Field(strict=True)] = 1
    time_out_s: Number = 120.0
    until_ci: str | None = None
    perturbations: dict[str, Any] = Field(default_factory=dict)
    runs_per_draw: Annotated[int, Field(strict=True)] = 1
    sweep: dict[str, Any] = Field(default_factory=dict)
    ensemble: str | None = None


_DEFAULTS = CampaignSettings(campaign=FORMAT, scenario="")
_FILE_KEYS = tuple(name for name in CampaignSettings.model_fields if name not in ("campaign", "scenario"))
_NOT_STORED = ("out", "workers", "scheduler", "overwrite", "confirmed")
"""How and where a campaign runs, which does not decide its results; it may differ when it is resumed."""


_CONVERSIONS: Mapping[str, Callable[[Any], Any]] = {
    **dict.fromkeys(("ontologies", "rules"), lambda paths: tuple(map(str, paths))),
    **dict.fromkeys(("managers", "disabled_rules", "command"), tuple),
    **dict.fromkeys(("modes_file", "ensemble"), str),
    "out": Path,
}
"""Of options that may be given in several forms."""


@dataclass(frozen=True)
class CampaignSpec:
    """The specification of a campaign. Make one with `of`, which leaves missing values to the campaign file.

        spec = CampaignSpec.of("seams2023", managers=["none", "metacontrol"], runs=100, out="results")

    Attributes:
        scenario: path of a scenario or campaign file, or name of a shipped scenario.
        managers: names, or module:Class.
        runs: missions for each manager, at each point of the sweep; with `until_ci` at most, and 10,000 if left out.
        seed: of everything that is random.
        time_out_s: wall-clock time that a mission may take.
        until_ci: METRIC:HALF_WIDTH: a manager is stopped, at each point separately, when half the 95% interval of the
            metric's mean is less. MANAGER - MANAGER: METRIC: HALF_WIDTH: all are stopped after the same run, when half
            the 95% interval of the difference of these two, run by run, is less. None: never.
        sweep: lists of values by key path of the scenario, each combined with each; or a mapping with `grid` (the
            same), `zip` (lists of which the first values go together, then the second) and `sample` (a sampled design:
            `method` latin_hypercube or sobol, `points`, and `ranges` by key path), which are combined with each other.
            Each parameter is a column of runs.csv.
        perturbations: distributions by key path of the scenario: each run draws its own value, the same under all
            managers and at all points. Each is a column of runs.csv.
        runs_per_draw: number of consecutive runs that share a draw.
        ensemble: CSV file of parameter sets that fit the real runs equally well, or name of a shipped one: each run has
            one of them, the same under all managers; see docs/guides/ensembles.md.
        ontologies: files in place of the scenario's.
        modes_file: file in place of the scenario's.
        reasoner: in place of the scenario's.
        rules: files of rules as text, in addition to the scenario's.
        disabled_rules: names of rules to disable, in addition to the scenario's.
        values: new values by key path of the scenario.
        manager_options: settings of managers, by manager and key.
        suave_format: whether the exemplar's own results file is written, too.
        parquet: whether runs.parquet is written, too; it needs pyarrow.
        record_knowledge: whether the states that managers reasoned about are kept, for `kb try`.
        out: folder for the result files; it is made if its parent exists. None: no files.
        workers: processes; with 1 the missions run in this one. None: 2, or 1 for few missions of built-in managers.
        scheduler: address of a Dask scheduler, such as tcp://127.0.0.1:8786, on whose workers missions run instead.
        overwrite: whether results in the folder may be replaced.
        confirmed: whether more than a million missions are meant.
        from_file: names of those above that the campaign file decides, or else the defaults.
        folder: where relative paths begin.
        command: the command line, for the manifest.
    """

    scenario: str
    managers: tuple[str, ...] = _DEFAULTS.managers
    runs: int = _DEFAULTS.runs
    seed: int = _DEFAULTS.seed
    ontologies: tuple[str, ...] = ()
    modes_file: str | None = None
    reasoner: str | None = None
    rules: tuple[str, ...] = ()
    disabled_rules: tuple[str, ...] = ()
    values: Mapping[str, Any] = field(default_factory=dict)
    manager_options: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    suave_format: bool = False
    parquet: bool = False
    record_knowledge: bool = False
    time_out_s: float = _DEFAULTS.time_out_s
    until_ci: str | None = None
    sweep: Mapping[str, Any] = field(default_factory=dict)
    perturbations: Mapping[str, Any] = field(default_factory=dict)
    runs_per_draw: int = 1
    ensemble: str | None = None
    from_file: tuple[str, ...] = ()
    folder: str = ""
    command: tuple[str, ...] = ()
    out: Path | None = None
    workers: int | None = None
    scheduler: str | None = None
    overwrite: bool = False
    confirmed: bool = False

    @classmethod
    def of(cls, scenario: str | Path, **options: Any) -> CampaignSpec:
        """Make a specification from options by name; None leaves one to the campaign file, or to the defaults."""
        given = {name: value for name, value in options.items() if value is not None}
        given |= {name: convert(given[name]) for name, convert in _CONVERSIONS.items() if name in given}
        left_out = tuple(name for name in _FILE_KEYS if name not in given)
        return cls(str(scenario), **given, from_file=left_out, folder=str(Path.cwd()))

    def with_file(self, file: CampaignFile | None) -> CampaignSpec:
        """Return the specification completed by a campaign file; None: by the defaults."""
        settings = _DEFAULTS if file is None else file.settings
        spec = replace(self, **{name: getattr(settings, name) for name in self.from_file})
        if spec.until_ci is None or "runs" not in spec.from_file or (file is not None and file.sets("runs")):
            return spec
        return replace(spec, runs=RUNS_LIMIT_DEFAULT)

    @property
    def replacements(self) -> Replacements:
        """What replaces the scenario's own files and settings."""
        return cast(Replacements, {name: getattr(self, name) for name in Replacements.__annotations__})

    @property
    def processes(self) -> int:
        """How many processes run the missions."""
        missions = sys.maxsize if self.sweep else len(self.managers) * self.runs
        if self.workers is not None:
            return min(self.workers, missions)
        return 1 if missions <= _FEW_MISSIONS and all(map(is_built_in, self.managers)) else _WORKERS

    @property
    def until(self) -> UntilCi | None:
        """When managers are stopped early; None: never."""
        return None if self.until_ci is None else parse_until_ci(self.until_ci)

    def stored(self) -> dict[str, Any]:
        """Return what a resumed campaign needs, as plain data."""
        plain = {name: value for name, value in asdict(self).items() if name not in _NOT_STORED}
        plain["of_file"] = plain.pop("from_file")
        return plain

    @classmethod
    def of_stored(cls, plain: Mapping[str, Any], **changed: Any) -> CampaignSpec:
        """Make a specification of what `stored` returned, with changes."""
        parts = {name: tuple(value) if isinstance(value, list) else value for name, value in plain.items()}
        from_file = parts.pop("of_file")
        changed = {name: value for name, value in changed.items() if value is not None}
        left_out = tuple(name for name in from_file if name not in changed)
        return cls(**{**parts, **changed, "from_file": left_out})

    def check(self) -> None:
        """Check that the values make sense, without reading anything.

        Raises:
            InputError: no, unknown or repeated managers, a scheduler besides workers, or a number out of range.
        """
        if not self.managers:
            raise InputError("no managers are given", remedy="for instance none,random,metacontrol")
        for index, manager in enumerate(self.managers):
            manager_class(manager)
            if manager in self.managers[:index]:
                raise InputError(f"manager {manager!r} is given twice", remedy="name each manager once")
        if self.parquet and find_spec("pyarrow") is None:
            raise InputError("Parquet needs pyarrow, which is not installed", remedy="pip install 'suave-des[parquet]'")
        check_range("runs", self.runs, 1, RUNS_LIMIT)
        workers = 1 if self.workers is None else self.workers
        check_workers(workers)
        if self.scheduler is not None:
            from suave_des.campaign.executors.dask_cluster import check_scheduler

            check_scheduler(self.scheduler, workers)
        check_seed(self.seed)
        if not 0.0 < self.time_out_s <= _LONGEST_TIME_OUT_S:
            remedy = f"give seconds above 0, at most {_LONGEST_TIME_OUT_S:g}"
            raise InputError(f"time-out: {self.time_out_s:g} is out of range", remedy=remedy)
        if (until := self.until) is not None:
            until.check(self.managers)


def check_range(what: str, number: int, least: int, greatest: int) -> None:
    """Check that a number lies between two others.

    Raises:
        InputError: it does not.
    """
    if not least <= number <= greatest:
        raise InputError(f"{what}: {shown(number)} is out of range", remedy=f"give {least} to {greatest}")


def check_seed(seed: int) -> None:
    """Check that a seed fits into result files.

    Raises:
        InputError: it does not.
    """
    check_range("seed", seed, 0, SEED_LIMIT)


def check_workers(workers: int) -> None:
    """Check that the number of processes makes sense on this machine.

    Raises:
        InputError: they do not.
    """
    cores = os.cpu_count() or 1
    limit = _WORKERS_PER_CORE * cores
    if not 1 <= workers <= limit:
        raise InputError(
            f"workers: {workers} is out of range",
            remedy=f"give 1 to {limit}; this machine has {cores} cores, and more workers than cores gain nothing",
        )


# Campaign files.


@dataclass(frozen=True)
class CampaignFile:
    """A campaign file that was read.

    Attributes:
        settings: its content.
        scenario: path of the scenario that it names.
        inputs: SHA-256 of the file, by its name as shown to the user.
        layer: has the lines.
    """

    settings: CampaignSettings
    scenario: Path
    inputs: Mapping[str, str]
    layer: Layer = field(repr=False)

    def sets(self, name: str) -> bool:
        """Return whether a key stands in the file."""
        return name in self.settings.model_fields_set

    def located(self, error: InputError) -> InputError:
        """Return an error about a key path of this file with its line."""
        path = self.layer.key_path(error.place or "")
        return self.layer.error(error.problem, path, error.remedy) if path else error


def read_campaign_file(name: str | Path) -> CampaignFile | None:
    """Read a campaign file; None if the file is something else, such as a scenario.

    Raises:
        InputError: it cannot be read, is of another version, or has an impossible value.
    """
    files = InputFiles()
    layer = files.yaml(find(name, "scenarios"))
    if "campaign" not in layer.data:
        return None
    version = layer.data["campaign"]
    if version != FORMAT or isinstance(version, bool):
        problem = f"a campaign file of version {shown(version)}, and this suave-des reads version {FORMAT}"
        raise layer.error(problem, ("campaign",), f"write campaign: {FORMAT}, and see docs/guides/sweeps.md")
    settings = validated(layer, CampaignSettings)
    scenario = find_named(layer, ("scenario",), settings.scenario, "scenarios")
    return CampaignFile(settings, scenario, files.inputs, layer)


def managers_of(scenario: str | Path) -> tuple[str, ...]:
    """Return the managers that a campaign has if none are given: those of a campaign file, or the default."""
    file = read_campaign_file(scenario)
    return _DEFAULTS.managers if file is None else file.settings.managers
