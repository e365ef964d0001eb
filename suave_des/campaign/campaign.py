"""Campaigns, for programs: many missions of one scenario under several managers, saved as they
finish; and training.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, Unpack

from suave_des import files
from suave_des.arguments import plain_arguments
from suave_des.campaign import identity, inputs, trust
from suave_des.campaign.missions import (
    GIVEN_UP,
    Campaign,
    Executor,
    MissionRunner,
    Remark,
    WorkerError,
)
from suave_des.campaign.progress import OnProgress, Progress
from suave_des.campaign.results import CampaignResult, gather
from suave_des.campaign.spec import (
    RUNS_LIMIT,
    SEED_LIMIT,
    CampaignSpec,
    check_range,
    read_campaign_file,
)
from suave_des.campaign.workers import LocalWorkers, in_process
from suave_des.errors import InputError, SuaveDesError, did_you_mean
from suave_des.learned import Learned
from suave_des.metrics.result import MissionMetrics
from suave_des.records.mission_folder import provenance
from suave_des.records.store import (
    STORE_FILE,
    MissionFailure,
    Store,
    StoreError,
    check_replaceable,
    has_campaign,
    is_left_over,
    read_note,
    read_written,
    store_read,
    tidy,
)
from suave_des.registry import ManagerLike, name_of
from suave_des.scenario.loader import LoadedScenario, Replacements, load_scenario
from suave_des.simulation.inputs import check_inputs
from suave_des.user_code import tell_code

__all__ = ["CampaignInterrupted", "CampaignResult", "Progress", "resume_campaign", "run_campaign"]
_MORE_MANAGERS = "for other managers, run a campaign with the same seed into another folder: compare pairs their runs"


class CampaignInterrupted(KeyboardInterrupt):
    """Ctrl-C during a campaign; finished missions are kept, and `result` has them."""

    def __init__(self, result: CampaignResult) -> None:
        self.result = result
        super().__init__(f"interrupted; {result.kept()}")


def run_campaign(
    scenario: str | Path | LoadedScenario,
    managers: ManagerLike | Iterable[ManagerLike] | None = None,
    runs: int | None = None,
    seed: int | None = None,
    workers: int | None = 1,
    out: str | Path | None = None,
    *,
    on_progress: OnProgress | None = None,
    settings_of: Callable[[Sequence[str]], dict[str, dict[str, Any]]] = lambda managers: {},
    **options: Any,
) -> CampaignResult:
    """Run `runs` missions of a scenario under each manager, as suave_des.run_campaign does, whose
    arguments it has.

    The result is the same however often the campaign was interrupted and resumed. `on_progress` is
    called when missions are done; `settings_of` returns settings of the campaign's managers, which
    a campaign file may name.

    Raises:
        CampaignInterrupted: Ctrl-C; finished missions are kept.
        InputError, WorkerError, StoreError: as suave_des.run_campaign.
    """
    loaded = scenario if isinstance(scenario, LoadedScenario) else None
    named = scenario.path if isinstance(scenario, LoadedScenario) else scenario
    names = None if managers is None else _names(managers)
    given = {"managers": names, "runs": runs, "seed": seed, "workers": workers, "out": out}
    spec = CampaignSpec.of(named, **given, **options)
    return _begin(spec, loaded, on_progress, settings_of)


def fly_campaign(
    executor: Executor, scenario: str | Path, manager: str, **options: Any
) -> CampaignResult:
    """Run missions under one manager by an executor of one's own, otherwise as run_campaign.

    Raises:
        CampaignInterrupted, InputError, WorkerError, StoreError: as run_campaign.
    """
    spec = CampaignSpec.of(scenario, managers=[manager], workers=1, **options)
    return _begin(spec, None, None, lambda managers: {}, executor)


def _begin(
    spec: CampaignSpec,
    loaded: LoadedScenario | None,
    on_progress: OnProgress | None,
    settings_of: Callable[[Sequence[str]], dict[str, dict[str, Any]]],
    executor: Executor | None = None,
) -> CampaignResult:
    """Run a new campaign."""
    if spec.out is not None:
        _check_is_free(spec.out, overwrite=spec.overwrite)
    file = read_campaign_file(spec.scenario) if loaded is None else None
    if (
        file is not None
        and "managers" not in spec.model_fields_set
        and "managers" in file.settings.model_fields_set
    ):
        tell_code(file.path, file.settings.managers)
    if settings := settings_of(spec.with_file(file).managers):
        spec = spec.model_copy(
            update={"replacements": {**spec.replacements, "manager_options": settings}}
        )
    with ExitStack() as stack:
        checked = _checked(
            stack, spec.with_file(file), lambda: inputs.read_campaign(spec, file, loaded), executor
        )
        return _finish(checked, _new(stack, checked), on_progress, is_new=True)


def _names(managers: ManagerLike | Iterable[ManagerLike]) -> list[str]:
    """Return the names of one manager or several."""
    if isinstance(managers, str | type):
        return [name_of(managers)]
    if isinstance(managers, Iterable):
        return [name_of(manager) for manager in managers]
    return [name_of(managers)]  # which says what it expected


def _check_is_free(folder: Path, *, overwrite: bool) -> None:
    """Check that a new campaign may be written into a folder.

    Raises:
        InputError: something is in it that is not to be replaced.
    """
    noted = read_written(folder) if overwrite else {}
    files.check_output_folder(
        folder, "campaign", overwrite=overwrite, left_over=is_left_over, noted=noted
    )
    if noted:
        check_replaceable(folder, noted)
    if not overwrite and has_campaign(folder):
        remedy = f"--resume {folder} continues it, --overwrite replaces it; {_MORE_MANAGERS}"
        problem = "the output folder is not empty: it has a campaign in it"
        raise InputError(problem, file=folder, remedy=remedy)


def resume_campaign(
    folder: str | Path,
    workers: int | None = 1,
    *,
    runs: int | None = None,
    on_progress: OnProgress | None = None,
    scheduler: str | None = None,
    managers: Collection[str] = (),
    confirmed: bool = False,
) -> CampaignResult:
    """Resume a campaign where it stopped, as suave_des.resume_campaign does, whose arguments it
    has.

    Missions that failed for reasons that may not recur (time-out, a worker that was killed) are run
    again.

    Raises:
        InputError: the store is damaged or in use, or as suave_des.resume_campaign.
        WorkerError, StoreError, CampaignInterrupted: as run_campaign.
    """
    changed = {"runs": runs, "workers": workers, "scheduler": scheduler, "out": Path(folder)}
    changed = {name: value for name, value in changed.items() if value is not None}
    with ExitStack() as stack:
        store, campaign = stack.enter_context(
            _stored(Path(folder), changed, managers, confirmed=confirmed)
        )
        checked = _checked(stack, campaign.spec, lambda: campaign)
        _resume(store, checked, Path(folder))
        return _finish(checked, store, on_progress, is_new=False)


def opened_campaign(
    folder: Path, managers: Collection[str] = (), *, confirmed: bool = False
) -> MissionRunner:
    """Open the campaign in a folder, to run missions of it again.

    Args:
        managers: those whose missions are wanted, which the user has named himself; empty: all.
        confirmed: whether all code that the folder names may run, see `check_trusted`.

    Raises:
        InputError: there is no campaign in the folder, its inputs no longer exist, or it names code
            that is neither installed nor named.
    """
    changed = {"managers": tuple(managers)} if managers else {}
    with _stored(folder, changed, managers, confirmed=confirmed) as (_, campaign):
        inputs.check_campaign(campaign)
    return MissionRunner(campaign)


@contextmanager
def _stored(
    folder: Path, changed: Mapping[str, Any], named: Collection[str] = (), *, confirmed: bool
) -> Iterator[tuple[Store, Campaign]]:
    """Open the campaign in a folder, with options that differ from the stored ones; check that its
    code is trusted.
    """
    if not has_campaign(folder):
        raise InputError(
            "there is no campaign in it", file=folder, remedy="give the --out folder of a campaign"
        )
    path = folder / STORE_FILE
    with store_read(path):
        noted = read_note(path, "request")
        stored = CampaignSpec.model_validate(noted)
        if "runs" in changed and stored.command:
            changed = {**changed, "command": _with_runs(stored.command, changed["runs"])}
        request = CampaignSpec.read({**stored.stored(), **changed})
        with _begun_in(stored.folder):
            file = read_campaign_file(request.scenario)
            campaign = inputs.read_campaign(request, file)
    known = {*campaign.spec.managers, *campaign.code()}
    if unknown := [name for name in named if name not in known]:
        problem = f"the campaign has no manager {unknown[0]!r}, and cannot be given new ones"
        remedy = f"{did_you_mean(unknown[0], sorted(known), 'its managers')}; {_MORE_MANAGERS}"
        raise InputError(problem, file=folder, remedy=remedy)
    trust.check_trusted(campaign, named, folder, confirmed=confirmed)
    with closing(Store(path)) as store:
        if store.about("request") != noted:
            raise InputError("changed while it was read", file=path, remedy="try it again")
        yield store, campaign


@contextmanager
def _begun_in(folder: str) -> Iterator[None]:
    """Say, of a file that is not there, where the campaign was begun, if that is elsewhere."""
    try:
        yield
    except InputError as error:
        is_missing = error.file is not None and not Path(error.file).exists()
        if not is_missing or folder in ("", str(Path.cwd())):
            raise
        problem = f"{error.problem}; the campaign was begun in {folder}, where relative paths begin"
        remedy = "give the command there"
        raise InputError(problem, file=error.file, place=error.place, remedy=remedy) from None


def _with_runs(command: Sequence[str], runs: int) -> tuple[str, ...]:
    """The command line that asks for so many runs, in place of those that it asked for."""
    words = [word for word in command if not word.startswith("--runs=")]
    if "--runs" in words:
        place = words.index("--runs")
        del words[place : place + 2]
    return (*words, "--runs", str(runs))


@dataclass(frozen=True)
class _Checked:
    """A campaign whose inputs are checked.

    Attributes:
        executor: runs its missions.
        decided_by: SHA-256 of each further file that decides its results.
        about: what its store notes about it.
    """

    campaign: Campaign
    executor: Executor
    decided_by: Mapping[str, str]
    about: Mapping[str, Any]

    @property
    def folder(self) -> Path | None:
        """Folder for result files."""
        return self.campaign.spec.out

    @property
    def resuming_command(self) -> str:
        """The command that runs the rest of it, and writes its files."""
        return f"suave-des campaign --resume {self.folder}"


def _checked(
    stack: ExitStack,
    spec: CampaignSpec,
    read: Callable[[], Campaign],
    executor: Executor | None = None,
) -> _Checked:
    """Read and check a campaign, while its workers start; `stack` ends them.

    Raises:
        InputError: something given cannot be used.
    """
    spec.check()
    executor = in_process if executor is None else executor
    if spec.processes > 1 and spec.scheduler is None:
        executor = stack.enter_context(LocalWorkers(spec.managers, spec.processes)).outcomes
    campaign = read()
    decided_by = inputs.check_campaign(campaign)
    if spec.scheduler is not None:
        executor = stack.enter_context(_connected(spec.scheduler))
    decides = identity.deciding(campaign, decided_by)
    about = {
        "request": campaign.request.stored(),
        "deciding": decides,
        "identity": identity.identity(decides),
    }
    return _Checked(campaign, executor, decided_by, about)


def _connected(scheduler: str) -> AbstractContextManager[Executor]:
    """Connect to a Dask cluster; an InputError without Dask."""
    try:
        connected: Callable[[str], AbstractContextManager[Executor]] = import_module(
            "suave_des.interfaces.cluster"  # an extra's, above this package
        ).connected
    except ImportError as error:
        problem = f"a scheduler needs Dask, which is not installed ({error})"
        raise InputError(problem, remedy="pip install 'suave-des[dask]'") from None
    return connected(scheduler)


def _new(stack: ExitStack, checked: _Checked) -> Store:
    """Begin the store of a new campaign, which `stack` closes."""
    store = stack.enter_context(_new_store(checked.folder, checked.about))
    if checked.folder is not None:
        trust.note_own(checked.campaign, checked.folder)
    return store


def _resume(store: Store, checked: _Checked, folder: Path) -> None:
    """Prepare a store for the rest of its campaign.

    Raises:
        InputError: something that determines results is not what it was.
    """
    with store.reading():
        identity.check_same(store.about("deciding"), checked.about["deciding"], folder)
        check_replaceable(folder, store.written())
    tidy(store, is_new=False)
    store.forget_passing_failures()
    for name, value in checked.about.items():
        store.note(name, value)


def _finish(
    checked: _Checked, store: Store, on_progress: OnProgress | None, *, is_new: bool
) -> CampaignResult:
    """Run the missions that are not done yet, and write the files."""
    stopped, remarks = _work(checked.campaign, store, checked.executor, on_progress)
    if isinstance(stopped, InputError):
        raise stopped
    if stopped is not None and is_new and store.count() == 0:
        raise stopped
    if isinstance(stopped, StoreError):
        raise _with_what_is_kept(stopped, checked)
    result = _result(checked, store, remarks)
    if isinstance(stopped, WorkerError):
        raise WorkerError(f"{stopped}; {result.kept()}")
    if stopped is not None:
        raise CampaignInterrupted(result)
    return result


def _with_what_is_kept(stopped: StoreError, checked: _Checked) -> StoreError:
    """Return an error about a store with what can be done about it."""
    if checked.folder is None or not has_campaign(checked.folder):
        return StoreError(str(stopped))
    rest = f"what was kept before is safe: {checked.resuming_command} runs the rest"
    return StoreError(f"{stopped}; {rest}")


def _result(checked: _Checked, store: Store, remarks: Sequence[Remark]) -> CampaignResult:
    """Gather the result of a campaign, and write its files."""
    campaign = checked.campaign
    folder = checked.folder
    how = f"nothing is lost: {checked.resuming_command} writes the files"
    try:
        with store.reading():
            told = (*map(str, remarks), *inputs.trained_on(campaign))
            outcomes = partial(store.outcomes, campaign.problem_of)
            result = gather(campaign, outcomes, told)
            if folder is not None:
                of_file = campaign.file.inputs if campaign.file else {}
                hashes = {**checked.decided_by, **of_file}
                made = provenance(campaign.loaded, hashes, campaign.spec.command)
                result.write(store, {**made, "campaign_sha256": checked.about["identity"]})
        return result
    except KeyboardInterrupt:
        if folder is None:
            raise
        raise KeyboardInterrupt(f"interrupted; {how}") from None
    except InputError as error:
        if folder is None:
            raise
        raise InputError(error.problem, file=error.file, remedy=how) from None


@contextmanager
def _new_store(folder: Path | None, about: Mapping[str, Any]) -> Iterator[Store]:
    """Begin the store of a new campaign, in its folder or a temporary one; what is left empty is
    removed.
    """
    if folder is None:
        store = Store(None)
        store.begin(about)
        yield store  # whose result reads it
        return
    was_there = folder.exists()
    try:
        files.make_output_folder(folder)
        store = Store(folder / STORE_FILE, replace=True)
        try:
            # first, or a kill would leave earlier results beside the new campaign
            tidy(store, is_new=True)
            store.begin(about)
            yield store
        finally:
            store.close(keep_empty=False)
    finally:
        if not was_there:
            with suppress(OSError):  # it has results
                folder.rmdir()


def _work(
    campaign: Campaign, store: Store, executor: Executor, on_progress: OnProgress | None
) -> tuple[KeyboardInterrupt | SuaveDesError | None, list[Remark]]:
    """Run missions until all are done; return what stopped the campaign before that, and remarks
    about managers.
    """
    with store.reading():
        kept = store.about("remarks", default=[])
        remarks = {Remark(manager, text) for manager, text, *_ in kept if text != GIVEN_UP}
    done = failed = 0
    stopped: KeyboardInterrupt | SuaveDesError | None = None
    try:
        with store.reading():
            for _, each in store.outcomes(campaign.problem_of):
                done += 1
                failed += isinstance(each, MissionFailure)
        if left := campaign.planned - done:
            # The summary needs it in the end. It takes 0.2 s, which workers take to start, too.
            import_module("scipy.special")
            for among in executor(campaign, campaign.missions(store.settled), left):
                finished = []
                for key, each in among:
                    if isinstance(each, Remark):
                        remarks.add(each)
                    else:
                        finished += [(key, each), *campaign.copies(key, each)]
                failed += sum(isinstance(each, MissionFailure) for _, each in finished)
                store.append(finished)
                done += len(finished)
                if on_progress is not None:
                    on_progress(Progress(done, failed, campaign.planned))
        store.commit()
    except (KeyboardInterrupt, SuaveDesError) as error:
        stopped = error
    told = sorted(remarks)
    with suppress(StoreError):  # which is reported when the files cannot be written either
        store.commit()
        if told:
            store.note("remarks", told)
    return stopped, told


# Training: missions in one process, in the order of their runs, and a file at the end.

TRAINING_SEED = 0
"""Not that of campaigns, so that a campaign has missions that training has not seen."""


@plain_arguments
def train(
    scenario: str | Path,
    manager: str,
    missions: int,
    out: str | Path,
    *,
    seed: int = TRAINING_SEED,
    overwrite: bool = False,
    on_mission: Callable[[MissionMetrics], None] = lambda metrics: None,
    **replacements: Unpack[Replacements],
) -> Learned:
    """Train a manager, and write the training result.

    Example:
        train("seams2023", "learner:Learner", 500, "policy.json")

    Args:
        scenario: path of a scenario file, or name of a shipped one.
        manager: name, or module:Class; it keeps what it learns in the dict that its hook `recall`
            is given.
        missions: how many: runs 1 to that.
        on_mission: called with the metrics of each mission.
        replacements: as of load_scenario.

    Raises:
        InputError: something given cannot be used, or nothing was learned; nothing is written then.
        MissionError: the manager raised; nothing is written then.
    """
    # with the compiler, which campaigns load in their workers
    from suave_des.simulation.simulator import Simulator

    files.check_output_file(Path(out), overwrite=overwrite)
    check_range("missions", missions, 1, RUNS_LIMIT)
    check_range("seed", seed, 0, SEED_LIMIT)
    loaded = load_scenario(scenario, **replacements)
    hashes = check_inputs([loaded], [manager], {})
    learned: dict[str, Any] = {}
    simulator = Simulator(loaded, training={manager: learned})
    for run in range(1, missions + 1):
        on_mission(simulator.run(manager, run, seed).metrics)
    if not learned:
        remedy = "keep what it learns in the dict that the hook recall is given"
        raise InputError(f"manager {manager} has learned nothing", remedy=remedy)
    read = dict(sorted({**loaded.inputs, **hashes}.items()))
    result = Learned(manager, loaded.scenario.name, seed, missions, read, learned)
    files.write_files(Path(out).parent, {Path(out).name: result.text()})
    return result
