"""A campaign that is told to stop, by Ctrl-C or by kill, keeps what is done and leaves no empty
folder.
"""

import _thread
import os
import signal
import subprocess
import sys
import time
from multiprocessing.context import SpawnProcess
from multiprocessing.process import BaseProcess
from pathlib import Path

import pytest

import suave_des
from benchmarks import chaos
from suave_des.campaign.campaign import resume_campaign, run_campaign
from suave_des.campaign.workers import LocalWorkers
from suave_des.interrupts import Stopped, signals_raised
from suave_des.records.store import STORE_FILE, Store
from tests.helpers import rows_of
from tests.helpers.command import has_size, wait_until

STATUS = {signal.SIGINT: 130, signal.SIGTERM: 143}
RUNS = 100_000
"""More than are done before a signal comes, also from a test that a busy machine held up for
seconds.
"""
FILES = [STORE_FILE, "manifest.json", "runs.csv", "summary.csv"]


@pytest.mark.usefixtures("quick_campaigns")
@pytest.mark.parametrize(("number", "workers"), [*zip(STATUS, (1, 2), strict=True)])
def test_what_is_done_is_kept(number, workers, scenario, tmp_path):
    asked = [
        str(scenario),
        "--managers",
        "none",
        "--runs",
        str(RUNS),
        "--workers",
        str(workers),
        "--out",
        "out",
    ]
    process = chaos.start(asked, tmp_path)
    wait_until(lambda: has_size(tmp_path / "out" / f"{STORE_FILE}-wal", 100_000))
    children = chaos.workers_of(process)
    process.send_signal(number)
    status, err = chaos.ended(process)
    assert status == STATUS[number], err
    assert err.startswith("suave-des: interrupted; ")
    assert err.endswith(
        f" of {RUNS} missions are done, and kept in out; suave-des campaign --resume out runs the rest\n"
    )
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == FILES
    assert 0 < len(rows_of(tmp_path / "out")) < RUNS
    assert len(children) == (0 if workers == 1 else 2)
    assert not any(Path(f"/proc/{child}").exists() for child in children)


@pytest.mark.usefixtures("quick_campaigns")
@pytest.mark.parametrize(
    ("number", "after_s"),
    [(signal.SIGINT, 0.0), (signal.SIGTERM, 0.0), (signal.SIGINT, 0.3), (signal.SIGTERM, 0.3)],
)
def test_no_empty_folder_is_left(number, after_s, scenario, tmp_path):
    process = chaos.start(
        [str(scenario), "--managers", "none", "--runs", str(RUNS), "--out", "out"], tmp_path
    )
    wait_until((tmp_path / "out" / STORE_FILE).exists)
    time.sleep(after_s)
    process.send_signal(number)
    status, err = chaos.ended(process)
    assert status == STATUS[number], err
    if (tmp_path / "out").exists():
        assert "--resume out runs the rest" in err, list((tmp_path / "out").iterdir())
        assert sorted(path.name for path in (tmp_path / "out").iterdir()) == FILES
    else:
        assert err == "suave-des: interrupted\n"


@pytest.mark.usefixtures("quick_campaigns")
def test_workers_leave_ctrl_c_to_the_campaign(scenario, tmp_path):
    """A terminal sends it to all processes of a command; each would say so in many lines."""
    process = chaos.start(
        [str(scenario), "--managers", "none", "--runs", "4000", "--workers", "2", "--out", "out"],
        tmp_path,
    )
    wait_until(lambda: has_size(tmp_path / "out" / f"{STORE_FILE}-wal", 100_000))
    for child in chaos.workers_of(process):
        os.kill(child, signal.SIGINT)
    assert chaos.ended(process) == (0, "")


@pytest.mark.parametrize(
    "number",
    [
        signal.SIGINT,
        pytest.param(signal.SIGHUP, marks=pytest.mark.slow),
        pytest.param(signal.SIGTERM, marks=pytest.mark.slow),
    ],
)
def test_a_signal_to_all_its_processes_is_told_once(number, scenario, tmp_path):
    """As a terminal sends it that is closed, or a scheduler of jobs."""
    command = [
        sys.executable,
        "-m",
        "suave_des",
        "campaign",
        str(scenario),
        "--managers",
        "none",
        "--quiet",
    ]
    process = subprocess.Popen(
        [*command, "--runs", str(RUNS), "--workers", "2", "--out", "out"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(Path(suave_des.__file__).parents[1])},
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(
            signal.SIGHUP, signal.SIG_DFL
        ),  # under nohup it is ignored
    )
    wait_until(lambda: has_size(tmp_path / "out" / f"{STORE_FILE}-wal", 100_000))
    os.killpg(process.pid, number)
    _, err = process.communicate(timeout=120)
    assert process.returncode == 128 + number
    assert err.startswith("suave-des: interrupted; ") and err.count("\n") == 1
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == FILES


