"""The exemplar's own configuration files, imported as a scenario and a campaign; export is
the way back.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from suave_des.errors import InputError, shown
from suave_des.exemplar.files import given_files
from suave_des.exemplar.keys import CAMPAIGN, PATHS, REVISIONS, RUNNER, revision_of
from suave_des.exemplar.mission_values import (
    SourcedValue,
    layer_of,
    mission_values,
    scenario_entries,
)
from suave_des.exemplar.runner import (
    Runner,
    battery_constraint,
    campaign_entries,
    experiments_of,
    requested_managers,
    runner_in,
)
from suave_des.exemplar.written import Entries, relative, yaml_text
from suave_des.scenario.loader import LoadedScenario, load_scenario
from suave_des.scenario.yamlfile import Layer


@dataclass(frozen=True)
class Imported:
    """The exemplar's configuration in our form.

    Attributes:
        base: name of the shipped scenario that it builds on.
        why: the reason for its revision.
        scenario: text of its file.
        campaign: text of the campaign file; None if none was requested.
        notes: a line for each parameter that has no counterpart or was changed.
    """

    loaded: LoadedScenario
    base: str
    why: str
    scenario: str
    campaign: str | None
    notes: tuple[str, ...]


def import_config(
    files: Sequence[Path | Layer],
    out: Path,
    *,
    managers: Collection[str],
    revision: str | None = None,
    campaign: Path | None = None,
    runner_seed: int | None = None,
) -> Imported:
    """Convert mission, campaign and System Modes files of the exemplar. Nothing is written.

    Args:
        files: in any order; any revision's.
        out: path of the scenario to be, which determines how it names other files.
        managers: those that can be run.
        revision: which the files are read as; None: the only one that they fit.
        campaign: path of the campaign to be; None: no campaign is imported.
        runner_seed: of the exemplar's own draws, which become the campaign's conditions; None:
            values are drawn anew.

    Raises:
        InputError: a file cannot be read or is none of these, two contradict one another, they fit
            several revisions, or a value cannot be right.
    """
    notes: list[str] = []
    given = given_files(files, notes)
    runner = runner_in(given.parameters)
    _check_campaign(runner, campaign, runner_seed)
    experiments = [] if runner is None else list(experiments_of(runner, notes))
    revision, why = revision_of(given.telling(each.launch for each in experiments), revision)
    base = REVISIONS[revision]
    plain = load_scenario(base)
    values = mission_values(given.parameters, revision, plain, notes)
    values |= battery_constraint(experiments, notes)
    if plain.scenario.revision.name != revision:
        values["revision"] = SourcedValue(revision, why)
    if given.modes is not None:  # checked where it is, and then named as the file to be names it
        values["modes_file"] = SourcedValue(str(given.modes.path.resolve()), "as it is")
    loaded = load_scenario(base, over=layer_of(values, plain.path))

    text = None
    if runner is not None:
        notes += _mission_that_is_missing(runner, given.documents)
        if campaign is None:
            notes.append(_only_in_a_campaign(runner))
        else:
            content: Entries = {
                ("campaign",): (1, "version of the form"),
                ("scenario",): (relative(out, campaign), ""),
            }
            requested = requested_managers(experiments, managers, notes)
            content |= campaign_entries(runner, requested, loaded, runner_seed, notes)
            text = yaml_text(given.documents, content, ())
    if given.modes is not None:
        values["modes_file"] = SourcedValue(relative(given.modes.path, out), "as it is")
    scenario = yaml_text(
        given.documents, {("base",): (base, why), **scenario_entries(values)}, notes
    )
    return Imported(loaded, base, why, scenario, text, tuple(notes))


def _check_campaign(runner: Runner | None, campaign: Path | None, runner_seed: int | None) -> None:
    """Raise an InputError if a campaign is needed and not requested, or the other way round."""
    if campaign is None and runner_seed is not None:
        problem = "the draws of the exemplar's runner are conditions of a campaign"
        raise InputError(problem, place="--runner-seed", remedy="add --campaign FILE")
    if campaign is not None and runner is None:
        remedy = "give the campaign's configuration too, or leave --campaign out"
        raise InputError(
            f"there is no campaign to import: no node {RUNNER} in the files", remedy=remedy
        )


def _mission_that_is_missing(runner: Runner, documents: Sequence[Layer]) -> Iterator[str]:
    """Yield a note if the mission's file that the runner names is none of those given."""
    mission = runner.parameters.get("mission_config_file")
    names = {each.path.name for each in documents}
    if mission is not None and Path(str(mission.value)).name not in names:
        yield f"{mission.place}: not imported: {shown(mission.value)} is none of the files given"


def _only_in_a_campaign(runner: Runner) -> str:
    """Return the note about the runner's parameters that no scenario has."""
    listed = [
        name for name in runner.parameters if PATHS.get((RUNNER, name), "").startswith(CAMPAIGN)
    ]
    what = "not part of a scenario (--campaign FILE writes it to a campaign file)"
    return f"{what}: {RUNNER}: {', '.join(listed)}"
