"""A campaign: many missions of one scenario under several managers, kept as they finish."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from suave_des.campaign.early_stop import RUNS_LIMIT_DEFAULT, parse_until_ci
from suave_des.campaign.executors import Place, check_place
from suave_des.campaign.lock import LOCK_FILE, locked
from suave_des.campaign.output import check_output_folder
from suave_des.campaign.plan import check_plan, check_seed
from suave_des.campaign.progress import OnProgress, Progress
from suave_des.campaign.request import Request, check_time_out
from suave_des.campaign.results import (
    FILES,
    MANIFEST_FILE,
    RUNS_FILE,
    SUMMARY_FILE,
    CampaignResult,
)
from suave_des.campaign.running import Campaign, CampaignInterrupted
from suave_des.campaign.sheet import Sheet, read_sheet, said
from suave_des.campaign.store import (
    NEW_STORE_FILE,
    STORE_FILE,
    Store,
)
from suave_des.campaign.variation import Variation, vary
from suave_des.errors import InputError
from suave_des.imports import gc_paused
from suave_des.managing.registry import manager_class
from suave_des.scenario.layers import Files
from suave_des.scenario.loader import LoadedScenario, load_scenario

if TYPE_CHECKING:
    from suave_des.campaign.worker import Worker

__all__ = [
    "FILES",
    "MANIFEST_FILE",
    "RUNS_FILE",
    "SUMMARY_FILE",
    "CampaignInterrupted",
    "CampaignResult",
    "Progress",
    "check_knowledge",
    "resume_campaign",
    "run_campaign",
]


def run_campaign(
    scenario: str | Path,
    managers: Sequence[str] | None = None,
    runs: int | None = None,
    seed: int | None = None,
    workers: int = 1,
    out: str | Path | None = None,
    *,
    sweep: Mapping[str, Any] | None = None,
    perturbations: Mapping[str, Any] | None = None,
    runs_per_draw: int | None = None,
    ontologies: Sequence[str | Path] = (),
    modes_file: str | Path | None = None,
    reasoner: str | None = None,
    rules: Sequence[str | Path] = (),
    disabled_rules: Sequence[str] = (),
    suave_format: bool = False,
    record_knowledge: bool = False,
    time_out_s: float | None = None,
    until_ci: str | None = None,
    confirmed: bool = False,
    overwrite: bool = False,
    command: Sequence[str] = (),
    on_progress: OnProgress | None = None,
    scheduler: str | None = None,
    ready: Sequence[Worker] = (),
) -> CampaignResult:
    """Run `runs` missions of a scenario under each manager, at each point of the sweep if there is one.

    The result is the same for any number of workers, and however often the campaign was interrupted and resumed. A
    mission that fails (its manager raises, it takes too long, it ends its worker process again and again) has no row;
    the others are kept.

    What is left out is as in the campaign file, and otherwise as on the command line.

    Args:
        scenario: path of a scenario file or of a campaign file, or name of a shipped scenario.
        managers: names, or module:Class.
        runs: missions for each manager, at each point; with `until_ci` at most, and 10,000 if they are left out.
        seed: of everything that is random.
        workers: processes; with 1 the missions run in this one. With more, managers that the calling script defines
            itself (`__main__:Class`) need `if __name__ == "__main__":` around the call, as workers import the script.
        out: folder for runs.csv, summary.csv and manifest.json; it is made if its parent exists. None: no files.
        sweep: lists of values by key path of the scenario, each combined with each; or a mapping with grid, zip and
            sample, as in a campaign file. Each parameter is a column of runs.csv.
        perturbations: distributions by key path of the scenario: each run draws its own value, the same under all
            managers and at all points. Each is a column of runs.csv.
        runs_per_draw: how many runs in a row share what is drawn.
        ontologies: files to use in place of the scenario's.
        modes_file: file to use in place of the scenario's.
        reasoner: to use in place of the scenario's.
        rules: files of rules as text, besides the scenario's.
        disabled_rules: names of rules to switch off, besides the scenario's.
        suave_format: whether to write the exemplar's own results file besides.
        record_knowledge: whether to keep what managers reasoned about, in knowledge_states.jsonl, for `kb try`.
        time_out_s: time that one mission may take, in s of the clock on the wall.
        until_ci: METRIC:HALF_WIDTH; a manager is stopped after the first run, of at least 20, with which half the 95%
            interval of that metric's mean is less; at each point of its own.
        confirmed: whether more than a million missions are meant.
        overwrite: whether results in the folder may be replaced.
        command: the command line, for the manifest.
        on_progress: called when missions are done.
        scheduler: address of a Dask scheduler, such as tcp://127.0.0.1:8786: missions run on its workers, which get all
            that they need by value, and `workers` must be left at 1.
        ready: worker processes that have been started already; they count among the `workers`.

    Raises:
        InputError: something given cannot be used; nothing is written then.
        WorkerError: worker processes end again and again; finished missions are kept.
        StoreError: the disk is full, or the folder was removed.
        CampaignInterrupted: Ctrl-C; finished missions are kept.
    """
    sheet = read_sheet(scenario)
    given = {
        "managers": None if managers is None else tuple(managers),
        "runs": runs,
        "seed": seed,
        "time_out_s": time_out_s,
        "until_ci": until_ci,
        "sweep": sweep,
        "perturbations": perturbations,
        "runs_per_draw": runs_per_draw,
    }
    left_out = tuple(name for name, value in given.items() if value is None)
    request = Request(
        str(scenario),
        **{**given, **said(sheet, left_out)},
        of_file=left_out,
        ontologies=tuple(map(str, ontologies)),
        modes_file=None if modes_file is None else str(modes_file),
        reasoner=reasoner,
        rules=tuple(map(str, rules)),
        disabled_rules=tuple(disabled_rules),
        suave_format=suave_format,
        record_knowledge=record_knowledge,
        folder=str(Path.cwd()),
        command=tuple(command),
    )
    folder = None if out is None else Path(out)
    if folder is not None:
        _check_new(folder, overwrite=overwrite)
    request = _with_until_ci(request, sheet)
    check_plan(request.managers, request.runs, workers)
    check_place(workers, scheduler)
    check_seed(request.seed)
    check_time_out(request.time_out_s)
    with _place(request, workers, scheduler, ready) as place:
        campaign = Campaign(request, *_read(request, sheet), folder)
        if suave_format and campaign.variation.sweep.points > 1:
            raise InputError(
                "the exemplar's results file has no place for what a sweep varies",
                remedy="leave --format suave out, or run a campaign for each point",
            )
        if not confirmed:
            campaign.check_size(workers)
        return campaign.run(place.executor(), on_progress, resumed=False)


def resume_campaign(
    folder: str | Path,
    workers: int = 1,
    *,
    runs: int | None = None,
    until_ci: str | None = None,
    on_progress: OnProgress | None = None,
    scheduler: str | None = None,
    ready: Sequence[Worker] = (),
) -> CampaignResult:
    """Go on with a campaign where it stopped; what it was asked is in its folder.

    Missions that failed for reasons that may have passed (time-out, a worker that was killed) are run again.

    Args:
        folder: the campaign's output folder.
        workers: as of run_campaign; it may be another number.
        runs: more runs than were asked for at first; left out: as many.
        until_ci: the metric asked for at first with a smaller half-width; left out: as at first.
        on_progress: called when missions are done.
        scheduler: as of run_campaign; it may be another, or none.
        ready: as of run_campaign.

    Raises:
        InputError: there is no campaign, it is damaged or in use, or something that decides results has changed; the
            difference is named.
        WorkerError, StoreError, CampaignInterrupted: as of run_campaign.
    """
    folder = Path(folder)
    request = _request_of(folder)
    if runs is not None:
        request = replace(request, runs=runs)
    if until_ci is not None:
        request = replace(request, until_ci=until_ci)
    given = {"runs": runs, "until_ci": until_ci}
    request = replace(request, of_file=tuple(name for name in request.of_file if given.get(name) is None))
    with ExitStack() as stack:
        try:
            sheet = read_sheet(request.scenario)
            request = replace(request, **said(sheet, request.of_file))
            check_plan(request.managers, request.runs, workers)
            check_place(workers, scheduler)
            place = stack.enter_context(_place(request, workers, scheduler, ready))
            campaign = Campaign(request, *_read(request, sheet), folder)
        except InputError as error:
            if str(Path.cwd()) == request.folder:
                raise
            remedy = f"the campaign was started in {request.folder}: resume it there"
            raise InputError(error.problem, file=error.file, place=error.place, remedy=remedy) from None
        return campaign.run(place.executor(), on_progress, resumed=True)


def _place(request: Request, workers: int, scheduler: str | None, ready: Sequence[Worker]) -> Place:
    """Where a campaign's missions will run, with no more workers than there are missions."""
    fewest = len(request.managers) * request.runs
    return Place(request.managers, workers if request.sweep else min(workers, fewest), scheduler, ready)


