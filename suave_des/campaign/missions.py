"""A campaign's missions: which have to be run, what they share, how one is run within its time, and
what comes out.
"""

from __future__ import annotations

import ctypes
import signal
import sys
import threading
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import chain, compress, product
from types import FrameType
from typing import TYPE_CHECKING, Final, NamedTuple

from suave_des.campaign.spec import CampaignFile, CampaignSpec, check_range
from suave_des.campaign.variation import Variation, cell_of, short_mission
from suave_des.errors import (
    MissionError,
    MissionTimeOut,
    PassingError,
    SuaveDesError,
    may_pass,
)
from suave_des.imports import look_beside
from suave_des.interrupts import alarm, handled
from suave_des.metrics.result import MissionResult
from suave_des.records.metrics import COLUMNS, Row, further_of, row_of
from suave_des.records.mission_folder import mission_line
from suave_des.records.store import MissionFailure, MissionKey, MissionOutcome
from suave_des.registry import is_built_in, is_installed
from suave_des.scenario.loader import LoadedScenario
from suave_des.tracebacks import place_of

if TYPE_CHECKING:
    from suave_des.simulation.simulator import Simulator

NOT_REPEATABLE = (
    "a mission that was run again in the same process gave another row: the class keeps state from one mission"
    " to the next, or has its own source of randomness, so results depend on the number of workers."
    " To learn, use `suave-des train`; for random numbers, system.stream"
)
GIVEN_UP = (
    "its first 3 missions here took too long, and none was finished, so the others were left out"
)
_IN_VAIN = 3
_REPEATED_AFTER = {2, *(4**power for power in range(1, 11))}
"""Missions of a manager in a process after which its first is run again, as its class may keep
state
"""
_REPEAT_S = 1.0
"""A mission that swallowed the interruption is interrupted again after this time."""
_TICKS = 20
"""Parts into which a time limit is divided: of one in which the process was stopped (Ctrl-Z) no
more than that part counts.
"""
_LEAST_SHARE = 0.5
"""With less of the time limit as CPU time, a manager that never waits was kept waiting."""


class Remark(NamedTuple):
    """A remark about a manager for users, delivered among the outcomes."""

    manager: str
    text: str

    def __str__(self) -> str:
        """Return it in one line."""
        return f"manager {self.manager}: {self.text}"


Chunk = tuple[MissionKey, ...]
Finished = tuple[MissionKey, Row | MissionFailure | Remark]


class WorkerError(SuaveDesError):
    """Missions cannot be run, because the processes that should run them die."""


