"""Campaigns for scripts and notebooks: their results as pandas data frames; see docs/reference/python-api.md."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from suave_des.campaign import campaign as campaigns
from suave_des.campaign.campaign import CampaignResult
from suave_des.campaign.progress import OnProgress
from suave_des.errors import InputError
from suave_des.registry import ManagerLike
from suave_des.scenario.loader import LoadedScenario

if TYPE_CHECKING:
    import pandas

    from suave_des.results.compare import CampaignFrame


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
    """Run missions of a scenario under each manager; a row for each mission, with the columns of runs.csv.

    The data frame can be compared and drawn: `frame.compare()`, `frame.figure()`.

    The rows are the same for any number of workers. Columns scenario and manager are categories, the managers in the
    order given; run, seed and adaptations int64, pipeline_found bool, other metrics float64, nan if not measured.

    `frame.attrs` has, as plain values, `missions` and `failures` as in manifest.json, `summary` (a mapping
    for each row of summary.csv), `runs_sharing_draw` (the number of consecutive runs that share a draw), `interrupted`,
    and `folder`, which may be None. When missions fail, a warning says so.

    Ctrl-C in a notebook or at a prompt gives the missions that are done, with a warning; elsewhere it is raised as
    CampaignInterrupted, a KeyboardInterrupt, whose `result.frame()` has them.

    Example:
        frame = run_campaign("seams2023", ["none", "metacontrol"], runs=100, workers=2)
        frame.groupby("manager")["search_time_s"].mean()

    Args:
        scenario: path of a scenario file or of a campaign file, name of a shipped scenario, or a loaded one.
        managers: names, module:Class, or classes, one or several; left out, as is the rest: as in the campaign file,
            or none, random and metacontrol.
        runs: missions for each manager, at each point of a sweep: 20.
        seed: of everything that is random: 1.
        workers: processes; with 1 the missions run in this one. With more, managers that the calling script defines
            itself need `if __name__ == "__main__":` around the call, as workers import the script; those of a notebook
            need nothing.
        out: folder for runs.csv, summary.csv and manifest.json, from which the campaign can be resumed. None: no files.
        progress: whether to show progress; by default in a notebook and on a terminal.
        options: see suave_des.campaign.spec.CampaignSpec, such as sweep, perturbations and rules. The values
            of a sweep may be a list, an array or a range.

    Raises:
        InputError: something given cannot be used; nothing is written then.
        WorkerError: worker processes end again and again; finished missions are kept.
        StoreError: the disk is full, or the folder was removed.
    """
    given = scenario, managers, runs, seed, workers, out
    result, attrs = _with_progress(
        scenario, progress, lambda show: campaigns.run_campaign(*given, on_progress=show, **options)
    )
    return _with_attrs(result.frame(), attrs)


def stream_campaign(
    scenario: str | Path | LoadedScenario,
    managers: ManagerLike | Iterable[ManagerLike] | None = None,
    runs: int | None = None,
    seed: int | None = None,
    workers: int = 1,
    out: str | Path | None = None,
    *,
    chunk_rows: int = 10_000,
    progress: bool | None = None,
    **options: Any,
) -> Iterator[CampaignFrame]:
    """Yield the same in data frames of `chunk_rows` rows, in order, for more rows than fit into memory.

    The campaign runs at once; its rows are kept on disk, in a temporary file without `out`, and read as they are
    requested. Each piece has the types and attrs of the whole.

    Raises:
        InputError: chunk_rows is less than 1; and as run_campaign.
        WorkerError, StoreError: as run_campaign.
    """
    if chunk_rows < 1:
        raise InputError(f"chunk_rows: {chunk_rows} is out of range", remedy="give 1 or more")
    given = scenario, managers, runs, seed, workers, out
    result, attrs = _with_progress(
        scenario, progress, lambda show: campaigns.run_campaign(*given, on_progress=show, **options)
    )
    return (_with_attrs(frame, attrs) for frame in result.frames(chunk_rows))


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

    Args:
        folder: its output folder.
        workers: processes; the number may differ.
        runs: a greater number of runs; by default the original number.
        scheduler: address of a Dask scheduler whose workers run the missions, instead of processes here.
        managers: those of the campaign's that are not installed; their code is run only if they are named here.
        confirmed: whether to run the code of all managers that the folder names.
        progress: whether to show progress; by default in a notebook and on a terminal.

    Raises:
        InputError: there is no campaign, or something that determines results has changed; the error names it.
        WorkerError, StoreError: as run_campaign.
    """
    result, attrs = _with_progress(
        folder,
        progress,
        lambda show: campaigns.resume_campaign(
            folder,
            workers,
            runs=runs,
            on_progress=show,
            scheduler=scheduler,
            managers=managers,
            confirmed=confirmed,
        ),
    )
    return _with_attrs(result.frame(), attrs)


def _with_progress(
    named: str | Path | LoadedScenario, progress: bool | None, run: Callable[[OnProgress | None], CampaignResult]
) -> tuple[CampaignResult, dict[str, Any]]:
    """Run a campaign and show its progress; return its result, and the attrs of its frames."""
    from rich.console import Console

    from suave_des.campaign.progress import shown

    label = named.scenario.name if isinstance(named, LoadedScenario) else str(named)
    console = Console(stderr=True, highlight=False)
    is_wanted = console.is_jupyter or console.is_terminal if progress is None else progress
    interrupted = False
    try:
        with shown(label, console, quiet=not is_wanted) as show:
            result = run(show)
    except campaigns.CampaignInterrupted as stopped:
        if not hasattr(sys, "ps1"):  # neither a prompt nor a notebook
            raise
        result, interrupted = stopped.result, True
        warnings.warn(str(stopped), stacklevel=3)
    for remark in result.remarks:
        warnings.warn(remark, stacklevel=3)
    if result.failures:
        problem = f"{len(result.failures)} of {result.planned} missions failed, see attrs['failures']: "
        warnings.warn(f"{problem}{result.failures[0]}", stacklevel=3)
    folder = None if result.folder is None else str(result.folder)
    attrs = {
        "runs_sharing_draw": result.variation.runs_sharing_draw,
        "summary": list(result.summary),
        "interrupted": interrupted,
        "folder": folder,
    }
    return result, {**result.report(), **attrs}


def _with_attrs(frame: pandas.DataFrame, attrs: dict[str, Any]) -> CampaignFrame:
    from suave_des.results.compare import CampaignFrame

    rows = CampaignFrame(frame)
    rows.attrs.update(attrs)
    return rows
