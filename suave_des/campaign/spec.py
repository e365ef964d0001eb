"""The specification of a campaign: every option is declared here once, for Python, campaign files
and commands.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from numbers import Integral
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Self

from pydantic import Field, ValidationError

from suave_des.campaign.variation import plain
from suave_des.errors import InputError, did_you_mean, shown
from suave_des.imports import look_beside
from suave_des.registry import is_built_in, manager_class
from suave_des.scenario.loader import Replacements
from suave_des.scenario.models import Real, Strict
from suave_des.scenario.yamlfile import Layer, find_named, problem_and_remedy, read_input, validated

RUNS_LIMIT = 1_000_000
SEED_LIMIT = 2**63 - 1
"""The greatest that tools which read the result files can hold."""
WORKERS_LIMIT = 256
"""More than one for each core gain nothing."""
_WORKERS = 2
_FEW_MISSIONS = 1000
"""So many take one process no longer than two, which first load the compiler and Java, or compile,
each for itself.
"""

Whole = Annotated[int, Field(strict=True)]


class Option(NamedTuple):
    """How a field is shown on the command line."""

    metavar: str | None = None
    default: str = ""
    """As shown, where the field itself has none."""


class CampaignKeys(Strict):
    """What may stand in a campaign file, too; options of a command or a call take precedence."""

    managers: Annotated[tuple[str, ...], Field(min_length=1), Option("NAME,...")] = (
        "none",
        "random",
        "metacontrol",
    )
    """Managing subsystems: names, or module:Class."""
    runs: Annotated[Whole, Field(ge=1, le=RUNS_LIMIT)] = 20
    """Missions for each manager, at each point of a sweep."""
    seed: Annotated[Whole, Field(ge=0, le=SEED_LIMIT)] = 1
    """Random seed."""
    time_out_s: Annotated[
        Real, Field(gt=0, le=1e6), Option("SECONDS", "120; with the reasoner owlready2 1800")
    ] = 120.0
    """Wall-clock limit for a mission, in s."""
    sweep: dict[str, object] = Field(default_factory=dict)
    """Lists of values by key path of the scenario, each combined with each; or a mapping with
    `grid` (the same) and `zip` (lists of which the first values go together, then the second),
    which are combined with each other. Each parameter is a column of runs.csv."""
    perturbations: dict[str, object] = Field(default_factory=dict)
    """Distributions by key path of the scenario: each run draws its own value, the same under all
    managers and at all points. Each is a column of runs.csv."""
    runs_per_draw: Annotated[Whole, Field(ge=1, le=RUNS_LIMIT)] = 1
    """Number of consecutive runs that share a draw."""
    ensemble: Annotated[str | None, Option("FILE")] = None
    """File of parameter sets, of which each run has one, or the name of a shipped one."""


class CampaignSettings(CampaignKeys):
    """A campaign file."""

    campaign: Literal[1]
    """Version of the format: 1. It marks a campaign file."""
    scenario: str
    """Scenario to start from: a file named relative to this one, or the name of a shipped one."""
    labels: dict[str, Annotated[str, Field(min_length=1)]] = Field(default_factory=dict)
    """Names under which tables and figures show managers, by their own."""


class CampaignSpec(CampaignKeys):
    """The specification of a campaign. Make one with `of`, which leaves missing values to the
    campaign file.
    """

    scenario: str
    """A scenario or campaign file, or a shipped scenario."""
    replacements: dict[str, Any] = Field(default_factory=dict)
    """What replaces the scenario's own files and values, as of load_scenario."""
    suave_format: bool = False
    """Write the exemplar's own results files, too."""
    record_knowledge: bool = False
    """Record knowledge states for `kb try`."""
    out: Annotated[Path | None, Option("DIR")] = None
    """Folder for result files."""
    workers: Annotated[
        Whole | None, Field(ge=1, le=WORKERS_LIMIT), Option(default="2, or 1 for few missions")
    ] = None
    """Worker processes."""
    scheduler: Annotated[str | None, Option("tcp://HOST:PORT")] = None
    """Run missions on the workers of this Dask scheduler."""
    overwrite: bool = False
    """Replace earlier results in the output folder."""
    command: tuple[str, ...] = ()
    """The command line, for the manifest."""
    folder: str = ""
    """Where relative paths begin."""

    @classmethod
    def of(cls, scenario: str | Path, **options: object) -> Self:
        """Make a specification from options by name; None leaves one to the campaign file, or to
        the defaults.

        Options of load_scenario are taken, too.

        Raises:
            InputError: there is no such option, or a value is not allowed.
        """
        given = {name: plain(value) for name, value in options.items() if value is not None}
        replaced = {name: given.pop(name) for name in Replacements.__annotations__ if name in given}
        return cls.read(
            {
                "scenario": str(scenario),
                "replacements": replaced,
                "folder": str(Path.cwd()),
                **given,
            }
        )

    @classmethod
    def read(cls, data: Mapping[str, object]) -> Self:
        """Make a specification of plain data.

        Raises:
            InputError: a value is not allowed.
        """
        try:
            return cls.model_validate(data)
        except ValidationError as error:
            keys, problem, remedy = problem_and_remedy(error, dict(data), cls)
            raise InputError(f"{'.'.join(map(str, keys))}: {problem}", remedy=remedy) from None

    def stored(self) -> dict[str, object]:
        """Return what a resumed campaign needs, as plain data: not how and where it runs, which may
        differ then.
        """
        how = {"out", "workers", "scheduler", "overwrite"}
        return self.model_dump(mode="json", exclude_unset=True, exclude=how)

    def with_file(self, file: CampaignFile | None) -> Self:
        """Return the specification completed by a campaign file, if there is one."""
        if file is None:
            return self
        left = (
            file.settings.model_fields_set
            & CampaignKeys.model_fields.keys() - self.model_fields_set
        )
        return self.model_copy(update={name: getattr(file.settings, name) for name in left})

    @property
    def processes(self) -> int:
        """How many processes run the missions."""
        missions = sys.maxsize if self.sweep else len(self.managers) * self.runs
        if self.workers is not None:
            return min(self.workers, missions)
        return 1 if missions <= _FEW_MISSIONS and all(map(is_built_in, self.managers)) else _WORKERS

    def check(self) -> None:
        """Check what depends on this machine; imports the managers.

        Raises:
            InputError: an unknown or repeated manager, or workers besides a scheduler.
        """
        for index, manager in enumerate(self.managers):
            manager_class(manager)
            if manager in self.managers[:index]:
                raise InputError(
                    f"manager {manager!r} is given twice", remedy="name each manager once"
                )
        if self.scheduler is not None and self.workers not in (None, 1):
            remedy = (
                "omit it; `dask worker --nworkers N` sets how many missions run there at a time"
            )
            raise InputError(
                f"workers: {self.workers} cannot be used with a scheduler", remedy=remedy
            )


