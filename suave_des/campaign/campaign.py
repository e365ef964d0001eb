"""A campaign: many missions of one scenario under several managers, kept as they finish."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from suave_des.campaign.executors import WorkerError, make_executor
from suave_des.campaign.lock import LOCK_FILE, locked
from suave_des.campaign.outcomes import Failure, Finished, Job, MissionRunner
from suave_des.campaign.output import check_output_folder, make_output_folder, remove_derived, remove_parts
from suave_des.campaign.plan import MissionKey, check_plan, check_seed, plan
from suave_des.campaign.request import Request, check_same, check_time_out, deciding
from suave_des.campaign.results import (
    FILES,
    MANIFEST_FILE,
    RUNS_FILE,
    SUMMARY_FILE,
    CampaignResult,
    gather,
    write_results,
)
from suave_des.campaign.sheet import Sheet, read_sheet, said
from suave_des.campaign.store import (
    NEW_STORE_FILE,
    STORE_FILE,
    Store,
    StoreError,
    make_store,
    remove_store,
    stored_outcomes,
)
from suave_des.campaign.variation import Variation, vary
from suave_des.errors import InputError, SuaveDesError
from suave_des.managing.registry import manager_class
from suave_des.scenario.bases import Files
from suave_des.scenario.loader import LoadedScenario, load_scenario
from suave_des.scenario.models import Mission

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


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a campaign is, in missions; failed ones are among those done."""

    done: int
    failed: int
    total: int


class CampaignInterrupted(KeyboardInterrupt):
    """Ctrl-C during a campaign; finished missions are kept.

    Attributes:
        result: with the missions that were finished.
    """

    def __init__(self, result: CampaignResult) -> None:
        self.result = result
        super().__init__(f"interrupted; {result.kept()}")


LARGE = 1_000_000
"""Missions from which a campaign wants to be confirmed."""
_TIMED_RUNS = 3