def test_workers_that_are_interrupted_while_they_start_end_with_the_pool(monkeypatch):
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


def ctrl_c(*_: object, **__: object) -> None:
    raise KeyboardInterrupt


class TestInterruptedAtAnAwkwardMoment:
    @pytest.mark.parametrize(
        "moment",
        [
            "suave_des.files.make_output_folder",
            "suave_des.campaign.campaign.Store.__init__",
            "suave_des.campaign.campaign.Store._check",
            "suave_des.campaign.campaign.Store.begin",
            "suave_des.campaign.campaign.in_process",
        ],
    )
    def test_before_the_first_mission_nothing_is_left(
        self, moment, scenario, tmp_path, monkeypatch
    ):
        monkeypatch.setattr(moment, ctrl_c)
        with pytest.raises(KeyboardInterrupt):
            run_campaign(scenario, ["none"], 2, 1, out=tmp_path / "out")
        assert not (tmp_path / "out").exists()

    def test_before_an_earlier_campaign_is_replaced_its_missions_stay(
        self, scenario, tmp_path, monkeypatch
    ):
        out = tmp_path / "out"
        run_campaign(scenario, ["none"], 2, 1, out=out)
        before = {path.name: path.read_bytes() for path in out.iterdir()}
        monkeypatch.setattr("suave_des.records.store._note", ctrl_c)
        with pytest.raises(KeyboardInterrupt):
            run_campaign(scenario, ["none"], 3, 1, out=out, overwrite=True)
        monkeypatch.undo()
        # the results went first, so that none stand beside another campaign's missions
        resume_campaign(out)
        assert {
            path.name: path.read_bytes() for path in out.iterdir() if path.suffix == ".csv"
        } == {name: content for name, content in before.items() if name.endswith(".csv")}

    def test_between_two_transactions_what_comes_next_is_kept(self, tmp_path):
        path = tmp_path / STORE_FILE
        store = Store(path)
        store.begin({})
        # as commit() does, and is interrupted before it begins the next
        store._db.execute("COMMIT")
        store.note("remarks", ["mine"])
        store.close()
        store = Store(path)
        assert store.about("remarks") == ["mine"]
        store.close()

    def test_while_files_are_written_it_says_how_to_have_them(
        self, scenario, tmp_path, monkeypatch
    ):
        out = tmp_path / "out"
        with monkeypatch.context() as patch:
            patch.setattr("suave_des.records.store.write_campaign", ctrl_c)
            with pytest.raises(
                KeyboardInterrupt, match=r"nothing is lost: suave-des campaign --resume .* writes"
            ):
                run_campaign(scenario, ["none"], 2, 1, out=out)
        assert resume_campaign(out).done == 2
        assert sorted(path.name for path in out.iterdir()) == FILES


def test_an_error_that_the_signal_led_to_is_no_damage(scenario, tmp_path, monkeypatch):
    """A module whose import a signal broke off fails with an error of its own."""

    def broken_import(*_: object) -> None:
        with pytest.raises(Stopped):
            signal.raise_signal(signal.SIGTERM)
        raise RecursionError

    monkeypatch.setattr("suave_des.campaign.campaign.gather", broken_import)
    with (
        signals_raised(),
        pytest.raises(KeyboardInterrupt, match=r"nothing is lost: .* --resume .* writes the files"),
    ):
        run_campaign(scenario, ["none"], 2, 1, out=tmp_path / "out")


def test_nor_is_one_that_an_earlier_signal_led_to(tmp_path):
    with signals_raised():
        with pytest.raises(Stopped):
            signal.raise_signal(signal.SIGTERM)
        with pytest.raises(Stopped), Store(tmp_path / STORE_FILE).reading():
            raise AttributeError("module 'numpy' has no attribute 'dtype'")
