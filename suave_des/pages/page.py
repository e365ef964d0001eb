"""Puts a page together: its HTML, styles, scripts and data in one file that loads nothing from
elsewhere.
"""

from __future__ import annotations

import base64
import gzip
import html
import json
import webbrowser
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from string import Template

from suave_des.files import DERIVED, write_beside, write_file


@cache
def asset(name: str) -> str:
    """Read a file of the pages, such as "replay.css"."""
    return files("suave_des.pages").joinpath("assets", name).read_text(encoding="utf-8")


def data_text(content: object) -> str:
    """Write plain data as JSON that may stand inside a script element: nothing in it can end the
    element.
    """
    text = json.dumps(content, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def compressed(text: str) -> str:
    """Compress text for a page, which expands it with the browser's own DecompressionStream."""
    return base64.b64encode(gzip.compress(text.encode(), 6, mtime=0)).decode()


def page(
    name: str,
    title: str,
    content: object,
    styles: Sequence[str],
    scripts: Sequence[str],
    library: str = "",
) -> str:
    """Put a page together of assets by their names, a title as plain text, and plain data.

    The scripts share one scope, in their order; `library` is compressed, and runs before what needs
    it.
    """
    # An expanded library is a blob.
    script_sources = "'unsafe-inline' blob:" if library else "'unsafe-inline'"
    return Template(asset("page.html")).substitute(
        script_sources=script_sources,
        title=html.escape(title),
        style="\n".join(map(asset, styles)),
        body=asset(name),
        data=data_text(content),
        library=library,
        script="(() => {\n'use strict';\n" + "\n".join(map(asset, scripts)) + "\n})();",
    )


def write_page(file: Path, text: str, *, show: bool) -> None:
    """Write a page, and open it in the user's browser if that is wanted.

    Raises:
        InputError: it cannot be written.
    """
    if file.name in DERIVED and (file.is_file() or not file.exists()):
        write_beside(file.parent, {file.name: text})
    else:
        write_file(file, text)
    if show:
        webbrowser.open(file.resolve().as_uri())