@dataclass(frozen=True)
class Campaign:
    """A campaign that was read: everything that its missions share. It is sent to workers by value.

    Attributes:
        request: what was given of the specification; the rest is left to the campaign file.
        spec: the whole specification.
        variation: what differs between its missions besides manager and run.
        inputs: SHA-256 of the ensemble's file by its name, if there is one.
    """

    request: CampaignSpec
    spec: CampaignSpec
    loaded: LoadedScenario
    variation: Variation
    file: CampaignFile | None
    inputs: Mapping[str, str]

    @cached_property
    def points(self) -> int:
        """Number of points of its sweep."""
        return self.variation.sweep.points

    @property
    def planned(self) -> int:
        """Number of missions."""
        return self.points * len(self.spec.managers) * self.spec.runs

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """Columns of runs.csv."""
        return (*COLUMNS, *self.variation.columns, *self.loaded.scenario.further_columns)

    def problem_of(self, outcome: MissionOutcome) -> str:
        """Say why an outcome, which may come from elsewhere, cannot be one of this campaign; empty
        if it can.
        """
        key, found = outcome
        names = self.spec.managers
        is_planned = 0 <= key.point < self.points and 1 <= key.run <= self.spec.runs
        if not (is_planned and 0 <= key.manager < len(names)):
            return f"it has run {key.run} of manager {key.manager + 1}, which was not to be run"
        own = names[key.manager], key.run
        if isinstance(found, MissionFailure):
            is_own = (found.manager, found.run, found.point) == (*own, key.point)
        else:
            width = len(self.columns) + self.spec.record_knowledge
            is_own = found[1:4] == (*own, self.spec.seed) and len(found) == width
        return "" if is_own else f"the outcome of run {key.run} is that of another mission"

    def missions(self, settled: Callable[[int, int], Collection[int]]) -> Iterator[MissionKey]:
        """Yield the missions that have yet to be run, in order.

        `settled` returns the runs of a manager at a point that need not be run; it is called when
        their turn comes. Missions that are the same as at an earlier point are copies of these,
        unless only the earlier ones are there, as campaigns of earlier versions may have it.
        """
        runs = range(1, self.spec.runs + 1)
        for point, manager in product(range(self.points), range(len(self.spec.managers))):
            known = settled(point, manager)
            first = self._alike[manager][point]
            wanted = runs if first == point else sorted(settled(first, manager))
            yield from (MissionKey(point, manager, run) for run in wanted if run not in known)

    @cached_property
    def _alike(self) -> list[Sequence[int]]:
        """By manager, for each point, the first one at which its missions are the same; that itself
        if knowledge states are recorded, which name their point.
        """
        sweep = self.variation.sweep
        found: list[Sequence[int]] = []
        for manager in self.spec.managers:
            read = [_reads(manager, self.variation.paths[name]) for name in sweep.parameters]
            firsts: dict[str, int] = {}
            if all(read) or self.spec.record_knowledge:
                found.append(range(sweep.points))
                continue
            each = (
                repr([*compress(values.values(), read)])
                for values in map(sweep.values, range(sweep.points))
            )
            found.append([firsts.setdefault(own, point) for point, own in enumerate(each)])
        return found

    @cached_property
    def _later(self) -> dict[tuple[int, int], list[int]]:
        """The later points whose missions are the same, by point and manager."""
        found: dict[tuple[int, int], list[int]] = defaultdict(list)
        for manager, firsts in enumerate(self._alike):
            for point, first in enumerate(firsts):
                if first != point:
                    found[first, manager].append(point)
        return dict(found)

    def copies(self, key: MissionKey, outcome: Row | MissionFailure) -> Iterator[MissionOutcome]:
        """Yield the outcomes of missions that are the same as one, at later points of the sweep."""
        for point in self._later.get(key[:2], ()):
            copied = key._replace(point=point)
            if isinstance(outcome, MissionFailure):
                yield copied, outcome._replace(point=point)
            else:
                swept = map(cell_of, self.variation.sweep.values(point).values())
                further = outcome[len(COLUMNS) + len(self.variation.paths) :]
                yield copied, (*outcome[: len(COLUMNS)], *swept, *further)

    def scenarios(self) -> Iterator[LoadedScenario]:
        """Yield scenarios that together have every swept value of what managers and functions are
        set to.
        """
        if any(
            path.startswith(("managers.", "functions.")) for path in self.variation.paths.values()
        ):
            for point in sorted(set(self.variation.sweep.each_value())):
                yield self.variation.scenario(self.loaded, point)
        else:
            yield self.loaded

    def code(self) -> tuple[str, ...]:
        """Return the managers and the classes of functions that it runs and that no package has
        installed.
        """
        nodes = [
            each.node
            for scenario in self.scenarios()
            for each in scenario.scenario.functions.values()
        ]
        managers = [name for name in self.spec.managers if not is_installed(name)]
        return tuple(dict.fromkeys([*managers, *(node for node in nodes if ":" in node)]))

    def failed(
        self, key: MissionKey, cause: str, time_s: float | None = None
    ) -> tuple[MissionKey, MissionFailure]:
        """Return the outcome of a mission that was ended, at a mission time, or whose process
        was.
        """
        manager = self.spec.managers[key.manager]
        return key, MissionFailure(manager, key.run, time_s, cause, lasting=False, point=key.point)

    @property
    def too_long(self) -> str:
        """The cause where a mission took too long."""
        return f"not done after {self.spec.time_out_s:g} s (time-out)"


_SETTINGS_READ: Final[Mapping[str, tuple[str, ...]]] = {
    "none": (),
    "random": ("random",),
    "metacontrol": ("metacontrol",),
    "bt": ("bt",),
    "bt_extended": ("bt",),
}
"""Whose settings a manager reads; others than these may read all."""


def _reads(manager: str, path: str) -> bool:
    """Whether a manager's missions depend on the value at a key path of the scenario."""
    part, _, rest = path.partition(".")
    section = rest.partition(".")[0]
    return part != "managers" or section in _SETTINGS_READ.get(manager, (section,))


