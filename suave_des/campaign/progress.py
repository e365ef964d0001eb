"""The progress of a campaign: counted while it runs, and shown on a terminal, in a notebook, or as log lines."""

from __future__ import annotations

import io
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from importlib import import_module
from itertools import chain, product, repeat
from typing import TYPE_CHECKING, Any

from suave_des.records.metrics import COLUMNS, METRICS, SEARCH_TIME, Row
from suave_des.records.store import MissionFailure, Outcome

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

GROUPS_SHOWN = 8
"""Of a sweep with more groups, those that are shown are the ones under way and those that were done last."""
_SEARCH_TIME = COLUMNS.index(SEARCH_TIME)
_METRIC = METRICS[SEARCH_TIME].brief
_UPDATE_PERIOD_S = 0.25
_FIRST_LINE_S, _LINE_PERIOD_S = 10.0, 30.0
_NOTEBOOK_WIDTH = 90
_FIRST_TIME = "(the first run compiles the mission code: 20 to 60 s)"


@dataclass(slots=True)
class GroupProgress:
    """Progress of one manager at one point of a sweep: the missions that differ in the run only.

    Attributes:
        point: number of the sweep's point, from 0; 0 without a sweep.
        manager: its name.
        runs: missions that are to be done.
        done: missions that are done, failed ones among them.
        failed: missions that failed.
        total_s: search time of all missions that are done and did not fail.
    """

    point: int
    manager: str
    runs: int
    done: int = 0
    failed: int = 0
    total_s: float = 0.0

    @property
    def mean_s(self) -> float | None:
        """Mean search time so far; None if no mission is done."""
        return self.total_s / (self.done - self.failed) if self.done > self.failed else None

    def add(self, outcome: Row | MissionFailure) -> None:
        """Count an outcome."""
        self.done += 1
        if isinstance(outcome, MissionFailure):
            self.failed += 1
        elif isinstance(value := outcome[_SEARCH_TIME], float | int):
            self.total_s += value


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of a campaign, in missions.

    Attributes:
        done: missions that are done, failed ones among them.
        failed: missions that failed.
        total: missions that are to be done.
        groups: returns the progress of each manager at each point, at most GROUPS_SHOWN, at the time of the call.
    """

    done: int
    failed: int
    total: int
    groups: Callable[[], tuple[GroupProgress, ...]] = field(default=tuple, repr=False, compare=False)


OnProgress = Callable[[Progress], None]


class ProgressTracker:
    """Counts the outcomes of a campaign; of many groups (a manager at a point) that are done, it keeps the last ones.

    Args:
        points: number of points of the sweep.
        managers: names, in the campaign's order.
        runs: for each manager at each point.
    """

    def __init__(self, points: int, managers: Sequence[str], runs: int) -> None:
        self._managers, self._runs = managers, runs
        self._groups: dict[tuple[int, int], GroupProgress] = {}
        self.done = self.failed = 0
        self.total = runs * points * len(managers)
        if points * len(managers) <= GROUPS_SHOWN:
            for place in product(range(points), range(len(managers))):
                self._group(*place)

    def add(self, finished: Iterable[Outcome]) -> None:
        """Count outcomes; they may come in any order."""
        for key, outcome in finished:
            group = self._group(key.point, key.manager)
            group.add(outcome)
            self.done += 1
            self.failed += isinstance(outcome, MissionFailure)
            if group.done == self._runs and len(self._groups) > GROUPS_SHOWN:
                del self._groups[next(place for place, each in self._groups.items() if each.done == self._runs)]

    def progress(self) -> Progress:
        """Return the campaign's progress."""
        return Progress(self.done, self.failed, self.total, self._shown)

    def _group(self, point: int, manager: int) -> GroupProgress:
        place = point, manager
        if place not in self._groups:
            self._groups[place] = GroupProgress(point, self._managers[manager], self._runs)
        return self._groups[place]

    def _shown(self) -> tuple[GroupProgress, ...]:
        return tuple(self._groups[place] for place in sorted(self._groups)[-GROUPS_SHOWN:])


# How it is shown. Rich is imported here alone: worker processes and scripts need none of it.


@contextmanager
def shown(label: str, console: Console, *, quiet: bool = False) -> Iterator[OnProgress | None]:
    """Show progress until the end, and yield what to give to a campaign as on_progress.

    Args:
        label: name of the campaign.
        console: where to show its progress: live if it is a terminal or a notebook, otherwise as lines, the first after
            10 s and then every 30 s.
        quiet: show nothing.
    """
    from rich.live import Live

    if quiet:
        yield None
        return
    view, over, drawn = _View(label), threading.Event(), threading.Event()
    is_live = console.is_terminal and not console.is_dumb_terminal and not console.is_jupyter
    with Live(console=console, auto_refresh=False, transient=True) if is_live else nullcontext() as live:
        draw: Callable[[], object]
        waits_s: Iterable[float] = repeat(_UPDATE_PERIOD_S)
        if console.is_jupyter:
            draw = _in_notebook(view)
        elif live is not None:
            draw = lambda: live.update(view.picture(), refresh=True)  # noqa: E731
        else:
            waits_s = chain([_FIRST_LINE_S], repeat(_LINE_PERIOD_S))
            draw = lambda: console.print(view.line(), soft_wrap=True, markup=False, highlight=False)  # noqa: E731

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
            yield view.take
        finally:
            over.set()
            drawer.join()
            view.look()
            if console.is_jupyter or live is not None or (drawn.is_set() and view.progress is not None):
                draw()


