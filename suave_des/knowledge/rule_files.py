"""Rules as text besides those of the ontologies, and rules switched off for a time."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from suave_des.errors import KnowledgeError
from suave_des.knowledge.rule_checks import check_rule, first_error
from suave_des.knowledge.rule_names import Vocabulary, rule_from_text
from suave_des.knowledge.rule_parser import ParsedRules, parse_rules, read_rules_file
from suave_des.knowledge.rules import Rule
from suave_des.knowledge.triples import Content
from suave_des.knowledge.vocabulary import nearest


@dataclass(frozen=True)
class RulesFile:
    """A file of rules as text.

    Attributes:
        path: where it is.
        text: all of it.
        parsed: its rules, before their names are looked up, and what is wrong with it.
    """

    path: Path
    text: str
    parsed: ParsedRules

    @classmethod
    def read(cls, path: Path) -> RulesFile:
        """Read a file.

        Raises:
            InputError: it is missing, or no text.
        """
        text = read_rules_file(path)
        return cls(path, text, parse_rules(text, path))

    def rules(self, vocabulary: Vocabulary) -> tuple[Rule, ...]:
        """Its rules with all names looked up.

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


def with_rules(content: Content, more: Iterable[Sequence[Rule]], disabled: Collection[str]) -> Content:
    """Content with the rules of text files, and some rules switched off.

    A file's rules take the place of all rules of the same names that were read before, of the ontologies or of
    files: so a rule can be tried in another wording, or switched off by its mark.

    Raises:
        KnowledgeError: there is no rule of a name to switch off.
    """
    rules = list(content.rules)
    for group in more:
        names = {rule.name for rule in group}
        rules = [rule for rule in rules if rule.name not in names] + list(group)
    known = {rule.name for rule in rules}
    for name in sorted(set(disabled) - known):
        raise KnowledgeError(
            f"there is no rule {name} to switch off",
            place=f"disabled_rules.{name}",
            remedy=nearest(name, known) or f"rules: {', '.join(sorted(known)) or 'none'}",
        )
    return replace(
        content,
        rules=tuple(
            replace(rule, enabled=rule.enabled and rule.name not in disabled)
            for rule in sorted(rules, key=lambda rule: (rule.name, rule.text, str(rule.file)))
        ),
    )


def hash_with_rules(digest: str, files: Iterable[RulesFile], disabled: Collection[str]) -> str:
    """A content hash that also stands for files of rules, in their order, and for rules switched off."""
    parts = [*(f"rules {file.text}" for file in files), *(f"disabled {name}" for name in sorted(set(disabled)))]
    if not parts:
        return digest
    total = hashlib.sha256(digest.encode())
    for part in parts:
        total.update(hashlib.sha256(part.encode()).digest())
    return total.hexdigest()
