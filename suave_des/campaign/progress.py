"""The progress of a campaign: shown on a terminal, in a notebook, or as log lines."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from itertools import chain, repeat
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console

_UPDATE_PERIOD_S = 0.25
_FIRST_LINE_S, _LINE_PERIOD_S = 10.0, 30.0
_FIRST_TIME = "(the first run compiles the mission code: 20 to 60 s)"


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of a campaign, in missions.

    Attributes:
        done: missions that are done, failed ones among them.
        failed: missions that failed.
        total: missions that are to be done.
    """

    done: int
    failed: int
    total: int


OnProgress = Callable[[Progress], None]


@contextmanager
def shown(label: str, console: Console, *, quiet: bool = False) -> Iterator[OnProgress | None]:
    """Show progress until the end, and yield what to give to a campaign as on_progress.

    Args:
        label: name of the campaign.
        console: where to show its progress: live if it is a terminal or a notebook, otherwise as lines, the first after
            10 s and then every 30 s.
        quiet: show nothing.
    """
    if quiet:
        yield None
        return
    text, over, drawn = _Text(label), threading.Event(), threading.Event()
    is_live = console.is_jupyter or (console.is_terminal and not console.is_dumb_terminal)
    waits_s: Iterable[float] = repeat(_UPDATE_PERIOD_S) if is_live else chain([_FIRST_LINE_S], repeat(_LINE_PERIOD_S))
    with _drawing(text, console, is_live=is_live) as draw:

        def draw_until_over() -> None:
            """Draw from a thread, so that it goes on during a long mission."""
            for wait_s in waits_s:
                if over.wait(wait_s):
                    return
                drawn.set()
                draw()

        drawer = threading.Thread(target=draw_until_over, daemon=True)
        drawer.start()
        try:
            yield text.take
        finally:
            over.set()
            drawer.join()
            if is_live or (drawn.is_set() and text.progress is not None):
                draw()


@contextmanager
def _drawing(text: _Text, console: Console, *, is_live: bool) -> Iterator[Callable[[], None]]:
    """Yield what draws a text: in one output of a notebook, which needs no widgets; with a bar; or as a line."""
    # Rich is imported here alone: worker processes and scripts need none of it.
    if console.is_jupyter:
        notebook: Any = import_module("IPython.display")  # its functions have no types
        handle: Any = notebook.display({"text/plain": text.line()}, raw=True, display_id=True)
        yield lambda: handle.update({"text/plain": text.line()}, raw=True)
    elif is_live:
        from rich.progress import BarColumn, TextColumn
        from rich.progress import Progress as Bars
        from rich.table import Column

        line = TextColumn("{task.description}", markup=False, table_column=Column(no_wrap=True, overflow="ellipsis"))
        with Bars(line, BarColumn(20), console=console, auto_refresh=False, transient=True) as bars:
            bar = bars.add_task(text.line(), total=None)

            def draw() -> None:
                done, total = (0, None) if text.progress is None else (text.progress.done, text.progress.total)
                bars.update(bar, completed=done, total=total, description=text.line(), refresh=True)

            yield draw
    else:
        yield lambda: console.print(f"suave-des: {text.line()}", soft_wrap=True, markup=False, highlight=False)


class _Text:
    """What is known of a campaign's progress, as a line of text."""

    def __init__(self, label: str) -> None:
        self.label = label
        self.progress: Progress | None = None
        self._began_s = self._first_s = self._last_s = time.monotonic()
        self._before = 0
        """Missions that were done at first, as those of a campaign that is resumed."""

    def take(self, progress: Progress) -> None:
        """Take the current progress; called for each mission or chunk."""
        self._last_s = time.monotonic()
        if self.progress is None:
            self._first_s, self._before = self._last_s, progress.done
        self.progress = progress

    def line(self) -> str:
        """Return missions that are done and failed, their rate, and the time that is left."""
        progress = self.progress
        if progress is None:
            return f"{self.label}: starting, {_duration(time.monotonic() - self._began_s)} {_FIRST_TIME}"
        parts = [f"{progress.done} of {progress.total} missions"]
        if progress.failed:
            parts.append(f"{progress.failed} failed")
        done, took_s, left = progress.done - self._before, self._last_s - self._first_s, progress.total - progress.done
        if done and took_s > 0.0:
            rate = done / took_s
            parts.append(f"{rate:,.0f}/s" if rate >= 10.0 else f"{rate:.2g}/s")
            parts += [f"{_duration(left / rate)} left"] if left else []
        return f"{self.label}: {', '.join(parts)}"


def _duration(seconds: float) -> str:
    """Return a human-readable duration: 8 s, 2 min 5 s, 3 h 20 min."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
