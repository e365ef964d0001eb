"""What reaches the terminal: characters that it has, and no control characters from files of others."""

from __future__ import annotations

import codecs
import sys
from collections.abc import Iterable

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

_IN_ASCII = {"±": "+-", "–": "-", "—": "-", "…": "...", "×": "x", "≥": ">=", "≤": "<=", "−": "-", "→": "->", "█": "#"}
_ERRORS = "suave-des-in-ascii"


def _replaced(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(_IN_ASCII.get(char, "?") for char in error.object[error.start : error.end]), error.end


def write_what_the_terminal_has() -> None:
    """Have characters that the terminal's encoding lacks written in others, instead of failing."""
    codecs.register_error(_ERRORS, _replaced)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure") and (stream.encoding or "").lower().replace("-", "") != "utf8":
            stream.reconfigure(errors=_ERRORS)


def plain(text: str) -> str:
    r"""Return a text with \x1b and the like in place of control characters, which a terminal would obey."""
    if text.isprintable():
        return text
    return "".join(char if char.isprintable() or char in "\n\t" else _escaped(char) for char in text)


def _escaped(char: str) -> str:
    return char.encode("unicode_escape").decode() if char < "\xa0" or 0x202A <= ord(char) <= 0x2069 else char


class PlainConsole(Console):
    """A console that writes control characters in what it is given as text."""

    def on_broken_pipe(self) -> None:
        """Leave the end to the command, whatever version of rich."""
        raise BrokenPipeError

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Render to segments of text and style."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else segment._replace(text=plain(segment.text))
