"""Campaigns that are killed at random moments and resumed, in processes of their own."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

import suave_des
from suave_des.campaign.store import STORE_FILE, Store

_HERE = Path(__file__).parent
SHORT = "base: seams2023.yaml\nmission: {time_limit_s: 60}\n"
"""A scenario whose missions take a millisecond or two."""


def start(arguments: Sequence[str], cwd: Path) -> subprocess.Popen[str]:
    """Start `suave-des campaign ARGUMENTS`; on a slow machine too, it says nothing of its progress."""
    path = os.pathsep.join([str(Path(suave_des.__file__).parents[1]), str(_HERE), os.environ.get("PYTHONPATH", "")])
    return subprocess.Popen(
        [sys.executable, "-m", "suave_des", "campaign", "--quiet", *arguments],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": path},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def ended(process: subprocess.Popen[str]) -> tuple[int, str]:
    """Wait for it; its exit status and what it said on stderr."""
    _, err = process.communicate(timeout=300)
    return process.returncode, err


def workers_of(process: subprocess.Popen[str]) -> list[int]:
    """Process numbers of its worker processes."""
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
    try:
        numbers = [int(number) for number in children.read_text().split()]
        return [number for number in numbers if b"spawn_main" in Path(f"/proc/{number}/cmdline").read_bytes()]
    except OSError:
        return []


def survive_forked(
    kills: int, chance: random.Random, run: Callable[[bool, Callable[[object], None]], object], out: Path
) -> list[int]:
    """The same for a campaign that runs without workers, in forks of this process: quick, as nothing is imported.

    Args:
        kills: how many; most of them when missions are being run, however long it takes to get there.
        chance: decides the moments.
        run: runs the campaign, or resumes it if the first argument is true; the second is to be told of progress.
        out: its folder.
    """
    done: list[int] = []
    while len(done) < kills:
        resumes = (out / STORE_FILE).exists()
        here, there = os.pipe()
        child = os.fork()
        if child == 0:
            try:
                run(resumes, lambda progress: os.write(there, b"."))  # noqa: B023
                os._exit(0)
            except BaseException:
                traceback.print_exc()
                os._exit(1)
        os.close(there)
        if chance.random() < 0.8:
            os.read(here, 1)  # or the end of file, if there is nothing left to do
        time.sleep(chance.uniform(0.0, 0.3))
        os.kill(child, signal.SIGKILL)
        os.close(here)
        _, status = os.waitpid(child, 0)
        assert status in (0, signal.SIGKILL)
        done.append(_done(out))
    return done


def _done(out: Path) -> int:
    if not (out / STORE_FILE).exists():
        return 0
    store = Store(out / STORE_FILE)
    try:
        return store.count()
    finally:
        store.close()


def survive(kills: int, chance: random.Random, folder: Path, asked: Sequence[str], longest_s: float) -> list[int]:
    """Run a campaign, killing it `kills` times at random moments, often a worker first; then let it finish.

    Returns:
        Missions that were done at each kill.
    """
    done: list[int] = []
    arguments: Sequence[str] = [*asked, "--out", "out"]
    journal = folder / "out" / f"{STORE_FILE}-wal"
    while len(done) < kills:
        process = start(arguments, folder)
        if chance.random() < 0.8:
            while process.poll() is None and not (journal.exists() and journal.stat().st_size > 100_000):
                time.sleep(0.01)
        time.sleep(chance.uniform(0.0, longest_s))
        own = workers_of(process)
        if own and chance.random() < 0.5:
            with suppress(ProcessLookupError):
                os.kill(chance.choice(own), signal.SIGKILL)
            time.sleep(chance.uniform(0.0, longest_s))
        assert process.poll() in (None, 0), process.communicate()
        process.kill()
        process.communicate()
        done.append(_done(folder / "out"))
        if (folder / "out" / STORE_FILE).exists():
            arguments = ["--resume", "out", *asked[asked.index("--workers") :]]
    status, err = ended(start(arguments, folder))
    assert status == 0, err
    return done
