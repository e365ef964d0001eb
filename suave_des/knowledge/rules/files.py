"""Files of rules as text, in addition to the rules of the ontologies."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from suave_des.errors import InputError
from suave_des.files import decode, read_bytes
from suave_des.knowledge.rules.checks import first_error
from suave_des.knowledge.rules.names import Vocabulary, rule_from_text
from suave_des.knowledge.rules.parser import ParsedRules, parse_rule, parse_rules
from suave_des.knowledge.rules.syntax import Rule, RuleError

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
        text = decode(path, read_bytes(path, MAX_BYTES))
        if text.lstrip().startswith("<?xml"):
            raise InputError("this is XML, not rules as text", file=path, remedy="give it with --ontology")
        text = text.replace("\r\n", "\n").replace("\r", "\n")
        return cls(path, text, parse_rules(text, path))

    def looked_up(self, vocabulary: Vocabulary) -> Iterator[tuple[str, Rule | RuleError]]:
        """Look up the names in its rules: each rule by its name, or why it cannot be read."""
        for parsed in self.parsed.rules:
            try:
                yield parsed.name, rule_from_text(parsed, vocabulary, self.path)
            except RuleError as error:
                yield parsed.name, error

    def checked(self, vocabulary: Vocabulary) -> Iterator[tuple[str, Rule | RuleError]]:
        """Look up and check its rules: each rule by its name, or why it cannot be used.

        Raises:
            RuleError: the text of a rule cannot be parsed; with line and column.
        """
        if self.parsed.errors:
            raise self.parsed.errors[0]
        for name, rule in self.looked_up(vocabulary):
            if isinstance(rule, Rule) and rule.enabled:
                yield name, first_error(rule, vocabulary) or rule
            else:
                yield name, rule

    def rules(self, vocabulary: Vocabulary) -> tuple[Rule, ...]:
        """Look up and check its rules.

        Raises:
            RuleError: a rule cannot be read or used; with line and column.
        """
        rules = []
        for _, rule in self.checked(vocabulary):
            if isinstance(rule, RuleError):
                raise rule
            rules.append(rule)
        return tuple(rules)


def read_rule(text: str, vocabulary: Vocabulary, file: Path) -> Rule:
    """Parse, look up and check one rule, as it is given on a command line.

    Args:
        text: "name: body -> head".
        vocabulary: of the ontologies.
        file: the name of the text in messages.

    Raises:
        RuleError: it is not one rule, or cannot be used.
    """
    rule = rule_from_text(parse_rule(text, file), vocabulary, file)
    error = first_error(rule, vocabulary)
    if error is not None:
        raise error
    return rule


def hash_with_rules(digest: str, texts: Iterable[str], disabled: Collection[str]) -> str:
    """Extend a content hash by rules as text, in their order, and by disabled rules."""
    parts = [*(f"rules {text}" for text in texts), *(f"disabled {name}" for name in sorted(set(disabled)))]
    if not parts:
        return digest
    total = hashlib.sha256(digest.encode())
    for part in parts:
        total.update(hashlib.sha256(part.encode()).digest())
    return total.hexdigest()