def _with_until_ci(request: Request, sheet: Sheet | None) -> Request:
    """A new request whose early stop is checked; if nobody says how many runs there may be, there may be many."""
    if request.until_ci is None:
        return request
    try:
        parse_until_ci(request.until_ci)
    except InputError as error:
        if sheet is None or "until_ci" not in request.of_file:
            raise
        raise sheet.located(error) from None
    if "runs" not in request.of_file or (sheet is not None and "runs" in sheet.content.model_fields_set):
        return request
    of_file = tuple(name for name in request.of_file if name != "runs")
    return replace(request, runs=RUNS_LIMIT_DEFAULT, of_file=of_file)


def _check_new(folder: Path, *, overwrite: bool) -> None:
    check_output_folder(folder, "campaign", overwrite=overwrite, left_over=_is_of_campaign)
    if not overwrite and (folder / STORE_FILE).exists():
        raise InputError(
            "the output folder is not empty: it has a campaign in it",
            file=folder,
            remedy=f"--resume {folder} goes on with it, --overwrite replaces it",
        )


def _is_of_campaign(name: str) -> bool:
    """Whether a file is a campaign's own; without a store it is what is left of one that was killed as it began."""
    return name in (LOCK_FILE, *FILES) or name.startswith((STORE_FILE, NEW_STORE_FILE))


