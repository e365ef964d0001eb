"""A campaign that is told to stop, by Ctrl-C or by kill, keeps what is done and leaves no empty folder."""

from __future__ import annotations

import _thread
import csv
import fcntl
import os
import signal
import time
from multiprocessing.context import SpawnProcess
from multiprocessing.process import BaseProcess
from pathlib import Path

import pytest

from benchmarks import chaos
from suave_des.campaign.campaign import resume_campaign, run_campaign
from suave_des.campaign.executors.local import LocalWorkers
from suave_des.campaign.store import LOCK_FILE, NEW_STORE_FILE, STORE_FILE, Store, make_store

STATUS = {signal.SIGINT: 130, signal.SIGTERM: 143}
RUNS = 100_000
"""More than are done before a signal comes, also from a test that a busy machine held up for seconds."""
FILES = [STORE_FILE, "manifest.json", "runs.csv", "summary.csv"]


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    path = tmp_path / "short.yaml"
    path.write_text(chaos.SHORT)
    return path


def wait_for(path: Path, size: int = 0) -> None:
    until = time.monotonic() + 60.0
    while not (path.exists() and path.stat().st_size >= size):
        assert time.monotonic() < until
        time.sleep(0.002)


@pytest.mark.usefixtures("quick_campaigns")
@pytest.mark.parametrize(("number", "workers"), [*zip(STATUS, (1, 2), strict=True)])
def test_what_is_done_is_kept(number: signal.Signals, workers: int, scenario: Path, tmp_path: Path) -> None:
    asked = [str(scenario), "--managers", "none", "--runs", str(RUNS), "--workers", str(workers), "--out", "out"]
    process = chaos.start(asked, tmp_path)
    wait_for(tmp_path / "out" / f"{STORE_FILE}-wal", 50_000)
    children = chaos.workers_of(process)
    process.send_signal(number)
    status, err = chaos.ended(process)
    assert status == STATUS[number], err
    assert err.startswith("suave-des: interrupted; ")
    assert err.endswith(
        f" of {RUNS} missions are done, and kept in out; suave-des campaign --resume out runs the rest\n"
    )
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == FILES
    with (tmp_path / "out" / "runs.csv").open(newline="") as file:
        assert 0 < len(list(csv.DictReader(file))) < RUNS
    assert len(children) == (0 if workers == 1 else 2)
    assert not any(Path(f"/proc/{child}").exists() for child in children)


@pytest.mark.usefixtures("quick_campaigns")
@pytest.mark.parametrize(
    ("number", "moment"),
    [(signal.SIGINT, "lock"), (signal.SIGTERM, "store"), (signal.SIGINT, "later"), (signal.SIGTERM, "later")],
)
def test_no_empty_folder_is_left(number: signal.Signals, moment: str, scenario: Path, tmp_path: Path) -> None:
    process = chaos.start([str(scenario), "--managers", "none", "--runs", str(RUNS), "--out", "out"], tmp_path)
    wait_for(tmp_path / "out" / (".campaign.lock" if moment == "lock" else STORE_FILE))
    if moment == "later":
        time.sleep(0.3)
    process.send_signal(number)
    status, err = chaos.ended(process)
    assert status == STATUS[number], err
    if (tmp_path / "out").exists():
        assert "--resume out runs the rest" in err, list((tmp_path / "out").iterdir())
        assert sorted(path.name for path in (tmp_path / "out").iterdir()) == FILES
    else:
        assert err == "suave-des: interrupted\n"


@pytest.mark.usefixtures("quick_campaigns")
def test_workers_leave_ctrl_c_to_the_campaign(scenario: Path, tmp_path: Path) -> None:
    """A terminal sends it to all processes of a command; each would say so in many lines."""
    process = chaos.start(
        [str(scenario), "--managers", "none", "--runs", "500", "--workers", "2", "--out", "out"], tmp_path
    )
    wait_for(tmp_path / "out" / f"{STORE_FILE}-wal", 50_000)
    for child in chaos.workers_of(process):
        os.kill(child, signal.SIGINT)
    assert chaos.ended(process) == (0, "")


