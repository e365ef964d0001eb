"""Campaigns on a Dask cluster: the same bytes, all by value, whatever happens to workers and
scheduler.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import chdir
from pathlib import Path

import pytest

import suave_des
from benchmarks import chaos
from suave_des.campaign.campaign import CampaignInterrupted, Progress, resume_campaign, run_campaign
from suave_des.campaign.missions import WorkerError
from suave_des.errors import InputError
from suave_des.interfaces import cluster as dask_cluster
from suave_des.records.store import STORE_FILE
from suave_des.resources import shipped_folder
from tests.helpers import AWKWARD
from tests.helpers.command import has_size, wait_until

_TELLS_WHAT_IT_OPENS = """
import os, sys

def tell(event, arguments):
    if event == "open" and str(arguments[0]).startswith(os.environ["FORBIDDEN"]):
        with open(os.environ["OPENED"], "a") as file:
            file.write(f"{arguments[0]}\\n")

sys.addaudithook(tell)
"""

# Dask looks at its own work a hundred times a second, which costs each process a twentieth of a
# core when it waits.
_QUIET = {
    "DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED": "False",
    "DASK_DISTRIBUTED__ADMIN__TICK__INTERVAL": "1s",
    "DASK_DISTRIBUTED__ADMIN__SYSTEM_MONITOR__INTERVAL": "10s",
}


class Cluster:
    """A scheduler and workers, each a process.

    Args:
        folder: for their home, caches, scratch files and logs.
        forbidden: a folder whose files workers must not open; `opened` tells those that they did.
        settings: more environment variables.
    """

    def __init__(self, folder: Path, forbidden: Path, **settings: str) -> None:
        self.folder, self._opened = folder, folder / "opened.txt"
        self._processes: list[subprocess.Popen[bytes]] = []
        self.workers: list[subprocess.Popen[bytes]] = []
        hooks = folder / "hooks"
        hooks.mkdir(parents=True)
        (hooks / "sitecustomize.py").write_text(_TELLS_WHAT_IT_OPENS)
        ours = ("SUAVE_DES_", "XDG_", "DASK_", "PYTEST_")
        self._environment = {
            **{name: value for name, value in os.environ.items() if not name.startswith(ours)},
            "HOME": str(folder),
            "PYTHONPATH": os.pathsep.join([str(hooks), str(Path(suave_des.__file__).parents[1])]),
            **_QUIET,
            "FORBIDDEN": str(forbidden),
            "OPENED": str(self._opened),
            **settings,
        }
        with socket.socket() as found:
            found.bind(("127.0.0.1", 0))
            port = found.getsockname()[1]
        self.address = f"tcp://127.0.0.1:{port}"
        self.scheduler = self._start("dask_scheduler", "--host", "127.0.0.1", "--port", str(port))

    def add_worker(self, threads: int = 1, *, replaced: bool = False) -> subprocess.Popen[bytes]:
        """Start a worker, which is replaced when it ends, if so wanted."""
        scratch = ("--local-directory", str(self.folder / "scratch"))
        worker = self._start(
            "dask_worker",
            self.address,
            "--nanny" if replaced else "--no-nanny",
            "--nthreads",
            str(threads),
            *scratch,
        )
        self.workers.append(worker)
        return worker

    def wait_for_workers(self, number: int) -> None:
        """Wait until so many workers have come to the scheduler."""
        wait_until(lambda: self.log("dask_scheduler").count("Register worker") >= number)

    def opened(self) -> list[str]:
        """Forbidden files that workers opened."""
        return self._opened.read_text().splitlines() if self._opened.exists() else []

    def log(self, command: str) -> str:
        """What the scheduler or the workers said."""
        return "".join(path.read_text() for path in sorted(self.folder.glob(f"{command}_*.log")))

    def stop(self) -> None:
        """End all processes."""
        for process in self._processes:
            process.kill()
            process.wait()

    def _start(self, command: str, *arguments: str) -> subprocess.Popen[bytes]:
        with (self.folder / f"{command}_{len(self._processes)}.log").open("wb") as log:
            process = subprocess.Popen(
                [sys.executable, "-m", f"distributed.cli.{command}", *arguments, "--no-dashboard"],
                cwd=self.folder,
                env=self._environment,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
            )
        self._processes.append(process)
        return process


MINE = "my_managers.careful:Careful"


@pytest.fixture(scope="module")
def users_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A user's own scenario, ontology, rules, table, modes and manager, which is made of several
    modules.
    """
    folder = tmp_path_factory.mktemp("user")
    for name in ("suave.owl", "tomasys.owl"):
        shutil.copy(shipped_folder("ontology") / name, folder)
    shutil.copy(shipped_folder("scenarios") / "suave_modes.yaml", folder / "own_modes.yaml")
    (folder / "sea.csv").write_text("t_s,value\n0,3.0\n40,1.2\n90,2.6\n400,1.5\n")
    (folder / "own.swrl").write_text(RULES)
    (folder / "own.yaml").write_text(
        "base: seams2023.yaml\n"
        "mission: {time_limit_s: 120}\n"
        "modes_file: own_modes.yaml\n"
        "knowledge: {ontologies: [suave.owl], rules: [own.swrl]}\n"
        "signals: {water_visibility: {kind: table, file: sea.csv}}\n"
    )
    package = folder / "my_managers"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "habits.py").write_text("PERIOD_S = 4.0\n")
    (package / "careful.py").write_text(
        "from suave_des.managing.metacontrol import Metacontrol\n"
        "class Careful(Metacontrol):\n"
        "    def __init__(self, system):\n"
        "        super().__init__(system)\n"
        "        from my_managers import habits\n"
        "        self.period_s = habits.PERIOD_S\n"
    )
    return folder


