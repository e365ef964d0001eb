"""What a campaign does when something goes wrong: what is kept and told; and what is seen of it
while it runs.
"""

import errno
import functools
import io
import json
import math
import os
import re
import sys
from collections.abc import Iterator
from contextlib import redirect_stderr
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import IO, Any

import pytest

from suave_des.campaign import progress as display
from suave_des.campaign import workers
from suave_des.campaign.campaign import resume_campaign, run_campaign
from suave_des.campaign.missions import GIVEN_UP, WorkerError
from suave_des.campaign.progress import Progress
from suave_des.campaign.results import CampaignResult
from suave_des.campaign.workers import LocalWorkers
from suave_des.draws import Streams
from suave_des.errors import InputError
from suave_des.files import write_files
from suave_des.knowledge import pellet
from suave_des.records.store import MissionKey
from suave_des.simulation.simulator import Simulator
from tests.helpers import AWKWARD, rows_of
from tests.helpers.command import stopped_for, wait_until

pytestmark = pytest.mark.usefixtures("quick_workers")
RUNS = 12


@pytest.mark.parametrize("workers", [1, 2])
def test_a_manager_that_raises_costs_its_own_mission_only(workers, tmp_path):
    manager = f"{AWKWARD}:RaisesInHalf"
    result = run_campaign("seams2023", [manager, "none"], RUNS, 1, workers, tmp_path / "out")
    failed = [failure.run for failure in result.failures]
    assert 0 < len(failed) < RUNS
    assert failed == sorted(failed)
    for failure in result.failures:
        place = f"manager {manager}, run {failure.run}, mission time 50.00 s"
        assert (
            str(failure)
            == f"{place}: ValueError: I do not know what to do (awkward_managers.py, line 34)"
        )
    rows = rows_of(tmp_path / "out")
    assert [int(row["run"]) for row in rows if row["manager"] == manager] == [
        run for run in range(1, RUNS + 1) if run not in failed
    ]
    assert sum(row["manager"] == "none" for row in rows) == RUNS
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert [failure["run"] for failure in manifest["failures"]] == failed
    assert manifest["missions"]["failed"] == len(failed)


@pytest.fixture(scope="module")
def all_failed(tmp_path_factory: pytest.TempPathFactory) -> tuple[CampaignResult, Path]:
    """A campaign whose manager calls sys.exit in its only mission, and its folder."""
    out = tmp_path_factory.mktemp("quits") / "out"
    return run_campaign("seams2023", [f"{AWKWARD}:Quits"], 1, 1, out=out), out


def test_a_manager_that_calls_exit_is_one_that_raises(all_failed):
    result, _ = all_failed
    assert [failure.cause for failure in result.failures] == [
        "SystemExit: no more (awkward_managers.py, line 41)"
    ]


def test_when_all_missions_fail_there_are_no_rows(all_failed):
    _, out = all_failed
    assert rows_of(out) == []


def test_when_all_missions_fail_the_summary_says_so(all_failed):
    _, out = all_failed
    (row,) = rows_of(out / "summary.csv")
    assert (row["manager"], row["n"]) == (f"{AWKWARD}:Quits", "0")


@functools.cache
def with_deaths(folder: Path) -> tuple[CampaignResult, Path]:
    """Fly a campaign of which some missions kill their worker; return its folder, too."""
    out = folder / "deaths"
    return run_campaign("seams2023", ["none", DIES], 12, 1, 2, out), out


DIES = f"{AWKWARD}:DiesInSome"


def test_a_mission_that_kills_three_workers_has_failed(tmp_path_factory):
    result, _ = with_deaths(tmp_path_factory.getbasetemp())
    assert 0 < len(result.failures) < 6
    assert {failure.manager for failure in result.failures} == {DIES}
    for failure in result.failures:
        assert (
            failure.cause
            == "its worker process ended with status -9, 3 times (killed, or out of memory?)"
        )


def test_a_mission_that_kills_workers_may_be_tried_again(tmp_path_factory):
    result, _ = with_deaths(tmp_path_factory.getbasetemp())
    assert not any(failure.lasting for failure in result.failures)


def test_missions_that_kill_workers_cost_no_other_mission(tmp_path_factory):
    result, out = with_deaths(tmp_path_factory.getbasetemp())
    assert result.done + len(result.failures) == 24
    assert [row["run"] for row in rows_of(out) if row["manager"] == "none"] == [
        str(run) for run in range(1, 13)
    ]


