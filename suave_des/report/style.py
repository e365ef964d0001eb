"""The look of all figures: text width of a paper, small type, and colours that colour-blind readers tell apart."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import count
from typing import Any

import matplotlib
from matplotlib.figure import Figure

WIDTH_IN = 7.0
"""Text width of a two-column paper."""

# Okabe and Ito's palette, safe for colour-blind readers.
BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, VERMILION, PURPLE, GREY = "#0072B2", "#D55E00", "#CC79A7", "#8A8A8A"
CYCLE = (BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILION)
"""For what has no colour of its own, in this order."""
_KNOWN_MANAGERS = ("none", "random", "metacontrol", "bt")
"""They have the same look in every figure: that of their place here."""
_DASHES: tuple[Any, ...] = ("-", (0, (5, 1.5)), (0, (1, 1)), (0, (6, 1.5, 1, 1.5)), (0, (3, 1, 1, 1, 1, 1)))
_MARKERS = "osD^v<>PX"
_HATCHES = ("", "////", "....", "xxxx", "----", "\\\\\\\\")

MODE_COLOURS = {
    "fd_spiral_low": "#7FB8DA",
    "fd_spiral_medium": "#2F7FBC",
    "fd_spiral_high": "#0B3C73",
    "fd_follow_pipeline": ORANGE,
    "__DEFAULT__": PURPLE,
    "normal": GREEN,
}
"""The shipped modes: the higher the search, the darker the blue. A user's mode gets one of OTHER_MODES."""
MODE_WIDTHS = {"fd_spiral_low": 0.8, "fd_spiral_medium": 1.4, "fd_spiral_high": 2.0, "fd_follow_pipeline": 1.2}
"""Widths of lines, in points: the higher the search, the wider, so that they differ in print without colours, too."""
OTHER_MODES = (VERMILION, "#6A3D9A", "#B8860B")

_SETTINGS: Any = {
    "font.family": "sans-serif",
    "font.size": 8.0,
    "axes.titlesize": 8.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 8.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#E3E3E3",
    "grid.linewidth": 0.5,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "legend.fontsize": 7.5,
    "legend.frameon": False,
    "lines.linewidth": 1.2,
    "figure.dpi": 100,
    "savefig.dpi": 300,
    "pdf.fonttype": 42,  # text stays text
    "svg.fonttype": "none",
    "svg.hashsalt": "suave-des",  # equal data give equal files
}


def looks(names: Sequence[str]) -> list[int]:
    """Return for each manager the number of its look, which `line`, `marker` and `hatch` take."""
    others = count(len(_KNOWN_MANAGERS) if set(names).intersection(_KNOWN_MANAGERS) else 0)
    return [_KNOWN_MANAGERS.index(name) if name in _KNOWN_MANAGERS else next(others) for name in names]


def columns(panels: int) -> int:
    """Return the number of columns in which panels are arranged."""
    return 2 if panels == 4 else min(panels, 3)


def line(number: int) -> dict[str, Any]:
    """Return the look of the curve of a manager, by its number from 0: no two of thirty are alike, nor six in grey."""
    return {"color": CYCLE[number % len(CYCLE)], "linestyle": _DASHES[number % len(_DASHES)]}


def marker(number: int) -> str:
    """Return the marker of a manager, by its number from 0."""
    return _MARKERS[number % len(_MARKERS)]


def hatch(number: int) -> str:
    """Return the hatching of an area, by the number of its manager, for print without colours."""
    return _HATCHES[number % len(_HATCHES)]


def text(name: str) -> str:
    """Return a name as matplotlib is to show it: without formulas in it, and not hidden for a leading underscore."""
    return (f" {name}" if name.startswith("_") else name).replace("$", r"\$")


class Picture(Figure):
    """A figure that a notebook shows without further settings."""

    def _repr_png_(self) -> bytes:
        with publication():
            return png(self, dpi=160)


@contextmanager
def publication() -> Iterator[None]:
    """Draw figures in the one style; matplotlib's own settings are restored afterwards."""
    with matplotlib.rc_context(_SETTINGS):
        yield


def png(figure: Figure, dpi: int = 300) -> bytes:
    """Write a figure as PNG; equal figures give equal bytes."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=dpi, metadata={"Software": None})  # else matplotlib's version is in it
    return buffer.getvalue()
