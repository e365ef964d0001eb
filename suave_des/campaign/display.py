"""Shows the progress of a campaign: live on a terminal or in a notebook, as log lines elsewhere."""

from __future__ import annotations

import io
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from rich.console import Console, RenderableType
from rich.progress import BarColumn, TextColumn
from rich.progress import Progress as RichProgress
from rich.table import Table
from rich.text import Text

from suave_des.campaign.progress import GroupProgress, OnProgress, Progress
from suave_des.campaign.results import METRIC_TITLES

_UPDATE_PERIOD_S = 0.25
"""A campaign reports each mission; the display is drawn anew so often."""
_FIRST_LINE_S, _LINE_PERIOD_S = 10.0, 30.0
_RATE_PERIOD_S = 10.0
"""Missions a second are those of this time."""
_NOTEBOOK_WIDTH = 90
_WAITS_S = 2.0
_FIRST_TIME = "(the first run compiles the mission code: 20 to 60 s)"
_WAITING = "Java is starting, or missions are long"


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
    display = _Display(label, console)
    if console.is_jupyter:
        with _in_notebook(display):
            yield display.show
    elif console.is_terminal and not console.is_dumb_terminal:
        with display:
            yield display.show
    else:
        with _as_lines(display, console):
            yield display.show


class _Display(RichProgress):
    """A bar for all missions, and a row for each manager."""

    def __init__(self, label: str, console: Console) -> None:
        self.label = label
        self.on_update: Callable[[], None] = lambda: None
        self.progress: Progress | None = None
        self._groups: tuple[GroupProgress, ...] = ()
        self._due_s = 0.0
        self._done, self._done_s = 0, time.monotonic()
        self._began_s = time.monotonic()
        super().__init__(
            BarColumn(22),
            TextColumn("{task.completed:,.0f}/{task.total:,.0f}"),
            TextColumn("{task.fields[rate]}"),
            TextColumn("{task.fields[left]}"),
            TextColumn("{task.fields[failed]}", style="red"),
            console=console,
            transient=True,
            refresh_per_second=4,
            speed_estimate_period=_RATE_PERIOD_S,
        )
        self.add_task("", start=False, total=None, rate="", left="", failed="")
        (self._task,) = self.tasks

    def show(self, progress: Progress) -> None:
        """Take the current progress; called for each mission or chunk."""
        now = time.monotonic()
        if progress.done != self._done:
            self._done, self._done_s = progress.done, now
        is_first, self.progress = self.progress is None, progress
        if now >= self._due_s:
            self._due_s = now + _UPDATE_PERIOD_S
            if is_first:  # the rate is counted from here: before, workers were starting
                self.reset(self._task.id, completed=progress.done, total=progress.total)
            self.look()

    def look(self) -> None:
        """Update the display."""
        if (progress := self.progress) is None:
            return
        self._groups = progress.groups()
        self.update(self._task.id, completed=progress.done, total=progress.total)
        failed = f"{progress.failed:,} failed" if progress.failed else ""
        speed, left_s = self._task.speed, self._task.time_remaining
        rate = "" if not speed else f"{speed:,.0f}/s" if speed >= 10.0 else f"{speed:.2g}/s"
        self.update(self._task.id, failed=failed, rate=rate, left=f"{duration(left_s)} left" if left_s else "")
        self.on_update()

    def get_renderables(self) -> Iterator[RenderableType]:
        """Yield what is drawn, from top to bottom."""
        if not self._groups:
            yield Text(f"{self.label}: {self._starting()}", no_wrap=True, overflow="ellipsis")
            return
        waiting_s = time.monotonic() - self._done_s
        if waiting_s > _WAITS_S and self.progress is not None and self.progress.done < self.progress.total:
            # What was left at the rate before says nothing now.
            self._task.fields["left"] = f"no mission done for {duration(waiting_s)}: {_WAITING}"
        yield Text(self.label, "bold", no_wrap=True, overflow="ellipsis")
        yield self.make_tasks_table(self.tasks)
        table = Table(box=None, padding=(0, 1), pad_edge=False)
        table.add_column("manager", overflow="ellipsis")  # the one that gives way on a narrow terminal
        for heading in ("missions", "failed", self._metric):
            table.add_column(heading, justify="right", no_wrap=True)
        table.add_column("", no_wrap=True)
        for group in self._groups:
            table.add_row(
                self._name(group),
                f"{group.done:,}",
                f"{group.failed:,}" if group.failed else "",
                estimated(group.mean, group.half_width),
                "stopped" if group.is_narrow else "done" if group.is_complete else "",
            )
        yield table

    def line(self) -> str:
        """Return the same in one line."""
        if (progress := self.progress) is None:
            return f"suave-des: {self.label}: {self._starting()}"
        last = self._groups[-1]
        means = [
            f"{self._name(group)} {estimated(group.mean, group.half_width)}"
            for group in self._groups
            if group.mean is not None and (group.point == last.point or not group.is_complete)
        ]
        fields = self._task.fields
        parts = (f"{progress.done} of {progress.total} missions", fields["failed"], fields["rate"], fields["left"])
        known = f"; {self._metric}: {', '.join(means)}" if means else ""
        return f"suave-des: {self.label}: {', '.join(filter(None, parts))}{known}"

    def _starting(self) -> str:
        return f"starting, {duration(time.monotonic() - self._began_s)} {_FIRST_TIME}"

    @property
    def _metric(self) -> str:
        assert self.progress is not None
        return METRIC_TITLES.get(self.progress.metric, self.progress.metric)

    def _name(self, group: GroupProgress) -> str:
        return f"{group.manager} at point {group.point + 1}" if self._groups[-1].point else group.manager


@contextmanager
def _as_lines(display: _Display, console: Console) -> Iterator[None]:
    """Write lines periodically, from a thread, so that they also appear during a long mission."""
    over, has_written = threading.Event(), threading.Event()

    def write() -> None:
        has_written.set()
        console.print(display.line(), soft_wrap=True, markup=False, highlight=False)

    def write_until_over() -> None:
        wait_s = _FIRST_LINE_S
        while not over.wait(wait_s):
            wait_s = _LINE_PERIOD_S
            write()

    writer = threading.Thread(target=write_until_over, daemon=True)
    writer.start()
    try:
        yield
    finally:
        over.set()
        writer.join()
        if has_written.is_set() and display.progress is not None:
            display.look()
            write()


@contextmanager
def _in_notebook(display: _Display) -> Iterator[None]:
    """Replace one output, of plain HTML: it needs no widgets."""
    notebook: Any = import_module("IPython.display")  # its functions have no types

    def html() -> Any:
        console = Console(file=io.StringIO(), record=True, width=_NOTEBOOK_WIDTH, force_jupyter=False)
        console.print(display.get_renderable())
        return notebook.HTML(
            console.export_html(inline_styles=True, code_format="<pre style='line-height: 1.2'>{code}</pre>")
        )

    handle: Any = notebook.display(html(), display_id=True)
    display.on_update = lambda: handle.update(html())
    try:
        yield
    finally:
        display.look()


def estimated(mean: float | None, half_width: float | None) -> str:
    """Return a mean and half its 95% interval as text; empty without a mean."""
    if mean is None:
        return ""
    return f"{mean:.2f}" if half_width is None else f"{mean:.2f} ± {half_width:.2f}"


def duration(seconds: float) -> str:
    """Return a human-readable duration: 8 s, 2 min 5 s, 3 h 20 min."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
