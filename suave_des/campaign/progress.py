"""The progress of a campaign on standard error: one line, written over again, or lines in a log."""

from __future__ import annotations

import os
import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import timedelta
from itertools import chain, repeat
from pathlib import Path

from suave_des.caches import private_cache

_UPDATE_PERIOD_S = 0.25
_FIRST_LINE_S, _LINE_PERIOD_S = 10.0, 30.0
_FIRST_RUN = "the first run compiles the mission code: 20 to 60 s"


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of a campaign, in missions; those done include those that failed."""

    done: int
    failed: int
    total: int


OnProgress = Callable[[Progress], None]


def is_live() -> bool:
    """Whether a line of standard error can be written over: on a terminal, and in a notebook."""
    if type(sys.stderr).__module__.startswith("ipykernel."):
        return True
    return sys.stderr.isatty() and os.environ.get("TERM") != "dumb"


@contextmanager
def shown(label: str, *, quiet: bool = False) -> Iterator[OnProgress | None]:
    """Show progress of the campaign `label` until the end, and yield what to give to it as
    on_progress.

    Elsewhere than on a terminal or in a notebook it is lines, the first after 10 s and then every
    30 s.
    """
    if quiet or sys.stderr is None:
        yield None
        return
    label = "".join(char if char.isprintable() else "?" for char in label)
    over = threading.Event()
    live = is_live()
    began_s = time.monotonic()
    told = list[tuple[float, Progress]]()
    why = "" if _is_compiled() else f" ({_FIRST_RUN})"
    waits_s: Iterable[float] = (
        repeat(_UPDATE_PERIOD_S) if live else chain([_FIRST_LINE_S], repeat(_LINE_PERIOD_S))
    )

    def take(progress: Progress) -> None:
        told[1:] = [(time.monotonic(), progress)]  # beside the first one

    def draw(*, end: str = "") -> None:
        age_s = time.monotonic() - began_s
        text = f"{label}: {_text(told) if told else f'starting, {_time(age_s)}{why}'}"
        width = shutil.get_terminal_size().columns - 1
        line = f"\r{text[:width]:<{width}}{end}" if live else f"suave-des: {text}\n"
        with suppress(OSError):  # nobody reads it any more
            print(line, end="", file=sys.stderr, flush=True)

    def draw_until_over() -> None:
        """Draw from a thread, so that it goes on during a long mission."""
        for wait_s in waits_s:
            if over.wait(wait_s):
                return
            draw()

    drawer = threading.Thread(target=draw_until_over, daemon=True)
    drawer.start()
    try:
        yield take
    finally:
        over.set()
        drawer.join()
        if live:
            draw(end="\n")
        elif told and time.monotonic() - began_s > _FIRST_LINE_S:  # else it had no line so far
            draw()


def _is_compiled() -> bool:
    """Whether machine code of an earlier run is kept."""
    folder = os.environ.get("NUMBA_CACHE_DIR") or private_cache("numba")
    return folder is not None and any(Path(folder).rglob("*.nbc"))


def _text(told: Sequence[tuple[float, Progress]]) -> str:
    """Return missions that are done and failed, their rate, and the time left, from the first and
    the last progress.

    Missions that were done at first are not counted in the rate: those of a campaign that is
    resumed.
    """
    (first_s, first) = told[0]
    (last_s, progress) = told[-1]
    parts = [f"{progress.done} of {progress.total} missions"]
    if progress.failed:
        parts.append(f"{progress.failed} failed")
    done = progress.done - first.done
    took_s = last_s - first_s
    left = progress.total - progress.done
    if done and took_s > 0.0:
        rate = done / took_s
        parts.append(f"{rate:,.0f}/s" if rate >= 10.0 else f"{rate:.2g}/s")
        parts += [f"{_time(left / rate)} left"] if left else []
    return ", ".join(parts)


def _time(seconds: float) -> str:
    return str(timedelta(seconds=round(seconds)))
