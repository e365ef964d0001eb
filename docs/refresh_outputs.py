"""Run every code block of README and docs in full, and write anew what they show: python docs/refresh_outputs.py.

Pages named on the command line are done alone. It takes a minute or two. Look at the result before committing it.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from doc_blocks import IMAGES, PAGES, Block, run_page
from PIL import Image

_COLOURS = 128
"""A picture of lines needs no more, and takes a third of the space."""


def refresh(page: Path) -> bool:
    """Write a page's outputs and pictures anew; whether its text changed."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        done: list[tuple[Block, str]] = []
        for block, shown in run_page(page, folder, quick=False):
            done.append((block, shown))
            if "picture" in block.marks:
                picture = block.marks["picture"]
                Image.open(folder / picture).convert("RGB").quantize(_COLOURS).save(IMAGES / picture, optimize=True)
    before = page.read_text(encoding="utf-8")
    lines = before.splitlines(keepends=True)
    for block, shown in reversed(done):
        lines[block.line : block.line + len(block.text.splitlines())] = shown.splitlines(keepends=True)
    after = "".join(lines)
    page.write_text(after, encoding="utf-8")
    return after != before


def main(names: Sequence[str]) -> None:
    """Refresh the pages named, or all."""
    for page in [Path(name).resolve() for name in names] or PAGES:
        print(f"{page.name}: {'changed' if refresh(page) else 'as it was'}")


if __name__ == "__main__":
    main(sys.argv[1:])
