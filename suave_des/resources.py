"""Where the shipped ontologies, scenarios and modes files are, in a checkout and installed."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from suave_des.errors import InputError, did_you_mean, similar
from suave_des.files import sha256_of

DEFAULT_SCENARIO = "seams2023"
"""The paper's, where none is named."""
_PACKAGE = Path(__file__).resolve().parent
_KINDS = {
    "ontology": ".owl",
    "scenarios": ".yaml",
    "scenarios/revisions": ".yaml",
    "scenarios/vehicles": ".yaml",
    "scenarios/managers": ".csv",
    "scenarios/published": ".csv",
    "scenarios/ensembles": ".csv",
}


def shipped_folder(kind: str) -> Path:
    """Folder of shipped files of one kind, such as "ontology", "scenarios" or
    "scenarios/revisions".
    """
    installed = _PACKAGE / "shipped" / kind
    return installed if installed.is_dir() else _PACKAGE.parent / kind


def shown_name(path: Path) -> str:
    """Return the name of a file for users: "shipped/KIND/NAME" if it is shipped, else its path as
    given.
    """
    for kind in ("ontology", "scenarios"):
        if path.is_relative_to(folder := shipped_folder(kind)):
            return f"shipped/{kind}/{path.relative_to(folder).as_posix()}"
    return path.as_posix()


def hashes(paths: Iterable[Path], limit: int = 100_000_000) -> dict[str, str]:
    """Return the SHA-256 of files, in hex, by their names for users; raises as read_bytes does."""
    return {shown_name(path): sha256_of(path, limit) for path in paths}


def find(name: str | Path, kind: str, *, beside: Path | None = None) -> Path:
    """Resolve a file that the user named: a path wins over the shipped file of that name.

    Example:
        published = find("seams2023_runs", "scenarios/published")

    Args:
        name: a path, or the name of a shipped file with or without its ending.
        kind: as of shipped_folder.
        beside: folder of the file that names it, looked in instead of the current folder, so that a
            file means the same wherever the command is given.

    Raises:
        InputError: there is no such file, neither on disk nor shipped.
    """
    path = Path(name)
    candidates = [(beside or Path()) / path]
    if len(path.parts) == 1:
        candidates += [shipped_folder(kind) / f"{path}{ending}" for ending in ("", _KINDS[kind])]
    for candidate in candidates:
        if os.path.isfile(candidate):  # noqa: PTH113 - Path.is_file raises for a name that is too long
            return candidate
    if os.path.exists(candidates[0]):  # noqa: PTH110 - as above
        return candidates[0]  # whoever reads it says what it is
    raise InputError("no such file", file=path, remedy=_other_than(path, kind))


def _other_than(path: Path, kind: str) -> str:
    """The remedy for a name of which there is no file."""
    shipped = shipped_folder(kind).glob(f"*{_KINDS[kind]}")
    names = sorted(each.name if path.suffix else each.stem for each in shipped)
    # no scenarios
    known = [each for each in names if "modes" not in each or each == similar(path.name, names)]
    return did_you_mean(path.name, known, "give a path, or one of the shipped files")
