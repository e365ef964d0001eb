"""Dask clusters on this machine whose workers share nothing with the tests but the installed packages."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import suave_des

_TELLS_WHAT_IT_OPENS = """
import os, sys

def tell(event, arguments):
    if event == "open" and str(arguments[0]).startswith(os.environ["FORBIDDEN"]):
        with open(os.environ["OPENED"], "a") as file:
            file.write(f"{arguments[0]}\\n")

sys.addaudithook(tell)
"""

# Dask looks at its own work a hundred times a second, which costs each process a twentieth of a core when it waits.
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
        own = {
            name: value
            for name, value in os.environ.items()
            if not name.startswith(("SUAVE_DES_", "XDG_", "DASK_", "PYTEST_"))
        }
        self._environment = {
            **own,
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
            "dask_worker", self.address, "--nanny" if replaced else "--no-nanny", "--nthreads", str(threads), *scratch
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


def kill(process: subprocess.Popen[bytes]) -> None:
    """End a process as the system does when memory is short."""
    process.send_signal(signal.SIGKILL)
    process.wait()


def wait_until(is_so: Callable[[], bool], longest_s: float = 120.0) -> None:
    """Wait for something, and fail if it does not come."""
    end_s = time.monotonic() + longest_s
    while not is_so():
        assert time.monotonic() < end_s
        time.sleep(0.05)