def test_workers_that_are_interrupted_while_they_start_end_with_the_pool(monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[BaseProcess] = []
    real = SpawnProcess.start

    def start(process: SpawnProcess) -> None:
        started.append(process)
        real(process)
        # As one that the system gives to another thread: it does not matter what this one blocks.
        _thread.interrupt_main()
        time.sleep(0.0)

    monkeypatch.setattr(SpawnProcess, "start", start)
    with pytest.raises(KeyboardInterrupt), LocalWorkers(["none"], 2):
        pass
    assert started
    assert [process.exitcode for process in started] == [-signal.SIGKILL] * len(started)


def ctrl_c(*_: object) -> None:
    raise KeyboardInterrupt


class TestInterruptedAtAnAwkwardMoment:
    @pytest.mark.parametrize(
        "moment",
        [
            "suave_des.campaign.store.FileLock.acquire",
            "suave_des.campaign.campaign.make_store",
            "suave_des.campaign.store.remove_store",
            "suave_des.campaign.campaign.Store.__init__",
            "suave_des.campaign.executors.local.InProcess.outcomes",
        ],
    )
    def test_before_the_first_mission_nothing_is_left(
        self, moment: str, scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(moment, ctrl_c)
        with pytest.raises(KeyboardInterrupt):
            run_campaign(scenario, ["none"], 2, 1, out=tmp_path / "out")
        assert not (tmp_path / "out").exists()

    @pytest.mark.parametrize("call", ["os.open", "fcntl.flock", "os.fstat"])
    def test_while_the_folder_is_locked_nothing_is_left(
        self, call: str, scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        module, name = (os, call[3:]) if call.startswith("os.") else (fcntl, call[6:])
        real = getattr(module, name)

        def done_and_interrupted(*arguments: object) -> object:
            result = real(*arguments)
            if (tmp_path / "out" / LOCK_FILE).exists():
                monkeypatch.setattr(module, name, real)
                raise KeyboardInterrupt
            return result

        monkeypatch.setattr(module, name, done_and_interrupted)
        with pytest.raises(KeyboardInterrupt):
            run_campaign(scenario, ["none"], 2, 1, out=tmp_path / "out")
        assert not (tmp_path / "out").exists()

    def test_before_an_earlier_campaign_is_replaced_its_missions_stay(
        self, scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        out = tmp_path / "out"
        run_campaign(scenario, ["none"], 2, 1, out=out)
        before = {path.name: path.read_bytes() for path in out.iterdir()}
        monkeypatch.setattr("suave_des.campaign.store.remove_store", ctrl_c)
        with pytest.raises(KeyboardInterrupt):
            run_campaign(scenario, ["none"], 3, 1, out=out, overwrite=True)
        monkeypatch.undo()
        resume_campaign(out)  # the results went first, so that none stand beside another campaign's missions
        assert {path.name: path.read_bytes() for path in out.iterdir() if path.suffix == ".csv"} == {
            name: content for name, content in before.items() if name.endswith(".csv")
        }
        assert not (out / NEW_STORE_FILE).exists()

    def test_between_two_transactions_what_comes_next_is_kept(self, tmp_path: Path) -> None:
        path = tmp_path / STORE_FILE
        make_store(path, {})
        store = Store(path)
        store._db.execute("COMMIT")  # as commit() does, and is interrupted before it begins the next
        store.note("remarks", ["mine"])
        store.close()
        store = Store(path)
        assert store.about("remarks") == ["mine"]
        store.close()

    def test_while_files_are_written_it_says_how_to_have_them(
        self, scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        out = tmp_path / "out"
        with monkeypatch.context() as patch:
            patch.setattr("suave_des.campaign.campaign.write_results", ctrl_c)
            with pytest.raises(KeyboardInterrupt, match=r"nothing is lost: suave-des campaign --resume .* writes"):
                run_campaign(scenario, ["none"], 2, 1, out=out)
        assert resume_campaign(out).done == 2
        assert sorted(path.name for path in out.iterdir()) == FILES
