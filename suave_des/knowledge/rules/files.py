"""Files of rules as text, besides the rules of the ontologies."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from suave_des.errors import InputError
from suave_des.knowledge.rules.checks import check_rule, first_error
from suave_des.knowledge.rules.names import Vocabulary, rule_from_text
from suave_des.knowledge.rules.parser import ParsedRules, parse_rules
from suave_des.knowledge.rules.syntax import Rule

MAX_BYTES: Final = 8 * 2**20


@dataclass(frozen=True)
class RulesFile:
    """A file of rules as text.

    Attributes:
        path: where it is.
        text: all of it.
        parsed: its rules, before their names are looked up, and its errors.
    """

    path: Path
    text: str
    parsed: ParsedRules

    @classmethod
    def read(cls, path: Path) -> RulesFile:
        """Read a file.

        Raises:
            InputError: it is missing, a folder, too large, or not text in UTF-8.
        """
        text = _read_text(path)
        return cls(path, text, parse_rules(text, path))

    def rules(self, vocabulary: Vocabulary) -> tuple[Rule, ...]:
        """Look up all names of its rules.

        Raises:
            RuleError: a rule cannot be read or used; with line and column.
        """
        if self.parsed.errors:
            raise self.parsed.errors[0]
        rules = tuple(rule_from_text(rule, vocabulary, self.path) for rule in self.parsed.rules)
        for rule in rules:
            error = first_error(rule, check_rule(rule, vocabulary)) if rule.enabled else None
            if error is not None:
                raise error
        return rules


def _read_text(path: Path) -> str:
    try:
        if path.is_dir():
            raise InputError("this is a folder", file=path, remedy="give a file of rules")
        if path.exists() and not path.is_file():  # a pipe would be waited for without end
            raise InputError("is not a regular file", file=path, remedy="give a file on disk")
        if path.stat().st_size > MAX_BYTES:
            raise InputError("too large for rules", file=path, remedy=f"at most {MAX_BYTES // 2**20} MiB are read")
        content = path.read_bytes()
    except FileNotFoundError as error:
        raise InputError("no such file", file=path, remedy="give an existing file of rules") from error
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path) from error
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise InputError("is not UTF-8 text", file=path, place=f"line {line}", remedy="save it as UTF-8") from error
    if text.lstrip().startswith("<?xml"):
        raise InputError("this is XML, not rules as text", file=path, remedy="give it with --ontology")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def hash_with_rules(digest: str, files: Iterable[RulesFile], disabled: Collection[str]) -> str:
    """Extend a content hash by files of rules, in their order, and by disabled rules."""
    parts = [*(f"rules {file.text}" for file in files), *(f"disabled {name}" for name in sorted(set(disabled)))]
    if not parts:
        return digest
    total = hashlib.sha256(digest.encode())
    for part in parts:
        total.update(hashlib.sha256(part.encode()).digest())
    return total.hexdigest()
