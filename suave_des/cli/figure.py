"""suave-des figure: a picture of a folder of results."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def figure(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Output folder of run, campaign or reproduce.")],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="Picture to write: .png, .pdf or .svg.")],
) -> None:
    """Draw a mission's map or a campaign's results.

    Which of the two depends on what is in DIR.
    """
    from suave_des.report.figures import draw_folder

    draw_folder(folder, out)
    print(f"drawn in {out}")