def test_when_every_worker_dies_the_campaign_stops_with_one_line(tmp_path):
    with pytest.raises(
        WorkerError, match=r"8 worker processes in a row ended before a mission was done"
    ):
        run_campaign("seams2023", [f"{AWKWARD}:DiesAlways"], 20, 1, 2, tmp_path / "out")


@functools.cache
def with_hangs(workers: int) -> CampaignResult:
    """Fly a campaign of which some missions take too long."""
    managers = [f"{AWKWARD}:HangsInSome", "none"]
    return run_campaign("seams2023", managers, 12, 1, workers, time_out_s=2.0)


@pytest.mark.parametrize("workers", [1, 2])
def test_a_mission_that_takes_too_long_has_failed(workers):
    failures = with_hangs(workers).failures
    assert 0 < len(failures) < 12
    for failure in failures:
        told = f"{AWKWARD}:HangsInSome, run {failure.run}, mission time 50.00 s: not done after 2 s (time-out), in adapt"
        assert re.fullmatch(
            f"manager {re.escape(told)} \\(awkward_managers.py, line \\d+\\)", str(failure)
        )


@pytest.mark.parametrize("workers", [1, 2])
def test_missions_that_take_too_long_cost_no_other_mission(workers):
    result = with_hangs(workers)
    assert result.done == 24 - len(result.failures)


LOOPS = """
from pathlib import Path
from suave_des.managing.simple import NoManager
class Loops(NoManager):
    def diagnostic(self, diagnostic):
        while True:
            pass
class LoopsLater(NoManager):
    def mission_started(self):
        while Path("there").exists():
            pass
    def mission_ended(self, metrics):
        Path("there").touch()
"""


@pytest.mark.parametrize("workers", [1, 2])
def test_a_manager_whose_missions_all_take_too_long_is_given_up(workers, tmp_path, monkeypatch):
    (tmp_path / "loops.py").write_text(LOOPS)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path)
    result = run_campaign(
        "seams2023", ["loops:Loops", "none"], 200, 1, workers, tmp_path / "out", time_out_s=0.5
    )
    assert result.done == 200 and 3 <= len(result.failures) <= 3 * workers
    assert result.remarks == (f"manager loops:Loops: {GIVEN_UP}",)
    for failure in result.failures:
        assert re.fullmatch(
            r"not done after 0.5 s \(time-out\), in diagnostic \(loops.py, line [67]\)",
            failure.cause,
        )
    missions = json.loads((tmp_path / "out" / "manifest.json").read_text())["missions"]
    assert missions["left_out"] == 200 - len(result.failures)
    later = run_campaign("seams2023", ["loops:LoopsLater"], 6, 1, time_out_s=0.3)
    # one could be done: it is tried again
    assert (later.done, len(later.failures), later.remarks) == (
        1,
        5,
        (),
    )


def test_of_the_remarks_resuming_forgets_only_that_a_manager_was_given_up(tmp_path, monkeypatch):
    (tmp_path / "loops.py").write_text(LOOPS)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path)
    Path("there").touch()
    misspells = f"{AWKWARD}:Misspells"
    run_campaign("seams2023", ["loops:LoopsLater", misspells], 4, 1, out="out", time_out_s=0.2)
    Path("there").unlink()
    resumed = resume_campaign("out")
    assert [remark.partition(": ")[0] for remark in resumed.remarks] == [f"manager {misspells}"]


def test_a_mission_that_cannot_be_interrupted_ends_with_its_worker(monkeypatch):
    monkeypatch.setattr(workers, "_MARGIN_S", 1.0)
    result = run_campaign("seams2023", [f"{AWKWARD}:BlocksInSome"], 3, 1, 2, time_out_s=4.0)
    assert [(failure.run, failure.cause) for failure in result.failures] == [
        (2, "not done after 4 s (time-out)")
    ]
    assert result.done == 2


def test_it_does_so_too_when_no_other_mission_ends_after_it_began(monkeypatch):
    # No worker says anything from then on, and none is waited for until its mission comes back.
    monkeypatch.setattr(workers, "_MARGIN_S", 1.0)
    result = run_campaign("seams2023", [f"{AWKWARD}:BlocksInSome"], 2, 201, 2, time_out_s=1.0)
    assert [failure.run for failure in result.failures] == [1, 2]


def test_missions_run_in_as_many_processes_as_asked_for():
    manager = f"{AWKWARD}:TellsItsProcess"
    alone = run_campaign("seams2023", [manager], 2, 1)
    assert {failure.cause.partition(" (")[0] for failure in alone.failures} == {
        f"RuntimeError: process {os.getpid()}"
    }
    shared = run_campaign("seams2023", [manager], 19, 1, 2)
    processes = {re.sub(r"\D", "", failure.cause.partition(" (")[0]) for failure in shared.failures}
    assert str(os.getpid()) not in processes
    assert 1 <= len(processes) <= 2


