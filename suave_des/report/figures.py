"""Figures of a folder of results: a mission's map, a campaign's distributions, or what a sweep shows."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from suave_des.errors import InputError

ENDINGS = (".png", ".pdf", ".svg")


def draw_folder(folder: Path, out: Path) -> None:
    """Draw what is in a folder of results, and write the picture.

    Args:
        folder: output folder of a mission (trajectory.csv) or of a campaign (runs.csv).
        out: picture to write; its ending says which kind.

    Raises:
        InputError: there are no results in the folder, or the picture cannot be written.
    """
    if out.suffix.lower() not in ENDINGS:
        raise InputError(
            f"{out.suffix or 'no ending'} is no kind of picture", file=out, remedy=f"one of {', '.join(ENDINGS)}"
        )
    # matplotlib and pandas take a second to import
    import suave_des.report.distributions as distributions
    import suave_des.report.mission_map as mission_map
    import suave_des.report.style as style
    import suave_des.report.sweep as sweep

    with style.publication():
        if (folder / "trajectory.csv").is_file():
            picture = mission_map.draw(folder)
        elif (folder / "runs.csv").is_file() and (swept := sweep.swept_parameters(folder)):
            picture = sweep.draw(folder, swept)
        elif (folder / "runs.csv").is_file():
            picture = distributions.draw(folder / "runs.csv")
        else:
            raise InputError(
                "has neither trajectory.csv nor runs.csv",
                file=folder,
                remedy="give the --out folder of suave-des run, campaign or reproduce",
            )
        temporary = out.with_name(f".{os.getpid()}{out.suffix}")
        try:
            picture.savefig(temporary)
            temporary.replace(out)
        except OSError as error:
            raise InputError(
                f"cannot be written: {error.strerror}", file=out, remedy="give a path in a folder that is yours"
            ) from None
        finally:
            with suppress(OSError):  # there may not even be a folder
                temporary.unlink()
