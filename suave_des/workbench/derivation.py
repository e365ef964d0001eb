"""Derivations: how a fact follows, as a tree of rules with their bindings down to what is asserted."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from suave_des.knowledge.state import Fact, Value


@dataclass(frozen=True)
class Derivation:
    """How a fact follows.

    Attributes:
        fact: what follows.
        source: "state" or "ontology" where it is asserted, "rule", or "axioms" where it follows from the schema.
        rule: the rule's name.
        bindings: value of each of the rule's variables, by variable.
        premises: the facts of the rule's body, instantiated.
        axioms: what of the schema was used.
    """

    fact: Fact
    source: str
    rule: str | None = None
    bindings: tuple[tuple[str, Value], ...] = ()
    premises: tuple[Derivation, ...] = ()
    axioms: tuple[str, ...] = ()

    def __str__(self) -> str:
        """As a tree of lines."""
        return "\n".join(self.lines())

    def lines(self, indent: str = "") -> Iterator[str]:
        """The fact and how it follows, and below it, indented, all that it rests on."""
        bindings = ", ".join(f"?{name} = {value}" for name, value in self.bindings)
        how = {
            "rule": f"by rule {self.rule}" + (f" with {bindings}" if bindings else ""),
            "axioms": f"by the schema: {'; '.join(self.axioms)}" if self.axioms else "by the schema",
            "state": "given in the state",
            "ontology": "asserted in the ontology",
        }[self.source]
        yield f"{indent}{self.fact}  [{how}]"
        for premise in self.premises:
            yield from premise.lines(indent + "  ")

    def leaves(self) -> Iterator[Derivation]:
        """The asserted facts that it rests on."""
        if not self.premises:
            yield self
        for premise in self.premises:
            yield from premise.leaves()

    def grounds(self) -> frozenset[tuple[str, str]]:
        """(subject, property) of all facts that it rests on, itself not among them."""
        direct = frozenset((premise.fact.subject, premise.fact.property) for premise in self.premises)
        return direct.union(*(premise.grounds() for premise in self.premises))

    def rules(self) -> frozenset[str]:
        """Names of all rules in it."""
        own = frozenset({self.rule} if self.rule is not None else ())
        return own.union(*(premise.rules() for premise in self.premises))


@dataclass(frozen=True)
class Clash:
    """A contradiction: one thing would have two values of a functional property.

    Attributes:
        subject, property: of what.
        sides: how each of the values follows.
    """

    subject: str
    property: str
    sides: tuple[Derivation, ...]
