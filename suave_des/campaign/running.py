"""Runs a campaign whose input is read and checked, keeping what is done."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from suave_des.campaign.early_stop import parse_until_ci
from suave_des.campaign.executors import Executor, WorkerError
from suave_des.campaign.lock import FolderLock
from suave_des.campaign.outcomes import Finished, Job
from suave_des.campaign.output import make_output_folder, remove_derived, remove_parts
from suave_des.campaign.plan import MissionKey, plan
from suave_des.campaign.progress import OnProgress, Watch
from suave_des.campaign.request import Request, check_same, deciding
from suave_des.campaign.results import FILES, CampaignResult, gather, write_results
from suave_des.campaign.store import (
    STORE_FILE,
    Store,
    StoreError,
    make_store,
    remove_store,
    stored_outcomes,
)
from suave_des.campaign.variation import Variation
from suave_des.errors import InputError, SuaveDesError
from suave_des.scenario.loader import LoadedScenario

if TYPE_CHECKING:
    from suave_des.campaign.missions import MissionRunner

LARGE = 1_000_000
"""Missions from which a campaign wants to be confirmed."""
_TIMED_RUNS = 3


class CampaignInterrupted(KeyboardInterrupt):
    """Ctrl-C during a campaign; finished missions are kept.

    Attributes:
        result: with the missions that were finished.
    """

    def __init__(self, result: CampaignResult) -> None:
        self.result = result
        super().__init__(f"interrupted; {result.kept()}")


class Campaign:
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
        self.job = Job(loaded, variation, request.managers, request.seed, request.time_out_s, request.record_knowledge)
        self.until = None if request.until_ci is None else parse_until_ci(request.until_ci)
        self.watch = self._new_watch()

    def _new_watch(self) -> Watch:
        return Watch(self.variation.sweep.points, self.request.managers, self.request.runs, self.until)

    def _runner(self) -> MissionRunner:
        from suave_des.campaign.missions import MissionRunner  # with it comes the compiler, which takes a while

        return MissionRunner(self.job)

    def check_size(self, workers: int) -> None:
        """See that a very large campaign is meant.

        Raises:
            InputError: it has more than LARGE missions; the time that they take is told, from some of them.
        """
        total = self.watch.total
        if total <= LARGE:
            return
        managers = range(len(self.request.managers))
        few = tuple(MissionKey(0, manager, run) for manager in managers for run in range(1, _TIMED_RUNS + 1))
        runner = self._runner()
        runner.run(few[::_TIMED_RUNS])  # compiles, and fills the reasoner's memory
        began_s = time.perf_counter()
        runner.run(few)
        expected_s = (time.perf_counter() - began_s) / len(few) * total / workers
        by = f"{workers} worker{'s' if workers > 1 else ''}"
        problem = f"{total:,} missions take about {_duration_text(expected_s)} with {by} on this machine"
        raise InputError(problem, remedy="give --yes if that is meant")

    def run(self, place: Executor, on_progress: OnProgress | None, *, resumed: bool) -> CampaignResult:
        """Run what is not done yet, and write the files."""
        with ExitStack() as stack:
            if self.folder is not None:
                if not self.folder.exists():
                    stack.callback(_remove_empty, self.folder)  # unless something is in it then
                make_output_folder(self.folder)
                lock = FolderLock(self.folder)
                stack.callback(lock.release)  # before it is taken, as that may be interrupted anywhere
                lock.take()
                remove_parts(self.folder, FILES)
            if not resumed:
                stack.callback(self._remove_if_empty)
            store = self._store(resumed=resumed)
            try:
                stopped = self._work(store, place, on_progress)
                is_empty = store.count() == 0
            finally:
                if self.folder is not None:
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
                if self.folder is None:
                    raise
                raise KeyboardInterrupt(f"interrupted; {self._how_to_have_files()}") from None
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
        self, store: Store, place: Executor, on_progress: OnProgress | None
    ) -> KeyboardInterrupt | SuaveDesError | None:
        """Run missions until all are done; what stopped the campaign before that."""
        try:
            watch = self.watch
            watch.take_earlier(store.outcomes())
            points, managers = self.variation.sweep.points, len(self.request.managers)
            missions = plan(points, managers, self.request.runs, store.settled, watch.is_over)
            left = watch.total - watch.done
            if left:
                for finished in place.outcomes(self.job, missions, left):
                    store.append(finished)
                    watch.take(finished)
                    if on_progress is not None:
                        on_progress(watch.progress())
            store.commit()
        except (KeyboardInterrupt, SuaveDesError) as error:
            if not isinstance(error, StoreError):
                with suppress(StoreError):  # which is told when the files cannot be written either
                    store.commit()
            return error
        return None

    def _results(self, store: Store, *, is_whole: bool) -> CampaignResult:
        outcomes, watch = self._outcomes(store), self.watch
        if not is_whole:  # it may have been interrupted while it counted
            watch = self._new_watch()
            watch.take(outcomes())
        result = gather(
            self.request,
            self.loaded,
            self.variation,
            self.folder,
            lambda: watch.counted(outcomes()),
            planned=watch.total,
            stops=watch.stops(),
        )
        if self.folder is not None:
            try:
                write_results(result, self.request, self.inputs)
            except InputError as error:
                raise InputError(error.problem, file=error.file, remedy=self._how_to_have_files()) from None
        return result

    def _outcomes(self, store: Store) -> Callable[[], Iterator[Finished]]:
        if self.folder is None:
            return store.outcomes
        path = self.folder / STORE_FILE
        return lambda: stored_outcomes(path)

    def _remove_if_empty(self) -> None:
        """Remove a store in which nothing is; what cannot be read stays."""
        if self.folder is not None:
            with suppress(SuaveDesError):
                if next(stored_outcomes(self.folder / STORE_FILE), None) is None:
                    remove_store(self.folder)

    def _how_to_have_files(self) -> str:
        return f"nothing is lost: suave-des campaign --resume {self.folder} writes the files"

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
