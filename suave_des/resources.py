"""Where the shipped ontologies, scenarios and modes files are, in a checkout and in an installed copy."""

from __future__ import annotations

from pathlib import Path

from suave_des.errors import InputError

_PACKAGE = Path(__file__).resolve().parent
_KINDS = {"ontology": ".owl", "scenarios": ".yaml"}


def shipped_folder(kind: str) -> Path:
    """Folder of shipped files of one kind: "ontology" or "scenarios"."""
    installed = _PACKAGE / "shipped" / kind
    return installed if installed.is_dir() else _PACKAGE.parent / kind


def find(name: str | Path, kind: str, *, beside: Path | None = None) -> Path:
    """Resolve a file that the user named: a path wins over the shipped file of that name.

    Args:
        name: a path, or the name of a shipped file with or without its ending.
        kind: "ontology" or "scenarios".
        beside: folder of the file that names it, tried before the current folder.

    Raises:
        InputError: there is no such file, neither on disk nor shipped.
    """
    path = Path(name)
    folders = [beside] if beside is not None and not path.is_absolute() else []
    candidates = [folder / path for folder in folders] + [path]
    if len(path.parts) == 1:
        shipped = shipped_folder(kind) / path
        candidates += [shipped, shipped.with_name(path.name + _KINDS[kind])]
    for candidate in candidates:
        if candidate.is_file():
            return candidate
    known = ", ".join(sorted(entry.name for entry in shipped_folder(kind).glob(f"*{_KINDS[kind]}")))
    raise InputError("no such file", file=path, remedy=f"give a path, or one of the shipped files: {known}")