def check_range(what: str, number: int, least: int, greatest: int) -> None:
    """Raise an InputError if a number is no whole one, or not between two others, which are
    allowed, too.
    """
    if not (isinstance(number, Integral) and least <= number <= greatest):
        raise InputError(
            f"{what}: {shown(number)} is out of range", remedy=f"give {least} to {greatest}"
        )


# Campaign files.


@dataclass(frozen=True)
class CampaignFile:
    """A campaign file that was read.

    Attributes:
        scenario: path of the scenario that it names.
        inputs: SHA-256 of the file, by its name as shown to the user.
        layer: has the lines.
    """

    settings: CampaignSettings
    scenario: Path
    inputs: Mapping[str, str]
    layer: Layer = field(repr=False)

    @property
    def path(self) -> Path:
        """Where it is."""
        return self.layer.place(("campaign",)).file

    def located(self, error: InputError) -> InputError:
        """Return an error about a key path of this file with its line."""
        place = error.place or ""
        path = self.layer.key_path(place)
        missing = place.removeprefix(".".join(map(str, path))).removeprefix(".")
        problem = f"{missing}: {error.problem}" if missing else error.problem
        return self.layer.error(problem, path, error.remedy) if path else error


def read_campaign_file(name: str | Path) -> CampaignFile | None:
    """Read a campaign file; None if the file is something else, such as a scenario. Users' modules
    are looked for beside it from then on.

    Raises:
        InputError: it cannot be read, is of another version, or has an impossible value.
    """
    inputs: dict[str, str] = {}
    layer = read_input(inputs, name, "scenarios")
    if "campaign" not in layer.data:
        return None
    settings = validated(layer, CampaignSettings)
    if settings.ensemble is not None:
        ensemble = find_named(settings.ensemble, "scenarios/ensembles", layer, ("ensemble",))
        settings = settings.model_copy(update={"ensemble": str(ensemble)})
    for name, shown_as in settings.labels.items():
        others = {settings.labels.get(each, each) for each in settings.managers if each != name}
        if name not in settings.managers:
            remedy = did_you_mean(name, settings.managers, "its managers")
            raise layer.error(f"there is no manager {shown(name)}", ("labels", name), remedy)
        if shown_as in others:
            problem = f"several managers would be shown as {shown(shown_as)}"
            raise layer.error(problem, ("labels", name), "give each its own label")
    scenario = find_named(settings.scenario, "scenarios", layer, ("scenario",))
    file = CampaignFile(settings, scenario, inputs, layer)
    look_beside(file.path)
    return file
