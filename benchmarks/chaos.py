"""Kills a campaign at random moments, many times, and compares its bytes with those of an
undisturbed one.

    python benchmarks/chaos.py [--kills N] [--seed N] [--runs N]

Half of the kills strike a worker first and the whole campaign a little later; after each, it is
resumed.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

import suave_des
from suave_des.records.store import STORE_FILE, Store, has_campaign

MANAGERS = ("none", "random")
SHORT = "base: seams2023.yaml\nmission: {time_limit_s: 60}\n"
"""A scenario whose missions take a millisecond or two."""


def start(arguments: Sequence[str], cwd: Path) -> subprocess.Popen[str]:
    """Start `suave-des campaign ARGUMENTS`; on a slow machine too, it says nothing of its
    progress.
    """
    path = os.pathsep.join(
        [str(Path(suave_des.__file__).parents[1]), os.environ.get("PYTHONPATH", "")]
    )
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
        return [
            number
            for number in numbers
            if b"spawn_main" in Path(f"/proc/{number}/cmdline").read_bytes()
        ]
    except OSError:
        return []


def survive_forked(
    kills: int,
    chance: random.Random,
    run: Callable[[bool, Callable[[object], None]], object],
    out: Path,
) -> list[int]:
    """The same for a campaign that runs without workers, in forks of this process: quick, as
    nothing is imported.

    Args:
        kills: how many; most of them when missions are being run, however long it takes to get
            there.
        chance: decides the moments.
        run: runs the campaign, or resumes it if the first argument is true; the second is to be
            told of progress.
        out: its folder.
    """
    done: list[int] = []
    while len(done) < kills:
        resumes = has_campaign(out)
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
    if not has_campaign(out):
        return 0
    store = Store(out / STORE_FILE)
    try:
        return store.count()
    finally:
        store.close()


def survive(
    kills: int, chance: random.Random, folder: Path, asked: Sequence[str], longest_s: float
) -> list[int]:
    """Run a campaign, killing it `kills` times at random moments, often a worker first; then let it
    finish.

    Returns:
        Missions that were done at each kill.
    """
    done: list[int] = []
    arguments: Sequence[str] = [*asked, "--out", "out"]
    journal = folder / "out" / f"{STORE_FILE}-wal"
    while len(done) < kills:
        process = start(arguments, folder)
        if chance.random() < 0.8:
            while process.poll() is None and not (
                journal.exists() and journal.stat().st_size > 200_000
            ):
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
        if has_campaign(folder / "out"):
            arguments = ["--resume", "out", *asked[asked.index("--workers") :]]
    status, err = ended(start(arguments, folder))
    assert status == 0, err
    return done


def main() -> None:
    """Kill, resume, compare; exit status 1 if a byte differs."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--runs", type=int, default=20_000, help="missions for each manager")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "short.yaml").write_text(SHORT)
        asked = [
            "short.yaml",
            "--managers",
            ",".join(MANAGERS),
            "--runs",
            str(arguments.runs),
            "--workers",
            "2",
        ]
        status, err = ended(start([*asked, "--out", "whole"], folder))
        assert status == 0, err
        began_s = time.monotonic()
        done = survive(arguments.kills, random.Random(arguments.seed), folder, asked, longest_s=0.5)
        same = (folder / "out" / "runs.csv").read_bytes() == (
            folder / "whole" / "runs.csv"
        ).read_bytes()
        moments = len({count for count in done if 0 < count < len(MANAGERS) * arguments.runs})
        print(
            f"{len(done)} kills in {time.monotonic() - began_s:.0f} s, at {moments} different counts of missions done"
        )
        print("the bytes are the same" if same else "THE BYTES DIFFER")
        sys.exit(0 if same else 1)


if __name__ == "__main__":
    main()