Executor = Callable[[Campaign, Iterable[MissionKey], int], Iterator[list[Finished]]]
"""Runs missions somewhere: in this process, in worker processes, or on a cluster.

It takes the campaign, the keys of missions, each of which is requested only when a worker has room
for it, and about how many they are. It yields their outcomes, some at a time, in the order in which
they finish. It raises InputError if the scenario, a manager or the knowledge base cannot be used at
all, and WorkerError if workers end again and again.
"""


def reasoner_is_stuck() -> bool:
    """Whether a reasoner of this process works on what was waited for in vain."""
    pellet = sys.modules.get("suave_des.knowledge.pellet")  # many missions do without
    return pellet is not None and bool(pellet.is_stuck())


MissionFunction = Callable[["Simulator", str, int, int, bool], MissionResult]
"""Flies a mission: takes its simulator, manager, run, seed and whether it is recorded."""


def _fly(simulator: Simulator, manager: str, run: int, seed: int, record: bool) -> MissionResult:
    return simulator.run(manager, run, seed, record=record)


class MissionRunner:
    """Runs missions of one campaign in this process.

    Args:
        fly: flies each.
    """

    def __init__(self, campaign: Campaign, fly: MissionFunction = _fly) -> None:
        self.campaign = campaign
        self._fly = fly
        self._variation = campaign.variation
        if campaign.file is not None:
            look_beside(campaign.file.path)  # this may be a worker process
        # Load or compile what missions run, before the first one's time counts: a mission of a
        # second does.
        short_mission(campaign.loaded)
        members = len(self._variation.ensemble.members) if self._variation.ensemble else 1
        self._simulator = lru_cache(members)(self._simulator_of)  # missions come point by point
        self._values = lru_cache(1)(self._variation.sweep.values)
        self._first: dict[int, tuple[MissionKey, Row | MissionFailure]] = {}
        self._number = Counter[int]()
        self._too_long = Counter[int]()
        self._in_time = set[int]()

    def run(self, manager: str, run: int, point: int = 0) -> tuple[MissionResult, LoadedScenario]:
        """Run a mission of the campaign again, with its record; return its result and scenario.

        Raises:
            InputError: the campaign has no such run or point.
            MissionError: the manager raised.
        """
        check_range("run", run, 1, self.campaign.spec.runs)
        check_range("point", point, 0, self._variation.sweep.points - 1)
        simulator = self._simulator(point, self._variation.member(run))
        return simulator.run(manager, run, self.campaign.spec.seed, record=True), simulator.loaded

    def each(
        self, missions: Iterable[MissionKey], *, until_stuck: bool = False
    ) -> Iterator[Finished]:
        """Yield the outcome of each mission, in order.

        Args:
            missions: their keys.
            until_stuck: whether a mission after which the reasoner does not come back is the last.

        Raises:
            InputError: the scenario, a manager or the knowledge base cannot be used at all.
        """
        with alarms_heard():
            for key in missions:
                if key.manager not in self._in_time and self._too_long[key.manager] >= _IN_VAIN:
                    continue
                outcome, remarks = self._outcome(key)
                yield key, outcome
                for remark in chain(self._remarks(key, outcome), remarks):
                    yield key, remark
                if until_stuck and reasoner_is_stuck():
                    return

    def _remarks(self, key: MissionKey, outcome: Row | MissionFailure) -> Iterator[Remark]:
        """Yield what the outcome of a mission says about its manager, among those before it."""
        manager = self.campaign.spec.managers[key.manager]
        if not isinstance(outcome, MissionFailure):
            self._in_time.add(key.manager)
            if not is_built_in(manager) and self._differs(key, outcome):
                yield Remark(manager, NOT_REPEATABLE)
        elif outcome.lasting:
            self._in_time.add(key.manager)
        elif key.manager not in self._in_time:
            self._too_long[key.manager] += 1
            if self._too_long[key.manager] == _IN_VAIN:
                yield Remark(manager, GIVEN_UP)

    def _differs(self, key: MissionKey, outcome: Row | MissionFailure) -> bool:
        """Whether a manager's first mission in this process gives another outcome when it is run
        again.
        """
        first, before = self._first.setdefault(key.manager, (key, outcome))
        self._number[key.manager] += 1
        if self._number[key.manager] not in _REPEATED_AFTER:
            return False
        again, _ = self._outcome(first)
        return again != before and not (isinstance(again, MissionFailure) and not again.lasting)

    def _outcome(self, key: MissionKey) -> tuple[Row | MissionFailure, list[Remark]]:
        """Run a mission; return its outcome, and what its manager's author should know."""
        spec = self.campaign.spec
        manager = self.campaign.spec.managers[key.manager]
        member = self._variation.member(key.run)
        simulator = self._simulator(key.point, member)
        began_s = time.process_time()
        try:
            with _time_limit(spec.time_out_s):
                result = self._fly(simulator, manager, key.run, spec.seed, spec.record_knowledge)
        except MissionError as error:
            lasting = not may_pass(error)
            return MissionFailure(
                error.manager, error.run, error.time_s, error.cause, lasting, key.point
            ), []
        except PassingError as error:  # before the mission has begun
            return self.campaign.failed(key, str(error))[1], []
        except MissionTimeOut as error:
            cause = self.campaign.too_long
            if place := place_of(error):
                cause += f", in {place}"
            used_s = time.process_time() - began_s
            if is_built_in(manager) and used_s < _LEAST_SHARE * spec.time_out_s:
                cause += "; the machine was busy with other work"
            return self.campaign.failed(key, cause, error.time_s)[1], []
        return self._row(key, member, result), [Remark(manager, text) for text in result.remarks]

    def _row(self, key: MissionKey, member: int | None, result: MissionResult) -> Row:
        """Make the row of a mission: of runs.csv, and its knowledge states if they are recorded."""
        spec = self.campaign.spec
        variation = self._variation
        values = self._values(key.point)
        row = (
            *row_of(result.metrics),
            *map(cell_of, values.values()),
            *(result.drawn[path] for path in variation.drawn),
            *(() if member is None else (member,)),
            *further_of(result),
        )
        if not spec.record_knowledge:
            return row
        if not result.knowledge:
            return (*row, "")
        manager = spec.managers[key.manager]
        swept = {variation.paths[name]: value for name, value in values.items()}
        return (*row, mission_line(manager, key.point, key.run, result.knowledge, swept))

    def _simulator_of(self, point: int, member: int | None) -> Simulator:
        """Make the simulator of a point and of a member of the ensemble."""
        # with it comes the compiler, which takes a while
        from suave_des.simulation.simulator import (
            Simulator,
        )

        variation = self._variation
        loaded = variation.scenario(self.campaign.loaded, point, member)
        return Simulator(loaded, dict.fromkeys(variation.drawn, variation.runs_per_draw))