OnProgress = Callable[[Progress], None]


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
    time_out_s: float | None = None,
    confirmed: bool = False,
    overwrite: bool = False,
    command: Sequence[str] = (),
    on_progress: OnProgress | None = None,
) -> CampaignResult:
    """Run `runs` missions of a scenario under each manager, at each point of the sweep if there is one.

    The result is the same for any number of workers, and however often the campaign was interrupted and resumed. A
    mission that fails (its manager raises, it takes too long, it ends its worker process again and again) has no row;
    the others are kept.

    What is left out is as in the campaign file, and otherwise as on the command line.

    Args:
        scenario: path of a scenario file or of a campaign file, or name of a shipped scenario.
        managers: names, or module:Class.
        runs: missions for each manager, at each point.
        seed: of everything that is random.
        workers: processes; with 1 the missions run in this one. With more, a script that calls this must guard itself
            with `if __name__ == "__main__":`, because worker processes import it.
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
        time_out_s: time that one mission may take, in s of the clock on the wall.
        confirmed: whether more than a million missions are meant.
        overwrite: whether results in the folder may be replaced.
        command: the command line, for the manifest.
        on_progress: called when missions are done.

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
        folder=str(Path.cwd()),
        command=tuple(command),
    )
    folder = None if out is None else Path(out)
    if folder is not None:
        _check_new(folder, overwrite=overwrite)
    check_plan(request.managers, request.runs, workers)
    check_seed(request.seed)
    check_time_out(request.time_out_s)
    campaign = _Campaign(request, *_read(request, sheet), folder)
    if suave_format and campaign.variation.sweep.points > 1:
        raise InputError(
            "the exemplar's results file has no place for what a sweep varies",
            remedy="leave --format suave out, or run a campaign for each point",
        )
    if not confirmed:
        campaign.check_size(workers)
    return campaign.run(workers, on_progress, resumed=False)


def resume_campaign(
    folder: str | Path, workers: int = 1, *, runs: int | None = None, on_progress: OnProgress | None = None
) -> CampaignResult:
    """Go on with a campaign where it stopped; what it was asked is in its folder.

    Missions that failed for reasons that may have passed (time-out, a worker that was killed) are run again.

    Args:
        folder: the campaign's output folder.
        workers: as of run_campaign; it may be another number.
        runs: more runs than were asked for at first; left out: as many.
        on_progress: called when missions are done.

    Raises:
        InputError: there is no campaign, it is damaged or in use, or something that decides results has changed; the
            difference is named.
        WorkerError, StoreError, CampaignInterrupted: as of run_campaign.
    """
    folder = Path(folder)
    request = _request_of(folder)
    if runs is not None:
        request = replace(request, runs=runs, of_file=tuple(name for name in request.of_file if name != "runs"))
    try:
        sheet = read_sheet(request.scenario)
        request = replace(request, **said(sheet, request.of_file))
        check_plan(request.managers, request.runs, workers)
        campaign = _Campaign(request, *_read(request, sheet), folder)
    except InputError as error:
        if str(Path.cwd()) == request.folder:
            raise
        remedy = f"the campaign was started in {request.folder}: resume it there"
        raise InputError(error.problem, file=error.file, place=error.place, remedy=remedy) from None
    return campaign.run(workers, on_progress, resumed=True)


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
        knowledge.conclude(KnowledgeState())
        for path in knowledge.base.files:
            files.ontology(path)
    return {**loaded.inputs, **files.inputs}


class _Campaign:
    """A campaign whose input is read and checked."""

    def __init__(
        self,
        request: Request,
        loaded: LoadedScenario,
        variation: Variation,
        inputs: dict[str, str],
        folder: Path | None,
    ) -> None:
        self.request, self.loaded, self.variation, self.inputs, self.folder = request, loaded, variation, inputs, folder
        self.job = Job(loaded, variation, request.managers, request.seed, request.time_out_s)
        self.total = variation.sweep.points * len(request.managers) * request.runs

    def check_size(self, workers: int) -> None:
        """See that a very large campaign is meant.

        Raises:
            InputError: it has more than LARGE missions; the time that they take is told, from some of them.
        """
        if self.total <= LARGE:
            return
        managers = range(len(self.request.managers))
        few = tuple(MissionKey(0, manager, run) for manager in managers for run in range(1, _TIMED_RUNS + 1))
        runner = MissionRunner(self.job)
        runner.run(few[::_TIMED_RUNS])  # compiles, and fills the reasoner's memory
        began_s = time.perf_counter()
        runner.run(few)
        expected_s = (time.perf_counter() - began_s) / len(few) * self.total / workers
        problem = (
            f"{self.total:,} missions take about {_duration_text(expected_s)} with {workers} workers on this machine"
        )
        raise InputError(problem, remedy="give --yes if that is meant")

    def run(self, workers: int, on_progress: OnProgress | None, *, resumed: bool) -> CampaignResult:
        """Run what is not done yet, and write the files."""
        if workers > 1:
            _compile(self.job)
        with ExitStack() as stack:
            if self.folder is not None:
                if not self.folder.exists():
                    stack.callback(_remove_empty, self.folder)  # unless something is in it then
                make_output_folder(self.folder)
                stack.enter_context(locked(self.folder))
                remove_parts(self.folder, FILES)
            store = self._store(resumed=resumed)
            try:
                stopped = self._work(store, workers, on_progress)
                is_empty = store.count() == 0
            finally:
                if self.folder is not None:
                    store.close()
            if stopped is not None and is_empty and not resumed:
                if self.folder is not None:
                    remove_store(self.folder)
                raise stopped
            if isinstance(stopped, StoreError):
                raise StoreError(f"{stopped}{self._how_to_go_on()}") from None
            if isinstance(stopped, InputError):
                raise stopped
            result = gather(self.request, self.loaded, self.variation, self.folder, self._outcomes(store))
            if self.folder is not None:
                try:
                    write_results(result, self.request, self.inputs)
                except InputError as error:
                    remedy = f"nothing is lost: suave-des campaign --resume {self.folder} writes the files"
                    raise InputError(error.problem, file=error.file, remedy=remedy) from None
        if isinstance(stopped, WorkerError):
            raise WorkerError(f"{stopped}; {result.kept()}")
        if stopped is not None:
            raise CampaignInterrupted(result)
        return result

    def _store(self, *, resumed: bool) -> Store:
        if self.folder is None:
            return Store(None)
        about = {
            "request": self.request.plain(),
            "deciding": deciding(self.request, self.loaded, self.inputs),
        }
        path = self.folder / STORE_FILE
        if not resumed:
            make_store(path, about)
            remove_derived(self.folder)
        store = Store(path)
        try:
            if resumed:
                check_same(store.about("deciding"), about["deciding"], self.folder)
                store.forget_passing_failures()
                for name, value in about.items():
                    store.note(name, value)
        except BaseException:
            store.close()
            raise
        return store

    def _work(
        self, store: Store, workers: int, on_progress: OnProgress | None
    ) -> KeyboardInterrupt | SuaveDesError | None:
        """Run missions until all are done; what stopped the campaign before that."""
        try:
            done, failed = store.count(), store.count_failures()
            missions = plan(self.variation.sweep.points, len(self.request.managers), self.request.runs, store.settled)
            left = self.total - done
            if left:
                for finished in make_executor(workers).outcomes(self.job, missions, left):
                    store.append(finished)
                    done += len(finished)
                    failed += sum(isinstance(outcome, Failure) for _, outcome in finished)
                    if on_progress is not None:
                        on_progress(Progress(done, failed, self.total))
            store.commit()
        except (KeyboardInterrupt, SuaveDesError) as error:
            if not isinstance(error, StoreError):
                with suppress(StoreError):  # which is told when the files cannot be written either
                    store.commit()
            return error
        return None

    def _outcomes(self, store: Store) -> Callable[[], Iterator[Finished]]:
        if self.folder is None:
            return store.outcomes
        path = self.folder / STORE_FILE
        return lambda: stored_outcomes(path)

    def _how_to_go_on(self) -> str:
        if self.folder is None or not (self.folder / STORE_FILE).exists():
            return ""
        return f"; what was kept before is safe: suave-des campaign --resume {self.folder} does the rest"


def _duration_text(seconds: float) -> str:
    units = (("year", 31_557_600.0), ("day", 86_400.0), ("hour", 3_600.0), ("minute", 60.0))
    for unit, length_s in units:
        if seconds >= 2 * length_s:
            return f"{seconds / length_s:,.0f} {unit}s"
    return f"{seconds:.0f} seconds"


def _remove_empty(folder: Path) -> None:
    with suppress(OSError):
        folder.rmdir()


def _compile(job: Job) -> None:
    """Have inner loops compiled and stored once, before workers would each compile them: a mission of a second does."""
    loaded = job.loaded
    short = loaded.scenario.model_copy(update={"mission": Mission(time_limit_s=1.0)})
    MissionRunner(replace(job, loaded=replace(loaded, scenario=short), managers=("none",))).run((MissionKey(0, 0, 1),))