@pytest.fixture(scope="module")
def overwritten(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a campaign in place of another, in which the user had a file."""
    out = tmp_path_factory.mktemp("overwritten") / "out"
    run_campaign("seams2023", ["none"], 1, 1, out=out, suave_format=True)
    (out / "notes.txt").write_text("mine")
    run_campaign("seams2023", ["none"], 2, 1, out=out, overwrite=True)
    return out


def test_overwriting_replaces_results(overwritten):
    assert len(rows_of(overwritten)) == 2
    assert {path.name for path in overwritten.iterdir()} - {"notes.txt"} == {
        *("campaign.sqlite", "manifest.json", "runs.csv", "summary.csv")
    }


def test_overwriting_leaves_other_files(overwritten):
    assert (overwritten / "notes.txt").read_text() == "mine"


def test_a_disk_that_fills_up_leaves_nothing_half_written(tmp_path, monkeypatch):
    real = Path.open

    def full(path: Path, mode: str = "r", **options: Any) -> IO[Any]:
        file = real(path, mode, **options)
        if "summary.csv" in path.name and "x" in mode:
            file.write(b"0123456789")
            raise OSError(28, "No space left on device")
        return file

    monkeypatch.setattr(Path, "open", full)
    with pytest.raises(InputError, match="No space left on device") as full_disk:
        run_campaign("seams2023", ["none"], 1, 1, out=tmp_path / "out")
    assert "--resume" in full_disk.value.remedy
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["campaign.sqlite"]
    monkeypatch.undo()
    resume_campaign(tmp_path / "out")
    assert len(rows_of(tmp_path / "out")) == 1


class Screen(io.StringIO):
    """Standard error, which may be a terminal."""

    is_terminal = False

    def isatty(self) -> bool:
        return self.is_terminal


@pytest.fixture
def screen(monkeypatch: pytest.MonkeyPatch) -> Screen:
    screen = Screen()
    monkeypatch.setenv("TERM", "xterm")
    return screen


def shown_on(screen: Screen, label: str = "seams2023") -> str:
    """Show a campaign that goes on for a while; return what was written."""
    with redirect_stderr(screen), display.shown(label) as show:
        for done in range(41):
            show(Progress(done, int(done > 6), 80))
    return screen.getvalue()


@pytest.mark.parametrize("width", [40, 120])
def test_on_a_terminal_it_is_one_line_that_fits(
    width: int, screen: Screen, monkeypatch: pytest.MonkeyPatch
) -> None:
    screen.is_terminal = True
    monkeypatch.setenv("COLUMNS", str(width))
    *before, last = shown_on(screen).removesuffix("\n").split("\r")
    assert all(len(line) < width and "\n" not in line for line in (*before, last))
    assert last.startswith("seams2023: 40 of 80")
    assert width < 100 or re.search(r"40 of 80 missions, 1 failed, [\d,]+/s, [\d:]+ left", last)


def test_in_a_notebook_too() -> None:
    of_a_kernel = type("OutStream", (Screen,), {"__module__": "ipykernel.iostream"})
    assert shown_on(of_a_kernel()).startswith("\rseams2023: 40 of 80 missions, 1 failed")


def test_a_file_is_none_though_the_process_can_start_notebooks(
    screen: Screen, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "ipykernel", ModuleType("ipykernel"))
    assert shown_on(screen) == ""


@pytest.mark.parametrize(
    ("kept", "told"),
    [([], r"starting, [\d:]+ \(the first run compiles .*\)"), (["a/b.nbc"], r"starting, [\d:]+")],
)
def test_that_the_first_run_compiles_is_said_where_no_machine_code_is_kept(
    kept: list[str],
    told: str,
    screen: Screen,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in kept:
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setenv("COLUMNS", "120")
    screen.is_terminal = True
    with redirect_stderr(screen), display.shown("seams2023"):
        pass
    assert re.fullmatch(rf"\rseams2023: {told} *\n", screen.getvalue())


class TestLines:
    @pytest.fixture(params=[False, True], ids=["a file", "a dumb terminal"])
    def lines(
        self,
        request: pytest.FixtureRequest,
        screen: Screen,
        monkeypatch: pytest.MonkeyPatch,
    ) -> list[str]:
        """What is written of a long campaign."""
        screen.is_terminal = request.param
        monkeypatch.setenv("TERM", "dumb")
        monkeypatch.setattr(display, "_FIRST_LINE_S", 0.0)
        lines = shown_on(screen, "my\x1b[2Kfile.yaml").splitlines()
        assert len(lines) > 1
        return lines

    def test_begin_with_the_campaign_without_its_control_characters(self, lines: list[str]) -> None:
        assert all(
            line.startswith("suave-des: my?[2Kfile.yaml: ") for line in (lines[0], lines[-1])
        )

    def test_end_with_the_last_state(self, lines: list[str]) -> None:
        assert re.search(r": 40 of 80 missions, 1 failed(,|$)", lines[-1])


STUCK = """
import threading
from pathlib import Path
from suave_des.knowledge.pellet import TimeLimit
from suave_des.managing.simple import NoManager

LIMIT, RELEASED = TimeLimit(0.02), threading.Event()

class Reasons(NoManager):
    def mission_started(self):
        LIMIT.run(self.reason, "reasoning")

    def reason(self):
        pass

class StuckInSome(Reasons):
    def reason(self):
        self.system.stream("awkward").random() < 0.1 and RELEASED.wait()

class StuckOnce(Reasons):
    def reason(self):
        mark = Path("stuck")
        if not mark.exists():
            mark.touch()
            RELEASED.wait(0.5)
"""


@pytest.fixture
def stuck(tmp_path, monkeypatch):
    """A module of managers whose reasoner does not come back."""
    (tmp_path / "stuck_managers.py").write_text(STUCK)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(pellet, "_abandoned", ["so that nothing is registered"])
    yield
    sys.modules.pop("stuck_managers").RELEASED.set()
    wait_until(lambda: not pellet.is_stuck(), 10.0)


@pytest.mark.usefixtures("stuck")
@pytest.mark.parametrize("workers", [1, 2])
def test_a_reasoner_that_does_not_come_back_costs_two_missions_at_most(workers):
    runs = 12
    stuck_in = sum(Streams(1, run).stream("manager/awkward").random() < 0.1 for run in range(1, 13))
    result = run_campaign("seams2023", ["stuck_managers:StuckInSome"], runs, 1, workers)
    assert 0 < stuck_in <= len(result.failures) <= 2 * stuck_in
    assert result.done == runs - len(result.failures)


@pytest.mark.usefixtures("stuck")
def test_a_mission_whose_reasoner_was_late_is_run_again_when_the_campaign_is_resumed(tmp_path):
    first = run_campaign("seams2023", ["stuck_managers:StuckOnce"], 3, 1, out=tmp_path / "out")
    assert [failure.run for failure in first.failures] == [1]
    assert resume_campaign(tmp_path / "out").done == 3


def test_a_reasoner_that_is_late_before_the_mission_begins_costs_that_mission_only(monkeypatch):
    run_mission = Simulator.run

    def late(self: Simulator, manager: str, run: int, *arguments: int, **more: bool):
        if run == 2:
            raise pellet.ReasonerTimeoutError("loading the ontologies: not done after 60 s")
        return run_mission(self, manager, run, *arguments, **more)

    monkeypatch.setattr(Simulator, "run", late)
    result = run_campaign("seams2023", ["none"], 2, 1)
    assert [(each.run, each.lasting) for each in result.failures] == [(2, False)]


def test_a_mission_that_is_stopped_for_longer_than_its_limit_goes_on():
    done = stopped_for(
        2.5,
        """
import time
from suave_des.campaign.missions import _time_limit, alarms_heard

with alarms_heard(), _time_limit(2.0):
    print("begun", flush=True)
    time.sleep(0.1)
""",
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_in_a_thread_that_is_not_the_main_one_too():
    done = stopped_for(
        2.5,
        """
import threading, time
from suave_des.campaign.missions import _time_limit, alarms_heard

def work():
    with alarms_heard(), _time_limit(2.0):
        print("begun", flush=True)
        for _ in range(20):
            time.sleep(0.01)
    print("done")

thread = threading.Thread(target=work)
thread.start()
thread.join()
""",
    )
    assert (done.stdout, done.stderr) == ("done\n", "")


def test_a_worker_has_the_time_limit_of_each_mission_of_its_chunk(monkeypatch):
    monkeypatch.setattr(workers.time, "monotonic", lambda: 1000.0)
    pool = pool_for(10_000)
    worker = idle_worker()
    pool._give_tasks(worker, keys(10_000), time_out_s=20.0)
    assert worker.due_s == 1000.0 + len(worker.tasks[0][0]) * 20.0 + workers._MARGIN_S


def test_chunks_become_smaller_towards_the_end():
    pool, missions = pool_for(500, count=2), keys(500)
    pool._mission_s[0] = 0.0001
    sizes = []
    while not sizes or sizes[-1]:
        sizes.append(len(pool._next_chunk(missions)))
    assert sum(sizes) == 500
    assert sizes == sorted(sizes, reverse=True)
    assert (sizes[0], sizes[-2]) == (500 // (2 * workers._SHARES), 1)


def test_missions_that_are_more_than_was_said_are_given_one_by_one():
    assert len(pool_for(0)._next_chunk(keys(5))) == 1


def test_at_first_a_chunk_has_few_missions():
    assert 8 <= len(pool_for(10_000)._next_chunk(keys(100))) <= 12


def sizes_of_chunks(takes_s: list[float], count: int) -> list[int]:
    """Give chunks one after the other; a mission of manager n takes the n-th time."""
    pool, sizes = pool_for(1_000_000), []
    per_manager = 100_000
    missions = (
        MissionKey(0, manager, run) for manager in range(len(takes_s)) for run in range(per_manager)
    )
    for _ in range(count):
        chunk = pool._next_chunk(missions)
        sizes.append(len(chunk))
        pool._note_time(chunk, sum(takes_s[key.manager] for key in chunk))
    return sizes


@pytest.mark.parametrize(
    ("mission_s", "missions"), [(0.0001, 30), (0.001, 30), (0.0195, 6), (0.3, 1), (5.0, 1)]
)
def test_chunks_come_to_take_their_time(mission_s, missions):
    assert sizes_of_chunks([mission_s], 20)[-1] == missions


def test_missions_of_a_slow_manager_are_few_after_those_of_a_quick_one():
    pool = pool_for(1_000_000)
    for _ in range(20):
        chunk = pool._next_chunk(keys(1000))
        pool._note_time(chunk, 0.001 * len(chunk))
    slow = (MissionKey(0, 1, run) for run in range(1, 1000))
    assert 8 <= len(pool._next_chunk(slow)) <= 12


def test_after_one_that_took_long_chunks_grow_step_by_step():
    pool, missions, sizes = pool_for(1_000_000), keys(1000), []
    pool._note_time(tuple(keys(1)), 12.0)
    for _ in range(20):
        chunk = pool._next_chunk(missions)
        sizes.append(len(chunk))
        pool._note_time(chunk, 0.0)
    assert sizes[:7] == [1] * 7
    assert all(later <= 2 * size + 1 for size, later in pairwise(sizes))
    assert sizes[-1] == workers._LARGEST_CHUNK


def keys(count: int) -> Iterator[MissionKey]:
    return (MissionKey(0, 0, run) for run in range(1, count + 1))


def pool_for(missions: int, count: int = 1) -> LocalWorkers:
    pool = LocalWorkers(["none"], count)
    pool._left = missions
    return pool


def idle_worker() -> workers._Worker:
    return workers._Worker(process=None, connection=Quiet(), due_s=math.inf)  # type: ignore[arg-type]


def test_a_worker_without_tasks_has_all_the_time():
    worker = workers._Worker(process=None, connection=Quiet(), due_s=0.0)  # type: ignore[arg-type]
    LocalWorkers(["none"], 1)._give_tasks(worker, iter([]), time_out_s=20.0)
    assert worker.due_s == math.inf


class Quiet:
    """A connection to nobody."""

    def send(self, message: object) -> None:
        pass


def test_workers_are_given_the_time_in_which_the_campaign_was_stopped(monkeypatch):
    now_s = iter([0.0, 600.0, 600.0])
    monkeypatch.setattr(workers.time, "monotonic", lambda: next(now_s))
    monkeypatch.setattr(workers, "wait", lambda connections, seconds: [])
    worker = workers._Worker(process=None, connection=None, due_s=180.0)  # type: ignore[arg-type]
    assert workers._ready([worker]) == []
    assert (worker.is_overdue, worker.due_s) == (False, 180.0 + 600.0 - workers._LOOK_S)


def test_a_full_disk_is_no_question_of_whose_folder_it_is(tmp_path, monkeypatch):
    def is_full(path: Path, target: Path) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "replace", is_full)
    with pytest.raises(InputError, match="No space left on device") as caught:
        write_files(tmp_path, {"runs.csv": "a"})
    assert caught.value.remedy == "make room there, or give a folder on another disk"
