"""Run every code block of README and docs in full, and rewrite what they show.

    python docs/refresh_outputs.py [--check] [PAGE ...]

With `--check` nothing is written: differences are printed, down to the last digit, and any makes
the exit status 1. Long forms are run where tests run short ones (`test="--runs 3"`), which takes
some minutes.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from difflib import unified_diff
from pathlib import Path

from doc_blocks import IMAGES, PAGES, ROOT, run_page
from PIL import Image, ImageChops, ImageStat

_COLOURS = 128
"""A picture of lines needs no more, and takes a third of the space."""
_MEAN_DIFFERENCE = 0.5
"""Of 255 levels, between a picture and the same drawn again: fonts are rendered differently on
other machines.
"""


def refresh(page: Path, *, check: bool) -> list[str]:
    """Run a page in full, and rewrite its outputs and pictures unless they are to be checked only.

    Args:
        page: the file.
        check: whether to leave the page as it is.

    Returns:
        Lines that say what differed: a diff of the text, and the names of pictures.
    """
    before = page.read_text(encoding="utf-8")
    lines = before.splitlines(keepends=True)
    pictures = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        done = []
        for block, shown in run_page(page, folder, quick=False):
            done.append((block, shown))
            if "picture" in block.marks and _redraw(folder / block.marks["picture"], check=check):
                pictures.append(f"{block.place}: {block.marks['picture']} is drawn differently\n")
    for block, shown in reversed(done):
        lines[block.line : block.line + len(block.text.splitlines())] = shown.splitlines(
            keepends=True
        )
    after = "".join(lines)
    if not check and after != before:
        page.write_text(after, encoding="utf-8")
    shown_as = str(page.relative_to(ROOT))
    return [
        *unified_diff(
            before.splitlines(True), after.splitlines(True), shown_as, f"{shown_as}, now", n=0
        ),
        *pictures,
    ]


def _redraw(drawn: Path, *, check: bool) -> bool:
    """Whether a picture differs from the one in docs/images, which is replaced then unless it is to
    be checked only.
    """
    kept = IMAGES / drawn.name
    with Image.open(drawn) as opened:
        picture = opened.convert("RGB")
    if kept.exists():
        with Image.open(kept) as opened:
            old = opened.convert("RGB")
        if (
            old.size == picture.size
            and max(ImageStat.Stat(ImageChops.difference(old, picture)).mean) < _MEAN_DIFFERENCE
        ):
            return False
    if not check:
        picture.quantize(_COLOURS).save(kept, optimize=True)
    return True


def main() -> None:
    """Refresh or check the pages named, or all."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--check", action="store_true", help="write nothing, and fail where something differs"
    )
    parser.add_argument(
        "pages", nargs="*", metavar="PAGE", type=Path, help="default: all whose blocks are run"
    )
    arguments = parser.parse_args()
    different = 0
    for page in [path.resolve() for path in arguments.pages] or PAGES:
        began_s = time.monotonic()
        found = refresh(page, check=arguments.check)
        what = "as printed" if not found else "DIFFERS" if arguments.check else "rewritten"
        print(f"{page.relative_to(ROOT)}: {what} ({time.monotonic() - began_s:.0f} s)", flush=True)
        if found and arguments.check:
            print("".join(found), flush=True)
        different += bool(found)
    sys.exit(1 if arguments.check and different else 0)


if __name__ == "__main__":
    main()
