"""What a check of a knowledge base found."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from suave_des.errors import InputError


class Level(StrEnum):
    """How bad it is: ERROR does not do what it says, WARN probably not, INFO is good to know."""

    ERROR = "ERROR"
    WARN = "WARN"
    INFO = "INFO"


_ORDER = {Level.ERROR: 0, Level.WARN: 1, Level.INFO: 2}


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was found.

    Attributes:
        level: how bad it is.
        message: what is wrong.
        file: where.
        line: in the file.
        rule: name of the rule, if it is one.
        column: in the line for rules as text, in the rule's own text (as `kb rules --format json` gives it) for rules
            of ontologies.
        remedy: what would be right.
    """

    level: Level
    message: str
    file: str | None = None
    line: int | None = None
    rule: str | None = None
    column: int | None = None
    remedy: str | None = None

    @property
    def where(self) -> str:
        """File, line, rule and column, as far as they are known."""
        parts = [
            f"line {self.line}" if self.line else "",
            f"rule {self.rule}" if self.rule else "",
            f"column {self.column}" if self.column else "",
        ]
        place = ", ".join(filter(None, parts))
        return ": ".join(filter(None, (self.file, place)))

    def __str__(self) -> str:
        """As one line of text."""
        line = ": ".join(filter(None, (self.where, self.message)))
        return f"{self.level:<5}  {line}" + (f" ({self.remedy})" if self.remedy else "")


def finding_of(error: InputError, level: Level = Level.ERROR) -> Finding:
    """An error as a finding, its place taken apart."""
    place = error.place or ""
    line, column, rule = (re.search(pattern, place) for pattern in (r"line (\d+)", r"column (\d+)", r"^rule (.*)"))
    return Finding(
        level,
        error.problem,
        error.file,
        int(line.group(1)) if line else None,
        rule.group(1) if rule else None,
        int(column.group(1)) if column else None,
        error.remedy,
    )


def in_order(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Each finding once, the worst first, then by place."""
    return tuple(
        sorted(
            dict.fromkeys(findings),
            key=lambda one: (
                _ORDER[one.level],
                one.file or "",
                one.line or 0,
                one.rule or "",
                one.column or 0,
                str(one),
            ),
        )
    )


def fails(findings: Sequence[Finding], least: Level) -> bool:
    """Whether one of them is at least that bad."""
    return any(_ORDER[one.level] <= _ORDER[least] for one in findings)


def summary(findings: Sequence[Finding]) -> str:
    """How many of each level."""
    words = {Level.ERROR: "error", Level.WARN: "warning", Level.INFO: "note"}
    counts = {level: sum(one.level is level for one in findings) for level in Level}
    return ", ".join(f"{count} {words[level]}{'' if count == 1 else 's'}" for level, count in counts.items())


def shown_path(path: Path | str) -> str:
    """A path relative to the current folder where it is in it."""
    whole = Path(path)
    return str(whole.relative_to(Path.cwd())) if whole.is_absolute() and whole.is_relative_to(Path.cwd()) else str(path)
