"""A problem with its place and level: what checks of rules, ontologies and scenarios find."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Final

from suave_des.errors import InputError, number_of


class Level(StrEnum):
    """Severity: an ERROR does not work as written, a WARN probably does not, an INFO is worth knowing."""

    ERROR = "ERROR"
    WARN = "WARN"
    INFO = "INFO"


_SEVERITY: Final = {level: number for number, level in enumerate(Level)}
_NOUNS: Final = {Level.ERROR: "error", Level.WARN: "warning", Level.INFO: "note"}


@dataclass(frozen=True, slots=True)
class Finding:
    """One finding.

        Finding(Level.WARN, "the rule never fires", "mine.swrl", line=3, rule="Low", column=12)

    Attributes:
        level: its severity.
        message: what is wrong.
        file: where.
        line: in the file.
        rule: name of the rule, if it is about one.
        column: in the line, for rules as text.
        remedy: how to correct it.
    """

    level: Level
    message: str
    file: str | None = None
    line: int | None = None
    rule: str | None = None
    column: int | None = None
    remedy: str | None = None

    @classmethod
    def of(cls, error: InputError) -> Finding:
        """Make a finding of an error, with the parts of its place."""
        place = error.place or ""
        line, column, rule = (re.search(pattern, place) for pattern in (r"line (\d+)", r"column (\d+)", r"^rule (.*)"))
        return cls(
            Level.ERROR,
            error.problem,
            error.file,
            int(line.group(1)) if line else None,
            rule.group(1) if rule else None,
            int(column.group(1)) if column else None,
            error.remedy,
        )

    @property
    def where(self) -> str:
        """File, line, rule and column, as far as they are known."""
        parts = (("line", self.line), ("rule", self.rule), ("column", self.column))
        place = ", ".join(f"{word} {value}" for word, value in parts if value)
        return ": ".join(filter(None, (self.file, place)))

    def __str__(self) -> str:
        """As one line of text."""
        line = ": ".join(filter(None, (self.where, self.message)))
        return f"{self.level:<5}  {line}" + (f" ({self.remedy})" if self.remedy else "")


def ordered(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Sort findings by severity, the worst first, then by place; drop duplicates, and shorten paths."""

    def key(one: Finding) -> tuple[object, ...]:
        return _SEVERITY[one.level], one.file or "", one.line or 0, one.rule or "", one.column or 0, str(one)

    shortened = (replace(one, file=relative_path(one.file) if one.file else None) for one in findings)
    return tuple(sorted(dict.fromkeys(shortened), key=key))


def has_level(findings: Iterable[Finding], least: Level) -> bool:
    """Whether one of the findings has at least that severity."""
    return any(_SEVERITY[one.level] <= _SEVERITY[least] for one in findings)


def summary(findings: Sequence[Finding]) -> str:
    """Count the findings of each level: "1 error, 0 warnings, 14 notes"."""
    counts = {noun: sum(one.level is level for one in findings) for level, noun in _NOUNS.items()}
    return ", ".join(number_of(count, noun) for noun, count in counts.items())


def relative_path(path: Path | str) -> str:
    """A path, relative to the current folder if it is in it."""
    whole = Path(path)
    return str(whole.relative_to(Path.cwd())) if whole.is_absolute() and whole.is_relative_to(Path.cwd()) else str(path)
