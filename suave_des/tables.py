"""Tables of text, results that have tables, and how each form of output writes them: terminal,
Markdown, LaTeX, CSV.
"""

from __future__ import annotations

import json
import math
import re
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from textwrap import fill
from typing import TYPE_CHECKING, Any, NamedTuple

from suave_des.files import csv_text

if TYPE_CHECKING:
    import pandas

_LEAST_WIDTH = 12
"""A column of text is not made narrower than this, so that a table may be wider than it should
be.
"""
EFFECT = "effect"
"""Heading of the widest column, the last one, which goes where the table would be too wide."""
_BREAKS = re.compile(r"(?<=[:_./-])|(?<= )(?=[^\s=\d])|(?<=[^\W\d_A-ZÀ-Þ])(?=[A-ZÀ-Þ])")
"""Where a name may be broken: after a separator or space, but not in "(n = 20)", and before a
capital within a word.
"""
_MARKDOWN = str.maketrans(
    {**{character: f"\\{character}" for character in r"\`*_[]|"}, "<": "&lt;", ">": "&gt;"}
)
TableRow = dict[str, Any]
"""A row of a table of results: its values by column, of any type."""
LATEX_NEEDS = r"% needs \usepackage{array,booktabs}"
_LATEX_WIDTH_PT, _LATEX_COLUMN_PT = 345.0, 12.0
"""Text width of LaTeX's article, and what stands between two columns."""
_LATEX_CHARACTER_PT, _LATEX_SMALL_CHARACTER_PT = 5.0, 4.25
"""Widths of a digit in its own size and in small print."""
_NEGATIVE = re.compile(r"(?<![\w.])-\d[\d.,]*")
_LATEX = str.maketrans(
    {
        **{character: f"\\{character}" for character in "&%$#_{}"},
        "\\": r"\textbackslash{}",
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "<": r"\textless{}",
        ">": r"\textgreater{}",
        "|": r"\textbar{}",
        "\N{MINUS SIGN}": "$-$",
    }
)