def _in_notebook(view: _View) -> Callable[[], object]:
    """Show a view in one output of plain HTML, which needs no widgets; return what replaces it."""
    from rich.console import Console

    notebook: Any = import_module("IPython.display")  # its functions have no types

    def html() -> Any:
        console = Console(file=io.StringIO(), record=True, width=_NOTEBOOK_WIDTH, force_jupyter=False)
        console.print(view.picture())
        return notebook.HTML(
            console.export_html(inline_styles=True, code_format="<pre style='line-height: 1.2'>{code}</pre>")
        )

    handle: Any = notebook.display(html(), display_id=True)
    return lambda: handle.update(html())


class _View:
    """What is known of a campaign's progress, as a picture and as a line."""

    def __init__(self, label: str) -> None:
        self.label = label
        self.progress: Progress | None = None
        self._groups: tuple[GroupProgress, ...] = ()
        self._due_s, self._began_s = 0.0, time.monotonic()
        self._first_s = self._last_s = self._began_s
        self._before = 0
        """Missions that were done at the first look, as those of a campaign that is resumed."""

    def take(self, progress: Progress) -> None:
        """Take the current progress; called for each mission or chunk."""
        is_first, self.progress = self.progress is None, progress
        if is_first:
            self._first_s, self._before = time.monotonic(), progress.done
        if time.monotonic() >= self._due_s:
            self.look()

    def look(self) -> None:
        """Note what is drawn next, in the campaign's thread."""
        if self.progress is not None:
            self._last_s = time.monotonic()
            self._due_s = self._last_s + _UPDATE_PERIOD_S
            self._groups = self.progress.groups()

    def picture(self) -> RenderableType:
        """Return a bar for all missions, and a row for each manager."""
        from rich.console import Group
        from rich.progress_bar import ProgressBar
        from rich.table import Table
        from rich.text import Text

        progress = self.progress
        if progress is None or not self._groups:
            return Text(f"{self.label}: {self._starting()}", no_wrap=True, overflow="ellipsis")
        head = Table.grid(padding=(0, 1))
        bar, failed = ProgressBar(progress.total, progress.done, width=22), Text(_failed(progress), "red")
        head.add_row(bar, f"{progress.done:,}/{progress.total:,}", *self._rate(progress), failed)
        table = Table(box=None, padding=(0, 1), pad_edge=False)
        table.add_column("manager", overflow="ellipsis")  # the one that gives way on a narrow terminal
        for heading in ("missions", "failed", _METRIC):
            table.add_column(heading, justify="right", no_wrap=True)
        table.add_column("", no_wrap=True)
        for group in self._groups:
            cells = (f"{group.done:,}", f"{group.failed:,}" if group.failed else "")
            mean = "" if group.mean_s is None else f"{group.mean_s:.2f}"
            table.add_row(self._name(group), *cells, mean, "done" if group.done == group.runs else "")
        return Group(Text(self.label, "bold", no_wrap=True, overflow="ellipsis"), head, table)

    def line(self) -> str:
        """Return the same in one line."""
        progress = self.progress
        if progress is None or not self._groups:
            return f"suave-des: {self.label}: {self._starting()}"
        last = self._groups[-1].point
        means = [
            f"{self._name(group)} {group.mean_s:.2f}"
            for group in self._groups
            if group.mean_s is not None and (group.point == last or group.done < group.runs)
        ]
        parts = (f"{progress.done} of {progress.total} missions", _failed(progress), *self._rate(progress))
        told = f"; {_METRIC}: {', '.join(means)}" if means else ""
        return f"suave-des: {self.label}: {', '.join(filter(None, parts))}{told}"

    def _rate(self, progress: Progress) -> tuple[str, str]:
        """Return missions a second, and the time that is left; empty where they are not known."""
        done, took_s, left = progress.done - self._before, self._last_s - self._first_s, progress.total - progress.done
        if not done or took_s <= 0.0:
            return "", ""
        rate = done / took_s
        return f"{rate:,.0f}/s" if rate >= 10.0 else f"{rate:.2g}/s", f"{duration(left / rate)} left" if left else ""

    def _starting(self) -> str:
        return f"starting, {duration(time.monotonic() - self._began_s)} {_FIRST_TIME}"

    def _name(self, group: GroupProgress) -> str:
        return f"{group.manager} at point {group.point + 1}" if self._groups[-1].point else group.manager


def _failed(progress: Progress) -> str:
    return f"{progress.failed:,} failed" if progress.failed else ""


def duration(seconds: float) -> str:
    """Return a human-readable duration: 8 s, 2 min 5 s, 3 h 20 min."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
