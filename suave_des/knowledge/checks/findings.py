"""The findings of a check of a knowledge base."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

from suave_des.errors import InputError, number_of
from suave_des.knowledge.ontology_file import OntologyFile, place_of


class Level(StrEnum):
    """Severity: an ERROR does not work as written, a WARN probably does not, an INFO is worth knowing."""

    ERROR = "ERROR"
    WARN = "WARN"
    INFO = "INFO"


_SEVERITY = {level: number for number, level in enumerate(Level)}
_NOUNS = {Level.ERROR: "error", Level.WARN: "warning", Level.INFO: "note"}


@dataclass(frozen=True, slots=True)
class Finding:
    """One finding.

    Attributes:
        level: its severity.
        message: what is wrong.
        file: where.
        line: in the file.
        rule: name of the rule, if it is about one.
        column: in the line for rules as text, in the rule's own text (as `kb rules --format json` gives it) for rules
            of ontologies.
        remedy: how to correct it.
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
        parts = (("line", self.line), ("rule", self.rule), ("column", self.column))
        place = ", ".join(f"{word} {value}" for word, value in parts if value)
        return ": ".join(filter(None, (self.file, place)))

    def __str__(self) -> str:
        """As one line of text."""
        line = ": ".join(filter(None, (self.where, self.message)))
        return f"{self.level:<5}  {line}" + (f" ({self.remedy})" if self.remedy else "")


def finding_from(error: InputError) -> Finding:
    """Convert an error into a finding, with the parts of its place."""
    place = error.place or ""
    line, column, rule = (re.search(pattern, place) for pattern in (r"line (\d+)", r"column (\d+)", r"^rule (.*)"))
    return Finding(
        Level.ERROR,
        error.problem,
        error.file,
        int(line.group(1)) if line else None,
        rule.group(1) if rule else None,
        int(column.group(1)) if column else None,
        error.remedy,
    )


def finding_about(
    name: str, sources: Sequence[OntologyFile], level: Level, message: str, remedy: str | None = None
) -> Finding:
    """Make a finding about an individual, with the file and line where it is described."""
    file, line = place_of(name, sources)
    return Finding(level, message, str(file), line, remedy=remedy)


def ordered(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Sort findings by severity, the worst first, then by place; drop duplicates, and shorten paths."""

    def key(one: Finding) -> tuple[object, ...]:
        return _SEVERITY[one.level], one.file or "", one.line or 0, one.rule or "", one.column or 0, str(one)

    shortened = (replace(one, file=relative_path(one.file) if one.file else None) for one in findings)
    return tuple(sorted(dict.fromkeys(shortened), key=key))


def has_level(findings: Sequence[Finding], least: Level) -> bool:
    """Whether one of the findings has at least that severity."""
    return any(_SEVERITY[one.level] <= _SEVERITY[least] for one in findings)


def folded(findings: Sequence[Finding], folder: Path) -> tuple[Finding, ...]:
    """Replace the notes on files of a folder, such as that of the shipped ontologies, by one that counts them."""

    def is_folded(one: Finding) -> bool:
        return one.level is Level.INFO and one.file is not None and Path(one.file).absolute().is_relative_to(folder)

    kept = [one for one in findings if not is_folded(one)]
    if notes := len(findings) - len(kept):
        message = f"{number_of(notes, 'note')} on the shipped ontologies, most on rules for other models"
        kept.append(Finding(Level.INFO, message, remedy="--verbose shows them"))
    return tuple(kept)


def summary(findings: Sequence[Finding]) -> str:
    """Count the findings of each level: "1 error, 0 warnings, 14 notes"."""
    counts = {noun: sum(one.level is level for one in findings) for level, noun in _NOUNS.items()}
    return ", ".join(number_of(count, noun) for noun, count in counts.items())


def relative_path(path: Path | str) -> str:
    """A path, relative to the current folder if it is in it."""
    whole = Path(path)
    return str(whole.relative_to(Path.cwd())) if whole.is_absolute() and whole.is_relative_to(Path.cwd()) else str(path)