RULES = """\
spare: hasQAvalue(?fg, ?q) ^ isQAtype(?q, water_visibility) ^ hasValue(?q, ?v) ^ lessThan(?v, 3.5)
       -> fd_realisability(fd_spiral_high, false)
"""


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory, users_folder: Path) -> Iterator[Cluster]:
    cluster = Cluster(tmp_path_factory.mktemp("cluster"), users_folder)
    try:
        cluster.add_worker()
        cluster.add_worker(threads=2)
        cluster.wait_for_workers(2)
        yield cluster
    finally:
        cluster.stop()


@pytest.fixture(scope="module")
def _small_clusters() -> Iterator[list[Cluster]]:
    clusters: list[Cluster] = []
    yield clusters
    for cluster in clusters:
        cluster.stop()


@pytest.fixture
def small_cluster(
    _small_clusters: list[Cluster], tmp_path_factory: pytest.TempPathFactory
) -> Cluster:
    """A cluster of one worker, where missions are not given to another when it dies; another if a
    test ended it.
    """
    if not _small_clusters or _small_clusters[-1].scheduler.poll() is not None:
        folder = tmp_path_factory.mktemp("small")
        settings = {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0"}
        _small_clusters.append(
            cluster := Cluster(folder / "cluster", folder / "nothing", **settings)
        )
        cluster.add_worker(replaced=True)
        cluster.wait_for_workers(1)
    return _small_clusters[-1]


@pytest.fixture(scope="module")
def flown_with_a_death(
    cluster: Cluster, users_folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, int]:
    """Folder of a campaign, of which a worker died and another came, and how many missions were
    done by then.
    """
    out, seen = tmp_path_factory.mktemp("there") / "out", []

    def kill_one(progress: Progress) -> None:
        if not seen:
            cluster.workers.pop(0).kill()
            cluster.add_worker()
        seen.append(progress.done)

    with chdir(users_folder):
        run_campaign(*OWN, out=out, scheduler=cluster.address, on_progress=kill_one)
    return out, seen[0]


OWN = ("own.yaml", ["metacontrol", MINE], 60, 1)


def test_a_worker_that_dies_changes_no_byte(
    flown_with_a_death, users_folder, tmp_path, monkeypatch
):
    there, done = flown_with_a_death
    assert done < 60  # or it died too late to matter
    monkeypatch.chdir(users_folder)
    run_campaign(*OWN, out=tmp_path / "here")
    for name in ("runs.csv", "summary.csv", "manifest.json"):
        assert (there / name).read_bytes() == (tmp_path / "here" / name).read_bytes()


@pytest.mark.usefixtures("flown_with_a_death")
def test_workers_open_none_of_the_user_s_files(cluster):
    assert cluster.opened() == []


def test_managers_that_end_or_block_their_worker_cost_their_own_missions_only(small_cluster):
    causes = {
        "DiesInSome": "the cluster's worker died while running it, 1 times (killed, out of memory, or stuck?)",
        "HangsInSome": "not done after 3 s (time-out), in adapt (awkward_managers.py",
        "RaisesInHalf": "ValueError: I do not know what to do (awkward_managers.py, line 34)",
    }
    managers = [f"{AWKWARD}:{name}" for name in causes]
    result = run_campaign(
        "seams2023", managers, 8, 1, scheduler=small_cluster.address, time_out_s=3.0
    )
    found = {failure.manager.partition(":")[2]: failure.cause for failure in result.failures}
    # whichever line of its loop
    found["HangsInSome"] = found["HangsInSome"].rpartition(", line ")[0]
    assert found == causes
    assert len(result.rows) + len(result.failures) == 24
    idle = {row[2]: row[3:] for row in run_campaign("seams2023", ["none"], 8, 1).rows}
    assert all(row[3:] == idle[row[2]] for row in result.rows)


def test_ctrl_c_on_the_command_line(cluster, scenario, tmp_path):
    asked = [
        "short.yaml",
        "--managers",
        "none",
        "--runs",
        "100000",
        "--scheduler",
        cluster.address,
        "--out",
        "out",
    ]
    process = chaos.start(asked, tmp_path)
    journal = tmp_path / "out" / f"{STORE_FILE}-wal"
    wait_until(lambda: has_size(journal, 200_000))
    process.send_signal(signal.SIGINT)
    status, err = chaos.ended(process)
    assert status == 130
    assert err.startswith("suave-des: interrupted; ")
    assert err.endswith("suave-des campaign --resume out runs the rest\n")
    assert err.count("\n") == 1
    # workers are free for it
    assert run_campaign("seams2023", ["none"], 2, 1, scheduler=cluster.address).done == 2


def test_what_was_begun_there_may_be_finished_here(cluster, scenario, tmp_path):
    def stop(progress: Progress) -> None:
        raise KeyboardInterrupt

    asked = (scenario, ["none", "random"], 50, 1)
    varied = {
        "sweep": {"visibility.period_s": [40, 80]},
        "perturbations": {"start.y_m": {"distribution": "normal", "mean": 0.0, "std": 1.0}},
    }
    with pytest.raises(CampaignInterrupted, match=r"suave-des campaign --resume .* runs the rest"):
        run_campaign(
            *asked, out=tmp_path / "out", scheduler=cluster.address, on_progress=stop, **varied
        )
    resume_campaign(tmp_path / "out")
    run_campaign(*asked, out=tmp_path / "whole", **varied)
    assert (tmp_path / "out" / "runs.csv").read_bytes() == (
        tmp_path / "whole" / "runs.csv"
    ).read_bytes()


@pytest.fixture
def another_numpy(monkeypatch):
    here = {**dask_cluster.code_versions(), "numpy": "1.0"}
    monkeypatch.setattr(dask_cluster, "code_versions", lambda: here)


@pytest.mark.usefixtures("another_numpy")
def test_another_version_on_a_worker_is_named(cluster):
    words = r"numpy is [\d.]+ on worker tcp://\S+, and 1.0 here, which could change"
    with pytest.raises(InputError, match=words):
        run_campaign("seams2023", ["none"], 1, 1, scheduler=cluster.address)


@pytest.mark.usefixtures("another_numpy")
def test_where_a_worker_has_another_version_nothing_is_written(cluster, tmp_path):
    with pytest.raises(InputError):
        run_campaign("seams2023", ["none"], 1, 1, out=tmp_path / "out", scheduler=cluster.address)
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_a_scheduler_that_is_lost_in_the_middle(small_cluster, scenario, tmp_path, capfd):
    stopped_s = []

    def kill_scheduler(progress: Progress) -> None:
        if not stopped_s:
            small_cluster.scheduler.kill()
            small_cluster.scheduler.wait()
            stopped_s.append(time.monotonic())

    asked = (scenario, ["none", "random"], 200, 1)
    with pytest.raises(WorkerError) as lost:
        run_campaign(
            *asked,
            out=tmp_path / "out",
            scheduler=small_cluster.address,
            on_progress=kill_scheduler,
        )
    assert time.monotonic() < stopped_s[0] + 20.0  # Dask itself would go on for longer
    lost_it = rf"the connection to the scheduler {small_cluster.address} is lost"
    line = rf"{lost_it}; \d+ of 400 missions are done, and kept in \S+; "
    assert re.fullmatch(rf"{line}suave-des campaign --resume \S+ runs the rest", str(lost.value))
    assert capfd.readouterr().err == ""
    resume_campaign(tmp_path / "out")
    run_campaign(*asked, out=tmp_path / "whole")
    assert (tmp_path / "out" / "runs.csv").read_bytes() == (
        tmp_path / "whole" / "runs.csv"
    ).read_bytes()


class TestBadInput:
    @pytest.mark.parametrize("address", ["foo", "http://here:8786"])
    def test_what_is_no_address(self, address, tmp_path):
        with pytest.raises(InputError, match=r"does not answer as a Dask scheduler: "):
            run_campaign("seams2023", ["none"], 1, 1, out=tmp_path / "out", scheduler=address)
        assert not (tmp_path / "out").exists()

    def test_a_scheduler_that_does_not_answer(self, tmp_path, monkeypatch, capfd):
        monkeypatch.setattr(dask_cluster, "ANSWER_TIMEOUT_S", 1.0)
        run_campaign("seams2023", ["none"], 1, 1, out=tmp_path / "earlier")
        before = (tmp_path / "earlier" / "runs.csv").read_bytes()
        with socket.socket() as silent:
            silent.bind(("127.0.0.1", 0))
            address = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
            for folder in ("out", "earlier"):
                with pytest.raises(
                    InputError, match=rf"{address} does not answer as a Dask scheduler"
                ):
                    run_campaign(
                        "seams2023",
                        ["none"],
                        1,
                        1,
                        out=tmp_path / folder,
                        scheduler=address,
                        overwrite=True,
                    )
        assert not (tmp_path / "out").exists()
        assert (tmp_path / "earlier" / "runs.csv").read_bytes() == before
        assert resume_campaign(tmp_path / "earlier").done == 1
        assert capfd.readouterr().err == ""

    def test_a_worker_s_address(self, cluster):
        worker = re.findall(r"worker at: *(tcp://[0-9.:]+)", cluster.log("dask_worker"))[-1]
        with pytest.raises(InputError, match=rf"{worker} does not answer as a Dask scheduler"):
            run_campaign("seams2023", ["none"], 1, 1, scheduler=worker)

    def test_dask_is_not_installed(self, monkeypatch):
        monkeypatch.delitem(sys.modules, dask_cluster.__name__)
        monkeypatch.setitem(sys.modules, "distributed", None)
        with pytest.raises(InputError, match=r"\(pip install 'suave-des\[dask\]'\)"):
            run_campaign("seams2023", ["none"], 1, 1, scheduler="tcp://127.0.0.1:8786")
