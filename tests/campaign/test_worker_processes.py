"""How worker processes start, without the script that asked for them, and how they end."""

import sys
from pathlib import Path

import pytest

from benchmarks import chaos
from suave_des import run_campaign
from suave_des.campaign.spec import CampaignSpec
from tests.helpers.command import python, wait_until

SCRIPT = """
import sys
from suave_des import run_campaign
from suave_des.managing.simple import RandomManager
class Mine(RandomManager):
    pass
print(run_campaign(sys.argv[1], ["__main__:Mine", "none"], runs=12, seed=1, workers=2).to_csv(index=False))
print("numba" in sys.modules)
"""


def without_workers(scenario: Path, managers: list[str]) -> str:
    """What the script prints of managers that do as these do."""
    return run_campaign(str(scenario), managers, runs=12, seed=1, progress=False).to_csv(
        index=False
    )


def test_a_script_that_defines_a_manager_needs_no_guard_nor_loads_the_compiler(scenario, tmp_path):
    (tmp_path / "script.py").write_text(SCRIPT)
    done = python("script.py", scenario, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    expected = without_workers(scenario, ["random", "none"]).replace(",random,", ",__main__:Mine,")
    assert done.stdout == expected + "\nFalse\n"
    assert "numba" in sys.modules  # as the missions of this process need it


def test_workers_end_with_the_process_that_started_them(tmp_path):
    """However that comes: a worker that nobody asks for anything would wait for ever."""
    process = chaos.start([*ASKED, "--runs", "100000", "--workers", "2", "--out", "out"], tmp_path)
    wait_until(lambda: len(chaos.workers_of(process)) == 2)
    workers = chaos.workers_of(process)
    process.kill()
    process.communicate()
    wait_until(lambda: not any(Path(f"/proc/{worker}").exists() for worker in workers))


ASKED = ("seams2023", "--managers", "none")


WRITER = """
import os
from suave_des.managing.simple import NoManager
FILE = open(f"written_{os.getpid()}.txt", "w")
class Writer(NoManager):
    def __init__(self, system):
        super().__init__(system)
        print("a mission", file=FILE)
"""


def test_what_a_manager_has_written_is_there_when_workers_have_ended(
    scenario, tmp_path, monkeypatch
):
    (tmp_path / "writer.py").write_text(WRITER)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path)
    assert (
        len(run_campaign(str(scenario), ["writer:Writer"], runs=12, workers=2, progress=False))
        == 12
    )
    written = [path.read_text().count("a mission") for path in tmp_path.glob("written_*.txt")]
    assert sum(written) >= 12  # some are repeated


CUT = """
import multiprocessing
import os
import signal
from multiprocessing.connection import Connection
from pathlib import Path
from suave_des.managing.simple import NoManager
send = Connection._send
def send_half(connection, data):
    try:
        Path("cut.txt").touch(exist_ok=False)
    except FileExistsError:
        return send(connection, data)
    os.write(connection.fileno(), bytes(data)[: len(data) // 2])
    os.kill(os.getpid(), signal.SIGKILL)
class Cut(NoManager):
    def __init__(self, system):
        super().__init__(system)
        if multiprocessing.parent_process() is not None:
            Connection._send = send_half
"""


@pytest.mark.usefixtures("quick_workers")
def test_a_worker_that_dies_in_the_middle_of_a_result_costs_nothing(
    scenario, tmp_path, monkeypatch, capfd
):
    (tmp_path / "cut.py").write_text(CUT)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path)
    shared = run_campaign(str(scenario), ["cut:Cut"], runs=12, seed=1, workers=2, progress=False)
    assert (tmp_path / "cut.txt").exists()
    assert shared.to_csv(index=False) == without_workers(scenario, ["none"]).replace(
        ",none,", ",cut:Cut,"
    )
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    ("processes", "options"),
    [
        (1, {"runs": 333}),
        (2, {"runs": 334}),
        (2, {"runs": 1, "managers": ["none", "own:Manager"]}),  # which may end or block its process
        (2, {"runs": 1, "sweep": {"mission.time_limit_s": "300:400:50"}}),
        (3, {"runs": 1, "workers": 4}),
        (4, {"runs": 100, "workers": 4}),
    ],
)
def test_few_missions_of_built_in_managers_start_no_workers_unless_asked_for(processes, options):
    assert (
        CampaignSpec.of("seams2023", **{"managers": ["none", "random", "bt"], **options}).processes
        == processes
    )