# Time limits, so that a manager that never returns costs its own mission only.


_left: list[int] = []
"""How many more ticks the mission under way has in the main thread; empty outside of missions."""


@contextmanager
def alarms_heard() -> Iterator[None]:
    """Have the alarms of missions heard in the block: to do so for each mission anew takes a tenth
    of the time of the shortest ones.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    with handled([signal.SIGALRM], _tick):
        yield


def _tick(number: int, frame: FrameType | None) -> None:
    if not _left:
        return  # of an alarm that comes too late
    _left[0] -= 1
    if _left[0] <= 0:
        signal.setitimer(signal.ITIMER_REAL, _REPEAT_S, _REPEAT_S)
        raise MissionTimeOut


@contextmanager
def _time_limit(seconds: float) -> Iterator[None]:
    """Raise MissionTimeOut in the block, in which alarms are heard, when it takes longer, and again
    while it swallows that.

    The alarm signal reaches the main thread in whatever it waits for; other threads when they
    return to Python. Alarms that come while the process is stopped are one when it continues.
    """
    tick_s = seconds / _TICKS
    if threading.current_thread() is threading.main_thread():
        _left.append(_TICKS)
        try:
            with alarm(tick_s, tick_s):
                yield
        finally:
            _left.clear()
        return
    thread = ctypes.c_ulong(threading.get_ident())
    over = threading.Event()

    def watch() -> None:
        if any(over.wait(tick_s) for _ in range(_TICKS)):
            return
        is_over = False
        while not is_over:
            ctypes.pythonapi.PyThreadState_SetAsyncExc(thread, ctypes.py_object(MissionTimeOut))
            is_over = over.wait(_REPEAT_S)

    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    try:
        yield
    finally:
        over.set()
        watcher.join()
        ctypes.pythonapi.PyThreadState_SetAsyncExc(thread, None)  # of one that comes too late
