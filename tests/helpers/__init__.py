"""Helpers that test modules share: stand-ins, files and managers to try things with, commands in
processes.
"""

import csv
from pathlib import Path

AWKWARD = "tests.helpers.awkward_managers"
"""Module of managers that misbehave, to be named as f"{AWKWARD}:CLASS"."""
OUTSIDE = "tests.helpers.outside_managers"
"""Module of managers as users write them."""


def rows_of(file: Path) -> list[dict[str, str]]:
    """The rows of a CSV file; of a folder, those of its runs.csv."""
    with (file / "runs.csv" if file.is_dir() else file).open(
        newline="", encoding="utf-8"
    ) as stream:
        return list(csv.DictReader(stream))
