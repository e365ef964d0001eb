"""What is seen of a campaign while it runs: a live display on a terminal or in a notebook, log lines elsewhere.

All that a campaign does for it, mission by mission, is to look at the clock.
"""

from __future__ import annotations

import io
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from suave_des.campaign.progress import GroupProgress, OnProgress, Progress
from suave_des.campaign.summary import METRIC_TITLES

_UPDATE_PERIOD_S = 0.25
_FIRST_LINE_S, _LINE_PERIOD_S = 10.0, 30.0
_RECENT_S = 10.0
"""Missions a second are those of this time."""
_BAR_WIDTH = 22
_NOTEBOOK_WIDTH = 90


@dataclass(frozen=True, slots=True)
class _Seen:
    """What there is to show, at one moment."""

    progress: Progress
    groups: tuple[GroupProgress, ...]
    at_s: float
    per_second: float | None

    @property
    def left_s(self) -> float | None:
        """Time to the end at the present rate."""
        left = self.progress.total - self.progress.done
        return left / self.per_second if self.per_second else None


class _Meter:
    """Takes a campaign's progress, and looks at it now and then."""

    def __init__(self, update: Callable[[_Seen], None]) -> None:
        self._update = update
        self._due_s = 0.0
        self._latest: Progress | None = None
        self._recent: deque[tuple[float, int]] = deque()

    def __call__(self, progress: Progress) -> None:
        """Take what is known; called for each mission or chunk."""
        self._latest = progress
        now = time.monotonic()
        if now >= self._due_s:
            self._due_s = now + _UPDATE_PERIOD_S
            self._update(self._look(progress, now))

    def finish(self) -> None:
        """Show the last that is known."""
        if self._latest is not None:
            self._update(self._look(self._latest, time.monotonic()))

    def _look(self, progress: Progress, now: float) -> _Seen:
        # The first outcomes are where counting begins: before them, workers were starting.
        self._recent.append((now, progress.done))
        while len(self._recent) > 2 and self._recent[1][0] <= now - _RECENT_S:
            self._recent.popleft()
        then, before = self._recent[0]
        elapsed = now - then
        rate = (progress.done - before) / elapsed if elapsed > 0.0 and progress.done > before else None
        return _Seen(progress, progress.groups(), now, rate)


@contextmanager
def shown(label: str, console: Console, *, quiet: bool = False) -> Iterator[OnProgress | None]:
    """What to give to a campaign as on_progress.

    Args:
        label: what the campaign is called.
        console: where to show its progress: live if it is a terminal or a notebook, otherwise as lines, the first after
            10 s and then every 30 s.
        quiet: show nothing.
    """
    if quiet:
        yield None
    elif console.is_jupyter:
        with _in_notebook(label) as show:
            yield show
    elif console.is_terminal and not console.is_dumb_terminal:
        with _live(label, console) as show:
            yield show
    else:
        with _lines(label, console) as show:
            yield show


# Live.


@contextmanager
def _live(label: str, console: Console) -> Iterator[OnProgress]:
    display = _Display(label)
    meter = _Meter(display.update)
    with Live(console=console, get_renderable=display.__rich__, refresh_per_second=4, transient=True):
        yield meter


class _Display:
    def __init__(self, label: str) -> None:
        self._label = label
        self._seen: _Seen | None = None
        self._began_s = time.monotonic()

    def update(self, seen: _Seen) -> None:
        self._seen = seen

    def __rich__(self) -> Group:
        if self._seen is None:
            return Group(Text(f"{self._label}: starting, {duration(time.monotonic() - self._began_s)}"))
        return Group(Text(self._label, "bold", no_wrap=True, overflow="ellipsis"), _head(self._seen), _body(self._seen))


def _head(seen: _Seen) -> Table:
    progress = seen.progress
    head = Table.grid(padding=(0, 2))
    head.add_column(max_width=_BAR_WIDTH)
    for _ in range(4):
        head.add_column(no_wrap=True)
    head.add_row(
        ProgressBar(total=max(progress.total, 1), completed=progress.done),
        f"{_counted(progress.done)}/{_counted(progress.total)}",
        _rate(seen),
        _left(seen),
        Text(f"{_counted(progress.failed)} failed" if progress.failed else "", "red"),
    )
    return head


