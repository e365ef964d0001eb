"""Campaigns, for programs: many missions of one scenario under several managers, saved as they finish."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, Unpack

from suave_des.campaign.executors.local import InProcess, LocalWorkers, end_worker_of_script
from suave_des.campaign.inputs import (
    check_same,
    check_trusted,
    deciding,
    default_time_out_s,
    identity,
    read_inputs,
    trained_on,
)
from suave_des.campaign.missions import Executor, Finished, JobSpec, Remark, WorkerError, plan
from suave_des.campaign.progress import OnProgress, Progress, ProgressTracker
from suave_des.campaign.result_files import FILES, SUAVE_FOLDER, write_results
from suave_des.campaign.results import CampaignResult, gather
from suave_des.campaign.spec import CampaignFile, CampaignSpec, read_campaign_file
from suave_des.campaign.stopping import FirstFailures, check_size
from suave_des.campaign.store import (
    LOCK_FILE,
    NEW_STORE_FILE,
    STORE_FILE,
    Store,
    StoreError,
    locked,
    make_store,
    remove_store,
    stored_outcomes,
)
from suave_des.campaign.variation import plain
from suave_des.errors import InputError, SuaveDesError, did_you_mean
from suave_des.files import check_output_folder, make_output_folder, remove_parts, remove_results
from suave_des.registry import ManagerLike, name_of
from suave_des.scenario.loader import LoadedScenario, Replacements

__all__ = ["CampaignInterrupted", "CampaignOptions", "CampaignResult", "Progress", "resume_campaign", "run_campaign"]
_MORE_MANAGERS = (
    "for other managers, run a second campaign with the same seed into another folder:"
    " suave-des compare {} FOLDER pairs their runs by number"
)


class CampaignOptions(Replacements, total=False):
    """Options of a campaign by name, see CampaignSpec; None or missing ones are taken from the campaign file."""

    sweep: Mapping[str, Any] | None
    perturbations: Mapping[str, Any] | None
    runs_per_draw: int | None
    ensemble: str | Path | None
    until_ci: str | None
    time_out_s: float | None
    scheduler: str | None
    suave_format: bool
    parquet: bool
    record_knowledge: bool
    confirmed: bool
    overwrite: bool
    command: Sequence[str]


def run_campaign(
    scenario: str | Path | LoadedScenario,
    managers: ManagerLike | Iterable[ManagerLike] | None = None,
    runs: int | None = None,
    seed: int | None = None,
    workers: int | None = 1,
    out: str | Path | None = None,
    *,
    on_progress: OnProgress | None = None,
    **options: Unpack[CampaignOptions],
) -> CampaignResult:
    """Run `runs` missions of a scenario under each manager, as suave_des.run_campaign does, whose arguments it has.

    The result is the same for any number of workers, and however often the campaign was interrupted and resumed. A
    mission that fails (its manager raises, it takes too long, its worker process dies repeatedly) has no row;
    the others are kept.

    Example:
        result = run_campaign("seams2023", ["none", "metacontrol"], runs=100, workers=2)
        print(result.frame().groupby("manager")["search_time_s"].mean())

    Args:
        scenario, managers, runs, seed, out, options: see CampaignSpec.
        workers: None: 2, or 1 for few missions of built-in managers.
        on_progress: called when missions are done.

    Raises:
        InputError: something given cannot be used; nothing is written then.
        WorkerError: worker processes end again and again; finished missions are kept.
        StoreError: the disk is full, or the folder was removed.
        CampaignInterrupted: Ctrl-C; finished missions are kept.
    """
    if managers is not None:
        managers = [managers] if isinstance(managers, str | type) else list(managers)
        managers = list(map(name_of, managers))
    given = {"managers": managers, "runs": runs, "seed": seed, "workers": workers, "out": out}
    options["sweep"] = plain(options.get("sweep"))
    loaded = scenario if isinstance(scenario, LoadedScenario) else None
    named = scenario.path if isinstance(scenario, LoadedScenario) else scenario
    spec = CampaignSpec.of(named, **given, **options)
    if spec.out is not None:
        _check_new(spec.out, overwrite=spec.overwrite)
    file = read_campaign_file(spec.scenario) if loaded is None else None
    with ExitStack() as stack:
        campaign = _Campaign(spec, file, stack, loaded)
        if spec.suave_format and campaign.variation.sweep.points > 1:
            raise InputError(
                "the exemplar's results file has no columns for swept values",
                remedy="omit --format suave, or run a campaign for each point",
            )
        if not spec.confirmed:
            check_size(campaign.job, campaign.tracker.total, campaign.spec.processes)
        return campaign.run(on_progress, resumed=False)


class CampaignInterrupted(KeyboardInterrupt):
    """Ctrl-C during a campaign; finished missions are kept.

    Attributes:
        result: with the missions that were finished.
    """

    def __init__(self, result: CampaignResult) -> None:
        self.result = result
        super().__init__(f"interrupted; {result.kept()}")


def resume_campaign(
    folder: str | Path,
    workers: int | None = 1,
    *,
    runs: int | None = None,
    until_ci: str | None = None,
    on_progress: OnProgress | None = None,
    scheduler: str | None = None,
    managers: Collection[str] = (),
    confirmed: bool = False,
) -> CampaignResult:
    """Resume a campaign where it stopped, as suave_des.resume_campaign does, whose arguments it has.

    Missions that failed for reasons that may not recur (time-out, a worker that was killed) are run again.

    Args:
        folder, runs, until_ci, scheduler, managers, confirmed: see suave_des.resume_campaign.
        workers: as in run_campaign; the number may differ.
        on_progress: called when missions are done.

    Raises:
        InputError: there is no campaign, it is damaged or in use, or something that decides results has changed; the
            difference is named.
        WorkerError, StoreError, CampaignInterrupted: as run_campaign.
    """
    folder = Path(folder)
    if not (folder / STORE_FILE).is_file():
        raise InputError("there is no campaign to resume", file=folder, remedy="start one with --out")
    changed = {"runs": runs, "until_ci": until_ci, "out": folder, "workers": workers, "scheduler": scheduler}
    with locked(folder), closing(Store(folder / STORE_FILE)) as store:
        spec = CampaignSpec.of_stored(store.about("request"), **changed)
    if unknown := [name for name in managers if name not in spec.managers]:
        problem = f"the campaign has no manager {unknown[0]!r}, and cannot be given new ones"
        remedy = f"{did_you_mean(unknown[0], spec.managers, 'its managers')}; {_MORE_MANAGERS.format(folder)}"
        raise InputError(problem, file=folder, remedy=remedy)
    check_trusted(spec.managers, managers, folder, confirmed=confirmed)
    with ExitStack() as stack:
        try:
            campaign = _Campaign(spec, read_campaign_file(spec.scenario), stack)
        except InputError as error:
            if str(Path.cwd()) == spec.folder:
                raise
            remedy = f"the campaign was started in {spec.folder}: resume it there"
            raise InputError(error.problem, file=error.file, place=error.place, remedy=remedy) from None
        return campaign.run(on_progress, resumed=True)


def _check_new(folder: Path, *, overwrite: bool) -> None:
    check_output_folder(folder, "campaign", overwrite=overwrite, left_over=_is_of_campaign)
    if not overwrite and (folder / STORE_FILE).exists():
        raise InputError(
            "the output folder is not empty: it has a campaign in it",
            file=folder,
            remedy=f"--resume {folder} continues it, --overwrite replaces it; {_MORE_MANAGERS.format(folder)}",
        )


def _is_of_campaign(name: str) -> bool:
    """Whether a file belongs to a campaign; without a store, it was left by one that was killed at its start."""
    return name in (LOCK_FILE, SUAVE_FOLDER, *FILES) or name.startswith((STORE_FILE, NEW_STORE_FILE))


class _Campaign:
    """A campaign whose input is read and checked.

    Args:
        spec: what to run.
        file: the campaign file, if the specification names one.
        stack: stops at its end whatever the campaign starts.
        loaded: the scenario; None: it is read.
    """

    def __init__(
        self, spec: CampaignSpec, file: CampaignFile | None, stack: ExitStack, loaded: LoadedScenario | None = None
    ) -> None:
        self.spec = spec = spec.with_file(file)
        end_worker_of_script(spec.managers, spec.processes)
        try:
            spec.check()
        except InputError as error:
            raise error if file is None or "until_ci" not in spec.from_file else file.located(error) from None
        self._stack = stack
        self._local = self._start_workers()
        self.loaded, self.variation, self.inputs = read_inputs(spec, file, loaded)
        if "time_out_s" in spec.from_file and not (file is not None and file.sets("time_out_s")):
            self.spec = spec = replace(spec, time_out_s=default_time_out_s(self.loaded, self.variation))
        self.job = JobSpec(
            self.loaded, self.variation, spec.managers, spec.seed, spec.time_out_s, spec.record_knowledge
        )
        self.tracker = self._new_tracker()
        self.remarks: tuple[Remark, ...] = ()

    def _start_workers(self) -> Executor:
        """Start worker processes at once: they import what they need while this process reads and checks."""
        workers = self.spec.processes
        if workers == 1 or self.spec.scheduler is not None:
            return InProcess()
        return self._stack.enter_context(LocalWorkers(self.spec.managers, workers))

    def _executor(self) -> Executor:
        """Return the executor; a cluster is contacted only when everything else is checked."""
        if self.spec.scheduler is None:
            return self._local
        from suave_des.campaign.executors.dask_cluster import connected

        return self._stack.enter_context(connected(self.spec.scheduler))

    def _new_tracker(self) -> ProgressTracker:
        spec = self.spec
        points, sharing = self.variation.sweep.points, self.variation.runs_sharing_draw
        return ProgressTracker(points, spec.managers, spec.runs, spec.until, sharing)

    def run(self, on_progress: OnProgress | None, *, resumed: bool) -> CampaignResult:
        """Run the missions that are not done yet, and write the files."""
        executor, folder = self._executor(), self.spec.out
        with ExitStack() as stack:
            if folder is not None:
                if not folder.exists():
                    stack.callback(_remove_empty, folder)  # unless something is in it then
                make_output_folder(folder)
                stack.enter_context(locked(folder))
                remove_parts(folder, FILES)
            if not resumed:
                stack.callback(self._remove_store_if_empty)
            store = self._store(resumed=resumed)
            try:
                stopped = self._work(store, executor, on_progress)
                is_empty = store.count() == 0
            finally:
                if folder is not None:
                    store.close()
            if stopped is not None and is_empty and not resumed:
                raise stopped
            if isinstance(stopped, StoreError):
                raise StoreError(f"{stopped}{self._how_to_go_on()}") from None
            if isinstance(stopped, InputError):
                raise stopped
            try:
                result = self._results(store, is_whole=stopped is None)
            except KeyboardInterrupt:
                if folder is None:
                    raise
                raise KeyboardInterrupt(f"interrupted; {self._how_to_have_files()}") from None
        if isinstance(stopped, WorkerError):
            raise WorkerError(f"{stopped}; {result.kept()}")
        if stopped is not None:
            raise CampaignInterrupted(result)
        return result

    def _store(self, *, resumed: bool) -> Store:
        folder = self.spec.out
        if folder is None:
            return Store(None)
        decides = deciding(self.spec, self.loaded, self.inputs)
        about = {"request": self.spec.stored(), "deciding": decides, "identity": identity(decides)}
        path = folder / STORE_FILE
        if not resumed:
            remove_results(folder, FILES)  # first, or a kill would leave them beside the new campaign
            make_store(path, about)
        store = Store(path)
        try:
            if resumed:
                check_same(store.about("deciding"), decides, folder)
                store.forget_passing_failures()
                for name, value in about.items():
                    store.note(name, value)
        except BaseException:
            store.close()
            raise
        return store

    def _work(
        self, store: Store, executor: Executor, on_progress: OnProgress | None
    ) -> KeyboardInterrupt | SuaveDesError | None:
        """Run missions until all are done; return what stopped the campaign before that."""
        tracker, spec, alike = self.tracker, self.spec, FirstFailures(self.spec.managers)
        remarks: dict[tuple[str, ...], int] = {
            (manager, text): count for manager, text, count in store.about("remarks", default=[])
        }
        try:
            tracker.add_earlier(store.outcomes())
            points = self.variation.sweep.points
            missions = plan(
                points, len(spec.managers), spec.runs, store.settled, tracker.is_over, run_by_run=tracker.needs_pairs
            )
            if left := tracker.total - tracker.done:
                for among in executor.outcomes(self.job, missions, left):
                    finished = [(key, each) for key, each in among if not isinstance(each, Remark)]
                    for _, each in among:
                        if isinstance(each, Remark):
                            remarks[each[:2]] = remarks.get(each[:2], 0) + each.times
                    store.append(finished)
                    alike.check(finished)
                    tracker.add(finished)
                    if on_progress is not None:
                        on_progress(tracker.progress())
            store.commit()
            self.remarks = tuple(Remark(manager, text, count) for (manager, text), count in sorted(remarks.items()))
            if self.remarks:
                store.note("remarks", self.remarks)
        except (KeyboardInterrupt, SuaveDesError) as error:
            if not isinstance(error, StoreError):
                with suppress(StoreError):  # which is reported when the files cannot be written either
                    store.commit()
            return error
        return None

    def _results(self, store: Store, *, is_whole: bool) -> CampaignResult:
        outcomes, tracker = self._outcomes(store), self.tracker
        if not is_whole:  # it may have been interrupted while it counted
            tracker = self._new_tracker()
            tracker.add(outcomes())
        seen = trained_on(self.loaded, self.spec.managers, self.spec.seed, self.spec.runs)
        remarks = (*map(str, self.remarks), *seen)
        result = gather(self.spec, self.loaded, self.variation, outcomes, tracker, remarks)
        if self.spec.out is not None:
            try:
                write_results(result, self.inputs, identity(deciding(self.spec, self.loaded, self.inputs)))
            except InputError as error:
                raise InputError(error.problem, file=error.file, remedy=self._how_to_have_files()) from None
        return result

    def _outcomes(self, store: Store) -> Callable[[], Iterator[Finished]]:
        if self.spec.out is None:
            return store.outcomes
        path = self.spec.out / STORE_FILE
        return lambda: stored_outcomes(path)

    def _remove_store_if_empty(self) -> None:
        """Remove a store without outcomes; one that cannot be read stays."""
        if self.spec.out is not None:
            with suppress(SuaveDesError):
                if next(stored_outcomes(self.spec.out / STORE_FILE), None) is None:
                    remove_store(self.spec.out)

    def _how_to_have_files(self) -> str:
        return f"nothing is lost: suave-des campaign --resume {self.spec.out} writes the files"

    def _how_to_go_on(self) -> str:
        if self.spec.out is None or not (self.spec.out / STORE_FILE).exists():
            return ""
        return f"; what was kept before is safe: suave-des campaign --resume {self.spec.out} runs the rest"


def _remove_empty(folder: Path) -> None:
    with suppress(OSError):
        folder.rmdir()
