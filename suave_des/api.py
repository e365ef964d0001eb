"""Missions and campaigns for scripts and notebooks, whose results draw and compare themselves."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from suave_des.arguments import check_names, plain_arguments
from suave_des.campaign import campaign as campaigns
from suave_des.campaign.campaign import CampaignResult
from suave_des.campaign.progress import OnProgress, is_live, shown
from suave_des.campaign.spec import RUNS_LIMIT, SEED_LIMIT, CampaignSpec, check_range
from suave_des.files import (
    check_output_folder,
    make_output_folder,
    own_files,
    remove_results,
    write_files,
)
from suave_des.metrics.result import MissionResult
from suave_des.records.mission_folder import MISSION_FILE, mission_files, record_of
from suave_des.registry import ManagerLike, name_of
from suave_des.scenario.loader import LoadedScenario, Replacements, load_scenario
from suave_des.simulation.inputs import check_inputs

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from suave_des.frame import CampaignFrame


_CALLER = 4
"""Stack level of who calls a function here, seen from `_frame_of`."""


@dataclass(frozen=True, repr=False)
class RecordedMission(MissionResult):
    """A mission with its record, which can be drawn, and its scenario (`loaded`).

    Example:
        mission = run_mission("seams2023", "metacontrol", run=1, seed=8)
        mission.figure("timeline").savefig("timeline.pdf")
    """

    loaded: LoadedScenario = field(kw_only=True)

    def figure(self, kind: str = "map") -> Figure:
        """Draw the mission, as `suave-des figure` does.

        Args:
            kind: "map": the vehicle's way from above; "timeline": what was measured, and the modes.

        Raises:
            InputError: there is no such figure of a mission.
        """
        from suave_des.results.figures import draw_mission

        return draw_mission(record_of(self, self.loaded), kind)


@plain_arguments
def run_mission(
    scenario: str | Path | LoadedScenario,
    manager: ManagerLike = "metacontrol",
    run: int = 1,
    seed: int = 1,
    out: str | Path | None = None,
    *,
    overwrite: bool = False,
    command: Sequence[str] = (),
    **replacements: Unpack[Replacements],
) -> RecordedMission:
    """Run one mission and keep its events and trajectory; it equals this run of a campaign with
    this seed.

    Example:
        mission = run_mission("seams2023", "metacontrol", run=1, seed=8)
        print(mission.metrics.search_time_s, len(mission.events))

    Args:
        scenario: path of a scenario file, name of a shipped one, or a loaded one.
        manager: name of the managing subsystem, module:Class, or its class.
        run: number of the run, from 1.
        seed: of everything that is random.
        out: folder for mission.json, events.csv, trajectory.csv and, of a manager that reasons,
            knowledge.jsonl; it is made if its parent exists. None: no files.
        overwrite: whether results of the same kind in the folder are replaced.
        command: the command line, for mission.json.
        replacements: as of load_scenario.

    Raises:
        InputError: something given cannot be used; nothing is written then.
        MissionError: the manager raised; nothing is written then.
    """
    # with the compiler, which campaigns load in their workers
    from suave_des.simulation.simulator import Simulator

    folder = None if out is None else Path(out)
    if folder is not None:
        check_output_folder(folder, "mission", overwrite=overwrite)
    check_range("run", run, 1, RUNS_LIMIT)
    check_range("seed", seed, 0, SEED_LIMIT)
    name = name_of(manager)
    loaded = load_scenario(scenario, **replacements)
    inputs = check_inputs([loaded], [name], replacements)
    result = Simulator(loaded).run(name, run, seed, record=True)
    if folder is not None:
        make_output_folder(folder)
        files = mission_files(result, loaded, inputs, command)
        remove_results(folder, files)
        write_files(folder, files, stale=own_files(folder, MISSION_FILE))
    return RecordedMission(
        **{each.name: getattr(result, each.name) for each in fields(result)}, loaded=loaded
    )


@plain_arguments
def run_campaign(
    scenario: str | Path | LoadedScenario,
    managers: ManagerLike | Iterable[ManagerLike] | None = None,
    runs: int | None = None,
    seed: int | None = None,
    workers: int = 1,
    out: str | Path | None = None,
    *,
    progress: bool | None = None,
    **options: Any,
) -> CampaignFrame:
    """Run missions of a scenario under each manager; a row for each mission, with the columns of
    runs.csv.

    The rows are the same for any number of workers. Columns scenario and manager are categories,
    the managers in the order given; run, seed and adaptations int64, pipeline_found bool, other
    metrics float64, nan if not measured.

    `frame.attrs` has, as plain values, `missions` and `failures` as in manifest.json, `summary` (a
    mapping for each row of summary.csv), `runs_sharing_draw` (the number of consecutive runs that
    share a draw), `interrupted`, and `folder`, which may be None. When missions fail, a warning
    says so.

    Ctrl-C in a notebook or at a prompt gives the missions that are done, with a warning; elsewhere
    it is raised as CampaignInterrupted, a KeyboardInterrupt, whose `result.frame()` has them.

    Example:
        frame = run_campaign("seams2023", ["none", "metacontrol"], runs=100, workers=2)
        frame.groupby("manager")["search_time_s"].mean()

    Args:
        scenario: path of a scenario file or of a campaign file, name of a shipped scenario, or a
            loaded one.
        managers: names, module:Class, or classes, one or several; left out, as is the rest: as in
            the campaign file, or none, random and metacontrol.
        runs: missions for each manager, at each point of a sweep: 20.
        seed: of everything that is random: 1.
        workers: processes; with 1 the missions run in this one. With more, managers that the
            calling script defines itself need `if __name__ == "__main__":` around the call, as
            workers import the script; those of a notebook need nothing.
        out: folder for runs.csv, summary.csv and manifest.json, from which the campaign can be
            resumed. None: no files.
        progress: whether to show progress; by default in a notebook and on a terminal.
        options: see suave_des.campaign.spec.CampaignSpec, such as sweep, perturbations and rules.
            The values of a sweep may be a list, an array or a range.

    Raises:
        InputError: something given cannot be used; nothing is written then.
        WorkerError: worker processes end again and again; finished missions are kept.
        StoreError: the disk is full, or the folder was removed.
    """
    internal = "replacements", "command", "folder"
    known = [*CampaignSpec.model_fields.keys() - internal, *Replacements.__annotations__]
    check_names("run_campaign", options, sorted(known))
    given = scenario, managers, runs, seed, workers, out
    return _frame_of(
        scenario, progress, lambda show: campaigns.run_campaign(*given, on_progress=show, **options)
    )


@plain_arguments
def resume_campaign(
    folder: str | Path,
    workers: int = 1,
    *,
    runs: int | None = None,
    scheduler: str | None = None,
    managers: Sequence[str] = (),
    confirmed: bool = False,
    progress: bool | None = None,
) -> CampaignFrame:
    """Resume the campaign in a folder where it stopped, and return its rows as run_campaign does.

    Example:
        frame = resume_campaign("simulated", runs=200, workers=2)

    Args:
        workers: processes; the number may differ.
        runs: a greater number of runs; by default the original number.
        scheduler: address of a Dask scheduler whose workers run the missions, instead of processes
            here.
        managers: those of the campaign's that are not installed; their code is run only if they are
            named here.
        confirmed: whether to run the code of all managers that the folder names.
        progress: whether to show progress; by default in a notebook and on a terminal.

    Raises:
        InputError: there is no campaign, or something that determines results has changed; the
            error names it.
        WorkerError, StoreError: as run_campaign.
    """
    return _frame_of(
        folder,
        progress,
        lambda show: campaigns.resume_campaign(
            folder,
            workers,
            runs=runs,
            scheduler=scheduler,
            managers=managers,
            confirmed=confirmed,
            on_progress=show,
        ),
    )


def _frame_of(
    named: str | Path | LoadedScenario,
    progress: bool | None,
    run: Callable[[OnProgress | None], CampaignResult],
) -> CampaignFrame:
    """Run a campaign and show its progress; return its rows, with what else there is to know in
    attrs.
    """
    from suave_des.frame import CampaignFrame

    label = named.scenario.name if isinstance(named, LoadedScenario) else str(named)
    interrupted = False
    try:
        with shown(label, quiet=not (is_live() if progress is None else progress)) as show:
            result = run(show)
    except campaigns.CampaignInterrupted as stopped:
        if not hasattr(sys, "ps1"):  # neither a prompt nor a notebook
            raise
        result = stopped.result
        interrupted = True
        warnings.warn(str(stopped), stacklevel=_CALLER)
    for remark in result.remarks:
        warnings.warn(remark, stacklevel=_CALLER)
    if result.failures:
        problem = f"{len(result.failures)} of {result.campaign.planned} missions failed, see attrs['failures']: "
        warnings.warn(f"{problem}{result.failures[0]}", stacklevel=_CALLER)
    frame = CampaignFrame(result.frame())
    frame.attrs.update(result.report())
    frame.attrs["runs_sharing_draw"] = result.campaign.variation.runs_sharing_draw
    frame.attrs["summary"] = list(result.summary)
    frame.attrs["interrupted"] = interrupted
    frame.attrs["folder"] = None if result.folder is None else str(result.folder)
    return frame
