"""Measure time and memory of the commands, and write the table of docs/reference/limits.md.

    python benchmarks/commands.py [--write] [--only TEXT] [--rounds N]

Each command runs once with an empty cache folder ("first"), as on a new machine, and then several
times with a filled one, of which the quickest counts ("later"). The table has the CPU time of all
processes of a command, which hardly depends on what else the machine does; the time from start to
end is printed, too. Memory is what all processes have at once at most, shared pages counted once.
Your own caches are not used.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import os
import platform
import re
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import psutil

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "reference" / "limits.md"
BEGIN, END = "<!-- measured: python benchmarks/commands.py --write -->", "<!-- end -->"
PREPARE = (
    "run seams2023 --out mission",
    "campaign seams2023 --managers metacontrol,none --runs 40 --record-knowledge --out missions --quiet",
)
"""Commands whose results the measured ones read."""
COMMANDS = (
    "--help",
    "reproduce --out paper --overwrite --quiet",
    "run seams2023",
    "campaign seams2023 --managers metacontrol --runs 10000 --workers 2 --out out --overwrite --quiet",
    "train my:Learner --missions 100 --out learned.json --overwrite",
    "compare missions",
    "figure mission --out mission.png",
    "report missions",
    "replay mission",
    "validate seams2023 --runs 200 --quiet",
    "kb infer --at water_visibility=2.4 --at f_generate_search_path=fd_spiral_high",
    "kb explain --at water_visibility=2.4 --at f_generate_search_path=fd_spiral_high",
    "kb why-not S1b",
    "kb policy --max-failed 1",
    "kb query 'SELECT ?d WHERE {?d a tomasys:FunctionDesign}'",
    "kb check",
    "kb test",
    "kb test --coverage",
    "kb test --mutate --mutants 100",
    'kb try "$(cat spare.swrl)" --on missions',
    "kb diff suave.owl bold.owl",
    "kb rules",
    "kb add-rule mine.owl spare.swrl",
    "tree bt",
    "export-config seams2023 --out exported --overwrite",
    "scenarios",
    "schema",
)
SPARE = (
    "spare: hasQAvalue(?fg, ?q) ^ isQAtype(?q, water_visibility) ^ hasValue(?q, ?v)"
    " ^ lessThan(?v, 3.5) -> fd_realisability(fd_spiral_high, false)\n"
)
LEARNER = '''"""A manager that learns nothing in particular."""
from suave_des.managing.simple import NoManager


class Learner(NoManager):
    """Counts its missions."""

    def recall(self, learned, training):
        if training:
            learned["missions"] = learned.get("missions", 0) + 1
'''
SAMPLE_S = 0.05


@dataclass(frozen=True)
class Measured:
    """A command that ended: wall and CPU time in s, and memory in MB."""

    wall_s: float
    cpu_s: float
    memory_mb: float


def measure(words: str, folder: Path, cache: Path) -> Measured:
    """Run `suave-des WORDS` in a folder with a cache folder.

    Raises:
        SystemExit: it failed; it has said why.
    """
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "SUAVE_DES_CACHE_DIR": str(cache)}
    environment.pop("NUMBA_CACHE_DIR", None)
    line = f"exec {sys.executable} -m suave_des {words}"
    before, began_s = os.times(), time.perf_counter()
    process = subprocess.Popen(
        ["bash", "-c", line],
        cwd=folder,
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    peak = [0.0]
    done = threading.Event()
    watching = threading.Thread(target=_watch, args=(process.pid, peak, done))
    watching.start()
    _, said = process.communicate()
    wall_s = time.perf_counter() - began_s
    done.set()
    watching.join()
    after = os.times()
    if process.returncode not in (0, 1):
        raise SystemExit(
            f"commands.py: suave-des {words}: status {process.returncode}: {said[-500:]}"
        )
    cpu_s = (
        after.children_user + after.children_system - before.children_user - before.children_system
    )
    return Measured(wall_s, cpu_s, peak[0])


def _watch(pid: int, peak: list[float], done: threading.Event) -> None:
    """Note the greatest memory of a process and those below it, in MB, until they are done."""
    while not done.wait(SAMPLE_S):
        total = 0
        with suppress(psutil.Error):
            top = psutil.Process(pid)
            for each in (top, *top.children(recursive=True)):
                with suppress(psutil.Error):
                    memory = each.memory_full_info()
                    total += getattr(memory, "pss", memory.uss)
        peak[0] = max(peak[0], total / 1e6)


def prepare(folder: Path, cache: Path) -> None:
    """Make the files that the commands read."""
    shipped = (ROOT / "ontology" / "suave.owl").read_text(encoding="utf-8")
    (folder / "suave.owl").write_text(shipped, encoding="utf-8")
    (folder / "bold.owl").write_text(shipped.replace(">3.25<", ">2.75<"), encoding="utf-8")
    (folder / "spare.swrl").write_text(SPARE, encoding="utf-8")
    (folder / "my.py").write_text(LEARNER, encoding="utf-8")
    for words in PREPARE:
        measure(words, folder, cache)


def rows(only: str, rounds: int) -> list[str]:
    """Measure the commands that contain a text; lines of a Markdown table."""
    lines = [
        "| `suave-des ...` | first, s | later, s | memory, MB |",
        "| --- | ---: | ---: | ---: |",
    ]
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder, filled = Path(name) / "work", Path(name) / "cache"
        folder.mkdir()
        prepare(folder, filled)
        for number, words in enumerate(each for each in COMMANDS if only in each):
            found = []
            for turn in range(rounds + 1):
                (folder / "mine.owl").write_text(
                    (folder / "suave.owl").read_text("utf-8"), encoding="utf-8"
                )
                cache = filled if turn else Path(name) / f"empty{number}"
                found.append(measure(words, folder, cache))
            first, later = found[0], min(found[1:], key=lambda each: each.cpu_s)
            shown = re.sub(r" --(overwrite|quiet)", "", words)
            memory_mb = max(each.memory_mb for each in found)
            lines.append(f"| `{shown}` | {_s(first.cpu_s)} | {_s(later.cpu_s)} | {memory_mb:.0f} |")
            print(
                f"{lines[-1]}  from start to end {_s(first.wall_s)} and {_s(later.wall_s)} s",
                flush=True,
            )
    return lines


def _s(seconds: float) -> str:
    return f"{seconds:.1f}" if seconds < 20 else f"{seconds:.0f}"


def machine() -> str:
    """Describe in a sentence what the table was measured on."""
    info = Path("/proc/cpuinfo")
    models = (
        re.findall(r"model name\s*: (.+)", info.read_text(errors="replace"))
        if info.exists()
        else []
    )
    processor = models[0] if models else platform.processor() or platform.machine()
    version = importlib.metadata.version
    libraries = ", ".join(f"{name} {version(name)}" for name in ("numba", "owlready2", "simpy"))
    return f"Measured on {os.cpu_count()} cores of {processor}, Python {platform.python_version()}, {libraries}."


def main() -> None:
    """Measure, print, and write the table if asked to."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--write", action="store_true", help="put the table into docs/reference/limits.md"
    )
    parser.add_argument(
        "--only", default="", metavar="TEXT", help="commands that contain this text"
    )
    parser.add_argument(
        "--rounds",
        type=int,
        default=3,
        help="times that each runs with a filled cache (default: 3)",
    )
    chosen = parser.parse_args()
    table = "\n".join(rows(chosen.only, chosen.rounds))
    if chosen.write:
        before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
        after = rest.partition(END)[2]
        PAGE.write_text(f"{before}{BEGIN}\n{table}\n\n{machine()}\n{END}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