def _request_of(folder: Path) -> Request:
    if not (folder / STORE_FILE).is_file():
        raise InputError("there is no campaign to go on with", file=folder, remedy="start one with --out")
    with locked(folder):
        store = Store(folder / STORE_FILE)
        try:
            return Request.of(store.about("request"))
        finally:
            store.close()


def _read(request: Request, sheet: Sheet | None) -> tuple[LoadedScenario, Variation, dict[str, str]]:
    loaded = load_scenario(
        request.scenario if sheet is None else sheet.scenario,
        ontologies=request.ontologies,
        modes_file=request.modes_file,
        reasoner=request.reasoner,
        rules=request.rules,
        disabled_rules=request.disabled_rules,
    )
    given = bool(request.ontologies or request.rules or request.disabled_rules)
    try:
        loaded, variation = vary(loaded, request.sweep, request.perturbations, request.runs_per_draw, request.seed)
    except InputError as error:
        raise error if sheet is None else sheet.located(error) from None
    with gc_paused():
        inputs = check_knowledge(loaded, request.managers, given=given)
    return loaded, variation, inputs if sheet is None else {**inputs, **sheet.inputs}


def check_knowledge(loaded: LoadedScenario, managers: Sequence[str], *, given: bool) -> dict[str, str]:
    """Open the knowledge base, if a manager uses it or the user gave ontologies, so that no mission finds it broken.

    Args:
        loaded: the scenario with its files.
        managers: names of the managers.
        given: whether the user gave ontologies.

    Returns:
        SHA-256 of each input file, with the ontologies that are imported if the knowledge base was opened.

    Raises:
        InputError: the knowledge base cannot be read, does not fit the mission or the modes file, or is inconsistent.
    """
    files = Files()
    if given or any(manager_class(name).needs_knowledge for name in managers):
        from suave_des.knowledge.state import KnowledgeState
        from suave_des.simulation.knowledge import open_knowledge

        knowledge = open_knowledge(loaded)
        knowledge.analyze_and_plan(KnowledgeState())
        for path in knowledge.base.files:
            files.ontology(path)
    return {**loaded.inputs, **files.inputs}