@dataclass(frozen=True)
class Table:
    """Headings and rows of text.

        table = Table(("manager", "n"), [("none", "20"), ("metacontrol", "20")], "missions")
        print(table.text())

    Attributes:
        headings: of the columns.
        rows: cells; a row of a single cell is a heading of the rows below it.
        title: what the table has; empty: that is said elsewhere.
        align: "l" or "r" for each column; columns beyond it have numbers, and are aligned to the
            right.
    """

    headings: Sequence[str]
    rows: Sequence[Sequence[str]]
    title: str = ""
    align: str = "l"

    @property
    def _alignment(self) -> str:
        return self.align + "r" * (len(self.headings) - len(self.align))

    def _widths(self, width: float) -> list[int]:
        """Return the width of each column; of a table that is too wide, columns of text are made
        narrower.
        """
        rows = [self.headings, *(row for row in self.rows if len(row) > 1)]
        columns = list(zip(*rows, strict=True))
        widths = list(map(_widest_line, columns))
        narrow = [place for place, side in enumerate(self._alignment) if side == "l"]
        while sum(widths) + 2 * (len(widths) - 1) > width:
            widest = max(narrow, key=lambda place: widths[place], default=None)
            if widest is None or widths[widest] <= _LEAST_WIDTH:
                break
            widths[widest] -= 1
        for place in narrow:  # what was broken into lines may need even less
            room = widths[place]
            widths[place] = _widest_line(broken_name(cell, room) for cell in columns[place])
        return widths

    def text(self, width: int | None = None) -> str:
        """Write the table for a terminal, without its title; texts that make it wider are broken
        into lines.
        """
        return "\n".join(self._lines(self._widths(math.inf if width is None else width)))

    def without_effect(self, width: int) -> Table:
        """Return the table without its last column if that is the effect, and makes it wider."""
        if self.headings[-1] != EFFECT or _widest_line([self.text()]) <= width:
            return self
        return Table(self.headings[:-1], [row[:-1] for row in self.rows])

    def _lines(self, widths: Sequence[int]) -> Iterator[str]:
        for row in (self.headings, *self.rows):
            if len(row) == 1 < len(widths):
                yield row[0]
                continue
            broken = [
                broken_name(cell, width).split("\n")
                for cell, width in zip(row, widths, strict=True)
            ]
            for parts in zip_longest(*broken, fillvalue=""):
                sides = zip(parts, self._alignment, widths, strict=True)
                yield "  ".join(
                    f"{part:{'<' if side == 'l' else '>'}{width}}" for part, side, width in sides
                ).rstrip()

    def markdown(self) -> str:
        """Write the table as Markdown, without its title."""
        marks = " | ".join("---" if side == "l" else "---:" for side in self._alignment)
        lines = [f"| {' | '.join(map(markdown_text, self.headings))} |", f"| {marks} |"]
        for row in self.rows:
            cells = [*row, *[""] * (len(self.headings) - len(row))]
            lines.append(f"| {' | '.join(map(markdown_text, cells))} |")
        return "\n".join(lines)

    def latex(self, over: Sequence[str] = (), *, label: str = "", note: str = "") -> str:
        """Write the table for LaTeX with booktabs, its title as caption, with a label for
        references and a note below.

        Headings `over` those of the table are over as many columns each, all but the first. A wide
        table is in small print, and breaks what is in its first column.
        """
        columns = len(self.headings)
        characters = sum(self._widths(math.inf))
        room_pt = _LATEX_WIDTH_PT - _LATEX_COLUMN_PT * columns
        lines = [r"\begin{table}", r"  \centering", rf"  \caption{{{latex_text(self.title)}}}"]
        lines += [rf"  \label{{{label}}}"] if label else []
        alignment = self._alignment
        if characters * _LATEX_CHARACTER_PT > room_pt:
            lines.append(r"  \footnotesize")
            if characters * _LATEX_SMALL_CHARACTER_PT > room_pt:
                alignment = r">{\raggedright\arraybackslash}p{0.31\linewidth}" + alignment[1:]
        lines += [rf"  \begin{{tabular}}{{{alignment}}}", r"    \toprule"]
        if over:
            lines += _latex_over(over, (columns - 1) // len(over))
        lines.append(_latex_row(map(latex_text, self.headings)))
        if not self.rows or len(self.rows[0]) > 1:
            lines.append(r"    \midrule")
        for row in self.rows:
            if len(row) == 1 < columns:
                lines += [
                    r"    \midrule",
                    rf"    \multicolumn{{{columns}}}{{l}}{{{latex_text(row[0])}}} \\",
                ]
            else:
                lines.append(_latex_row([latex_text(row[0]), *map(_latex_number, row[1:])]))
        below = [rf"  \par\smallskip\footnotesize {latex_text(note)}"] if note else []
        return "\n".join([*lines, r"    \bottomrule", r"  \end{tabular}", *below, r"\end{table}"])

    def csv(self) -> str:
        """Write the table as CSV."""
        return csv_text(self.headings, self.rows)

    def _repr_markdown_(self) -> str:
        return f"{markdown_text(self.title)}\n\n{self.markdown()}"


def _widest_line(cells: Iterable[str]) -> int:
    return max(len(line) for cell in cells for line in cell.split("\n"))


class Section(NamedTuple):
    """A part of what is written: tables under a title, what is said below them, and what follows
    from them.
    """

    title: str
    tables: Sequence[Table]
    sentences: Sequence[str] = ()
    below: str = ""


class Written(ABC):
    """Results that are written as text, Markdown, LaTeX, CSV and JSON.

    Attributes:
        conclusion: of all of them, in a sentence.
        notes: what a reader should know about the data.
    """

    conclusion: str
    notes: tuple[str, ...]

    @abstractmethod
    def sections(self) -> Iterator[Section]:
        """Yield the tables of each metric, and others."""

    @abstractmethod
    def remarks(self) -> list[str]:
        """Describe how the results were found, and what to know about the data."""

    @abstractmethod
    def frames(self) -> dict[str, pandas.DataFrame]:
        """Return the statistics by what JSON calls them."""

    def written(self, form: str, width: int = 95) -> str:
        """Write the result as "table", which is text of that width, "csv", "json", "markdown" or
        "latex".
        """
        if form == "table":
            return self.text(width)
        writers = {
            "csv": self.csv,
            "json": self.json,
            "markdown": self.markdown,
            "latex": self.latex,
        }
        return writers[form]()

    def text(self, width: int = 95) -> str:
        """Write the conclusions, the tables, and the remarks, for a terminal of that width."""
        parts = [folded(self.conclusion, width)]
        for title, tables, sentences, below in self.sections():
            for place, table in enumerate(tables):
                lines = [table.without_effect(width).text(width)]
                if place == 0:
                    lines.insert(0, title)
                elif table.title:
                    lines.insert(0, f"{title}, {table.title}")
                if below:
                    lines.append(below)
                parts.append("\n".join(lines))
            parts.append("\n".join(folded(f"- {each}", width) for each in sentences))
        parts.append("\n".join(folded(line, width) for line in self.remarks()))
        return "\n\n".join(filter(None, parts)) + "\n"

    def __str__(self) -> str:
        """Return all of it as text, as `suave-des compare` prints it."""
        return self.text()

    def markdown(self) -> str:
        """Write the tables and the conclusions, for a page."""
        parts = [markdown_text(self.conclusion)]
        for title, tables, sentences, below in self.sections():
            parts.append(f"### {capital(title)}" if title else "")
            for table in tables:
                parts += [
                    f"{capital(table.title)}:" if table.title else "",
                    table.markdown(),
                    markdown_text(below),
                ]
            parts.append("\n".join(f"- {markdown_text(each)}" for each in sentences))
        return "\n\n".join(filter(None, [*parts, *map(markdown_text, self.remarks())])) + "\n"

    def _repr_markdown_(self) -> str:
        return self.markdown()

    def latex(self) -> str:
        """Write the tables for LaTeX with booktabs."""
        tables = [
            Table(each.headings, each.rows, title)
            for title, own, *_ in self.sections()
            for each in own
        ]
        notes = [""] * (len(tables) - 1) + [" ".join(self.remarks())]
        parts = [table.latex(note=note) for table, note in zip(tables, notes, strict=True)]
        return "\n".join([LATEX_NEEDS, *parts]) + "\n"

    def csv(self) -> str:
        """Write all statistics as one table."""
        import pandas  # takes a while, and most tables need none

        frames = [each.astype(object) for each in self.frames().values() if len(each)]
        frame = pandas.concat(frames or [pandas.DataFrame()])
        if "other" in frame:
            frame.insert(1, "other", frame.pop("other"))
        return frame.to_csv(index=False, lineterminator="\n")

    def json(self) -> str:
        """Write all of it; numbers with all their digits, null where there is none."""
        return json.dumps(self._content(), indent=2, ensure_ascii=False, allow_nan=False) + "\n"

    def _content(self) -> dict[str, object]:
        about = {"conclusion": self.conclusion, "notes": self.notes}
        return about | {name: rows_of(frame) for name, frame in self.frames().items()}


def rows_of(frame: pandas.DataFrame) -> list[TableRow]:
    """Return the rows of a frame as plain data."""
    found: list[TableRow] = frame.astype(object).where(frame.notna(), None).to_dict("records")  # type: ignore[assignment]
    return found


def folded(text: str, width: int) -> str:
    """Break a paragraph into lines for a terminal of that width."""
    return fill(
        text, width, subsequent_indent="  " if text.startswith("- ") else "", break_on_hyphens=False
    )


def capital(text: str) -> str:
    """Begin a text with a capital, and leave the rest as it is."""
    return text[:1].upper() + text[1:]


def printable(name: str) -> str:
    """Return a name from a file without terminal control characters."""
    return name if name.isprintable() else repr(name)[1:-1]


def listed(parts: Sequence[str], most: int = 6) -> str:
    """Write the first of several parts, and how many more there are."""
    more = len(parts) - most
    return ", ".join(parts[:most]) + (f" and {more} more" if more > 0 else "")


def broken_name(name: str, width: int, indent: str = "  ") -> str:
    """Break a long name into lines, the further ones indented, so that it leaves room for what is
    beside it.
    """
    if max(map(len, name.split("\n"))) <= width:
        return name
    lines = [""]
    for piece in _BREAKS.split(name):
        if lines[-1].strip() and len(lines[-1]) + len(piece.rstrip()) > width:
            lines.append(indent)
        lines[-1] += piece
    return "\n".join(line.rstrip() for line in lines)


def markdown_text(text: str) -> str:
    """Write text so that Markdown shows it as it is."""
    return text.translate(_MARKDOWN)


def latex_text(text: str) -> str:
    """Write text so that LaTeX shows it as it is."""
    return text.translate(_LATEX)


def _latex_over(headings: Sequence[str], columns: int) -> list[str]:
    """Write headings over so many columns each, all but the first one."""
    heads = [rf"\multicolumn{{{columns}}}{{c}}{{{latex_text(each)}}}" for each in headings]
    begins = range(2, 2 + len(headings) * columns, columns)
    rules = [rf"\cmidrule(lr){{{begin}-{begin + columns - 1}}}" for begin in begins]
    return [_latex_row(["", *heads]), f"    {' '.join(rules)}"]


def _latex_row(cells: Iterable[str]) -> str:
    return f"    {' '.join(' & '.join(cells).split())} \\\\"


def _latex_number(cell: str) -> str:
    """Write a cell of numbers: with a minus, and powers of ten."""
    mantissa, is_power, exponent = cell.partition("e-")
    if is_power:
        return rf"${mantissa} \cdot 10^{{-{int(exponent)}}}$"
    return _NEGATIVE.sub(r"$\g<0>$", latex_text(cell))
