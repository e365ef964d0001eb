"""Output of commands: styled on a terminal; elsewhere plain, and wide enough for the tables.

No control characters from files of others reach a terminal.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.progress import Progress
from rich.segment import Segment
from rich.text import Text

from suave_des.records.metrics import metric_of
from suave_des.tables import Table

if TYPE_CHECKING:
    from suave_des.metrics.result import MissionMetrics, MissionResult

_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202f\u205f-\u2069]")
"""Control characters but for tabs and ends of lines, and those that turn the direction of text, or
are not seen.
"""
TEXT_WIDTH = 95
"""Columns of text at most, which is hard to read in longer lines."""


def plain(text: str) -> str:
    r"""Return a text with \x1b and the like in place of control characters, which a terminal would obey."""
    return _CONTROL.sub(lambda found: found[0].encode("unicode_escape").decode(), text)


class PlainConsole(Console):
    """A console that writes text as it is: control characters as text, no markup, and lines that it
    does not wrap.
    """

    def __init__(self, **settings: Any) -> None:
        super().__init__(highlight=False, markup=False, emoji=False, **settings)

    def print(self, *objects: Any, **settings: Any) -> None:
        """Print; what is all text is left to the terminal to wrap, so that tools that search find
        whole lines.
        """
        is_text = all(isinstance(each, str | Text) for each in objects)
        super().print(*objects, **({"soft_wrap": is_text} | settings))

    def on_broken_pipe(self) -> None:
        """Leave the end to the command, whatever version of rich."""
        raise BrokenPipeError

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """Render to segments of text and style."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else segment._replace(text=plain(segment.text))


_PLAIN_WIDTH = 120
_NOT_FOUND = "not found: the time limit counts"


def output() -> Console:
    """The console for results."""
    console = PlainConsole()
    if not console.is_terminal and "COLUMNS" not in os.environ:
        console.width = _PLAIN_WIDTH
    return console


def errors() -> Console:
    """The console for errors and progress."""
    return PlainConsole(stderr=True)


@contextmanager
def counted(what: str, console: Console) -> Iterator[Callable[[int, int], None]]:
    """Show, while it takes and where the console is a terminal, how many of how many are done."""
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def print_table(console: Console, table: Table) -> None:
    """Print a table under its title, long names in it broken so that they fit."""
    console.print(Text(table.title, "bold"), table.text(console.width), sep="\n")


def print_timeline(console: Console, result: MissionResult) -> None:
    """Print a mission's events and metrics."""
    metrics = result.metrics
    title = f"{metrics.scenario}, manager {metrics.manager}, run {metrics.run}, seed {metrics.seed}"
    sources = max((len(event.source) for event in result.events), default=0)
    names = max((len(event.event) for event in result.events), default=0)
    heading = f"\n{'time, s':>8}  {'source':<{sources}}  {'event':<{names}}  detail"
    console.print(Text(title, "bold"))
    console.print(Text(heading, "italic"))
    for event in result.events:
        source = event.source.replace("_", " ")
        name = event.event.replace("_", " ")
        detail = " ".join(event.detail.splitlines())  # one of a manager's own may have several
        console.print(f"{event.t_s:8.2f}  {source:<{sources}}  {name:<{names}}  {detail}")
    console.print()
    rows = list(_metrics_rows(metrics, result.further))
    names = max(len(name) for name, _, _ in rows)
    values = max(len(value) for _, value, _ in rows)
    for name, value, remark in rows:
        console.print(f"{name:<{names}}  {value:>{values}}  {remark}".rstrip())


def _metrics_rows(
    metrics: MissionMetrics, further: Mapping[str, float | int | None]
) -> Iterator[tuple[str, str, str]]:
    """Name, value with its unit, and a remark on it."""
    reaction_s = metrics.mean_reaction_time_s
    remark = "" if metrics.pipeline_found else _NOT_FOUND
    yield "search time", f"{metrics.search_time_s:.1f} s", remark
    yield "distance inspected", f"{metrics.distance_inspected_m:.2f} m", ""
    if reaction_s is None:
        yield "mean reaction time", "none", "no reaction was completed"
    else:
        yield "mean reaction time", f"{reaction_s:.2f} s", ""
    yield "adaptations", str(metrics.adaptations), ""
    yield "mission duration", f"{metrics.mission_duration_s:.1f} s", ""
    for column, value in further.items():
        metric = metric_of(column)
        assert metric is not None  # a scenario can ask for no others
        if value is None:
            text = "none"
        elif isinstance(value, int):
            text = f"{value} {metric.unit}"
        else:
            text = f"{metric.number(value)} {metric.unit}"
        yield metric.title, text.strip(), ""
