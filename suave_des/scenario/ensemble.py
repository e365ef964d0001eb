"""Ensembles: parameter sets of scenarios that fit real missions equally well.

Unknown parameters of the real vehicle and its software are not noise, but the same in all its
missions. So each run has one member of an ensemble, the same under all managers, and a difference
between these can be analysed by member.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from suave_des.arguments import plain_arguments
from suave_des.errors import line_error, number_of
from suave_des.files import as_number, read_csv
from suave_des.resources import find

_NO_PARAMETERS = ("member", "loss")
_LIMIT_BYTES = 5_000_000


@dataclass(frozen=True)
class Ensemble:
    """Parameter sets that fit real missions equally well: for each member the values at the key
    paths of scenarios.
    """

    name: str
    paths: tuple[str, ...]
    members: tuple[tuple[float, ...], ...]

    def member(self, run: int) -> int:
        """Return the number, from 1, of the member that a run uses: they are used in turn."""
        return (run - 1) % len(self.members) + 1

    def values(self, member: int) -> dict[str, float]:
        """Return a member's values by key path."""
        return dict(zip(self.paths, self.members[member - 1], strict=True))


@plain_arguments
def read_ensemble(name: str | Path) -> tuple[Ensemble, Path, str]:
    """Read an ensemble: a CSV file with a column for each parameter and a row for each member.

    Example:
        ensemble, path, digest = read_ensemble("seams2023")
        print(len(ensemble.members), "parameter sets of", ensemble.paths)

    Args:
        name: of a file, or of a shipped one, such as seams2023. Its columns are named by the key
            paths of the scenario; columns `member` and `loss` are only for information.

    Returns:
        The ensemble, its path, and the SHA-256 of the file.

    Raises:
        InputError: with file and line: it cannot be read, has fewer than two members, or something
            else than numbers.
    """
    path = find(name, "scenarios/ensembles")
    header, rows, digest = read_csv(path, _LIMIT_BYTES, "a row for each member")
    paths = tuple(name for name in header if name not in _NO_PARAMETERS)
    if not paths or not all(header) or len(set(header)) < len(header):
        raise line_error(
            path,
            1,
            "has no column for each parameter",
            "name each once, by its key path in the scenario",
        )
    members = []
    for line, row in rows:
        numbers = {name: as_number(cell) for name, cell in zip(header, row, strict=False)}
        member = tuple(numbers.get(name, math.nan) for name in paths)
        if len(row) != len(header) or not all(map(math.isfinite, member)):
            problem = f"expected {len(header)} numbers, got {', '.join(row)}"
            raise line_error(path, line, problem, "give each column one")
        members.append(member)
    if len(members) < 2:
        raise line_error(
            path, 1, f"has {number_of(len(members), 'member')}", "an ensemble has two or more"
        )
    return Ensemble(path.stem, paths, tuple(members)), path, digest
