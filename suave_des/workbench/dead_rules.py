"""Find the rules that can never fire, by an upper bound on what can hold in any state.

What no ontology asserts, no state adds and no rule that can fire concludes, cannot hold. Each property is considered
by itself, and individuals are not told apart. So a rule that is reported is dead, but not every dead rule is reported.
"""

from __future__ import annotations

from typing import Final

from suave_des.knowledge.content import Content
from suave_des.knowledge.model import Model
from suave_des.knowledge.rdf import LANGUAGE_NAMESPACES, OWL, RDF_TYPE, RDFS, TOMASYS, XSD, Lit, canonical
from suave_des.knowledge.rules.syntax import EXPRESSION, Atom, Named, Rule

_ANY: Final = "any value"
_ANY_TEXT: Final = "any text"
_SUBCLASS: Final = RDFS + "subClassOf"
_SPREADS: Final = (RDFS + "subPropertyOf", OWL + "inverseOf", OWL + "equivalentProperty")


class _Possible:
    """The classes that can have members, and the values that properties can have."""

    def __init__(self, content: Content, model: Model) -> None:
        self.structure = "".join(content.structure)
        self.classes: set[str] = {OWL + "Thing", *(TOMASYS + name for name in ("Objective", "FunctionGrounding"))}
        self.values: dict[str, set[object]] = {}
        self.axioms = [triple for triple in content.triples if triple[1].startswith(LANGUAGE_NAMESPACES)]
        for _, predicate, value in content.triples:
            if predicate == RDF_TYPE and isinstance(value, str) and not value.startswith(LANGUAGE_NAMESPACES):
                self.classes.add(value)
            elif not predicate.startswith(LANGUAGE_NAMESPACES):
                self.values.setdefault(predicate, set()).add(canonical(value) if isinstance(value, Lit) else value)
        for name in ("typeF", "typeFD", "solvesO", "o_always_improve"):
            self.values[TOMASYS + name] = {_ANY}
        for name in ("o_status", "c_status"):
            self.values.setdefault(TOMASYS + name, set()).add(_ANY_TEXT)
        if model.attributes:
            self.classes.add(TOMASYS + "QAvalue")
            self.values.update({TOMASYS + name: {_ANY} for name in ("isQAtype", "hasValue")})
        if any(model.estimated.values()):
            self.values[TOMASYS + "hasQAvalue"] = {_ANY}
        self.spread()

    def spread(self) -> None:
        """Follow subclasses, domains and ranges, and properties that hold because others do."""
        while True:
            before = len(self.classes), len(self.values), sum(map(len, self.values.values()))
            for subject, predicate, value in self.axioms:
                if not isinstance(value, str):
                    continue
                if predicate in (_SUBCLASS, OWL + "equivalentClass"):
                    if subject in self.classes:
                        self.classes.add(value)
                    if predicate != _SUBCLASS and value in self.classes:
                        self.classes.add(subject)
                elif predicate in (RDFS + "domain", RDFS + "range") and subject in self.values:
                    self.classes.add(value)
                elif predicate in _SPREADS:
                    for one, other in ((subject, value), (value, subject)):
                        if one in self.values:
                            self.values.setdefault(other, set()).add(_ANY)
            if before == (len(self.classes), len(self.values), sum(map(len, self.values.values()))):
                return

    def allows(self, atom: Atom) -> bool:
        """Whether an atom of a body can hold."""
        if atom.kind == "class":
            return atom.predicate in self.classes or atom.predicate == EXPRESSION or self._is_defined(atom.predicate)
        if atom.kind not in ("object", "data") or len(atom.arguments) != 2:
            return True
        values = self.values.get(atom.predicate)
        if values is None:
            return self._is_defined(atom.predicate)
        wanted = atom.arguments[1]
        if _ANY in values or not isinstance(wanted, Lit):
            return True
        return canonical(wanted) in values or (_ANY_TEXT in values and wanted.datatype == XSD + "string")

    def _is_defined(self, iri: str) -> bool:
        """Whether a class expression or a property chain mentions it; these are not followed here."""
        return f"<{iri}>" in self.structure

    def conclude(self, atom: Atom) -> None:
        """Add what an atom of a head asserts."""
        if atom.kind == "class":
            self.classes.add(atom.predicate)
        elif atom.kind in ("object", "data") and len(atom.arguments) == 2:
            value = atom.arguments[1]
            known = self.values.setdefault(atom.predicate, set())
            known.add(canonical(value) if isinstance(value, Lit) else _ANY)


def dead_rules(content: Content, model: Model) -> list[tuple[Rule, Atom]]:
    """Find the enabled rules that fire in no state, each with an atom of its body that can never hold."""
    possible = _Possible(content, model)
    waiting = list(content.enabled_rules)
    while True:
        firing = [rule for rule in waiting if all(map(possible.allows, rule.body))]
        if not firing:
            break
        for rule in firing:
            for atom in rule.head:
                possible.conclude(atom)
        possible.spread()
        waiting = [rule for rule in waiting if rule not in firing]
    return [(rule, next(atom for atom in rule.body if not possible.allows(atom))) for rule in waiting]


def unmeasured_rules(content: Content, model: Model) -> list[tuple[Rule, Atom, str]]:
    """Find the enabled rules that need a grounding's value (hasQAvalue) of an attribute of which no grounding has one.

    A grounding has the measured values of those attributes that its function design has an estimate of.

    Returns:
        each rule with the atom that names the attribute, and the attribute's name.
    """
    has_value, is_type = TOMASYS + "hasQAvalue", TOMASYS + "isQAtype"
    estimated = frozenset().union(*model.estimated.values())
    never = {iri: name for name, iri in model.attributes.items() if name not in estimated}
    if content.head_properties() & {has_value, is_type} or any(triple[1] == has_value for triple in content.triples):
        return []  # groundings have values from elsewhere, too
    found = []
    for rule in content.enabled_rules:
        held = {atom.arguments[-1] for atom in rule.body if atom.predicate == has_value}
        for atom in rule.body:
            if atom.predicate == is_type and len(atom.arguments) == 2 and atom.arguments[0] in held:
                term = atom.arguments[1]
                if isinstance(term, Named) and term.iri in never:
                    found.append((rule, atom, never[term.iri]))
    return found