def _body(seen: _Seen) -> Table:
    metric = seen.progress.metric
    body = Table(box=None, padding=(0, 1), pad_edge=False)
    body.add_column("manager", overflow="ellipsis")  # the one that gives way on a narrow terminal
    for heading in ("missions", "failed", METRIC_TITLES.get(metric, metric)):
        body.add_column(heading, justify="right", no_wrap=True)
    body.add_column("", no_wrap=True)
    for group in seen.groups:
        body.add_row(
            _name(group, seen.groups),
            _counted(group.done),
            _counted(group.failed) if group.failed else "",
            estimated(group.mean, group.half_width),
            "stopped" if group.is_narrow else "done" if group.done == group.runs else "",
        )
    return body


def _name(group: GroupProgress, groups: tuple[GroupProgress, ...]) -> str:
    return f"{group.manager} at point {group.point + 1}" if groups[-1].point else group.manager


# Lines.


@contextmanager
def _lines(label: str, console: Console) -> Iterator[OnProgress]:
    log = _Log(label, console)
    meter = _Meter(log.update)
    over = threading.Event()
    writer = threading.Thread(target=log.write_until, args=(over,), daemon=True)
    writer.start()
    try:
        yield meter
    finally:
        over.set()
        writer.join()
        if log.has_written:
            meter.finish()
            log.write()


class _Log:
    def __init__(self, label: str, console: Console) -> None:
        self._label, self._console = label, console
        self._seen: _Seen | None = None
        self.has_written = False

    def update(self, seen: _Seen) -> None:
        self._seen = seen

    def write_until(self, over: threading.Event) -> None:
        """Write a line every so often; life of a thread, so that lines come too while a mission takes long."""
        wait_s = _FIRST_LINE_S
        while not over.wait(wait_s):
            wait_s = _LINE_PERIOD_S
            self.write()

    def write(self) -> None:
        self.has_written = True
        self._console.print(self._line(), soft_wrap=True, markup=False, highlight=False)

    def _line(self) -> str:
        seen = self._seen
        if seen is None:
            return f"suave-des: {self._label}: starting"
        progress = seen.progress
        means = [
            f"{_name(group, seen.groups)} {estimated(group.mean, group.half_width)}"
            for group in seen.groups
            if group.mean is not None and not (group.point != seen.groups[-1].point and group.done == group.runs)
        ]
        parts = [
            f"{progress.done} of {progress.total} missions",
            f"{progress.failed} failed" if progress.failed else "",
            _rate(seen),
            _left(seen),
        ]
        told = ", ".join(part for part in parts if part)
        known = f"; {METRIC_TITLES.get(progress.metric, progress.metric)}: {', '.join(means)}" if means else ""
        return f"suave-des: {self._label}: {told}{known}"


# Notebooks.


@contextmanager
def _in_notebook(label: str) -> Iterator[OnProgress]:
    """One output that is replaced, of plain HTML: it needs no widgets."""
    from IPython.display import HTML, display

    seen = _Display(label)
    handle: Any = display(HTML(_html(seen)), display_id=True)

    def update(now: _Seen) -> None:
        seen.update(now)
        handle.update(HTML(_html(seen)))

    meter = _Meter(update)
    try:
        yield meter
    finally:
        meter.finish()


def _html(display: _Display) -> str:
    console = Console(file=io.StringIO(), record=True, width=_NOTEBOOK_WIDTH, force_jupyter=False, force_terminal=True)
    console.print(display)
    return console.export_html(inline_styles=True, code_format="<pre style='line-height: 1.2'>{code}</pre>")


# Words.


def estimated(mean: float | None, half_width: float | None) -> str:
    """A mean and half its 95% interval; nothing for none."""
    if mean is None:
        return ""
    return f"{mean:.2f}" if half_width is None else f"{mean:.2f} ± {half_width:.2f}"


def duration(seconds: float) -> str:
    """A time that people read: 8 s, 2 min 5 s, 3 h 20 min."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


def _counted(number: int) -> str:
    return f"{number:,}"


def _rate(seen: _Seen) -> str:
    if seen.per_second is None:
        return ""
    return f"{seen.per_second:,.0f}/s" if seen.per_second >= 10.0 else f"{seen.per_second:.2g}/s"


def _left(seen: _Seen) -> str:
    left_s = seen.left_s
    return "" if not left_s else f"{duration(left_s)} left"
