"""Checks of what ontologies say that Pellet would not make, or not explain."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from suave_des.errors import KnowledgeError
from suave_des.knowledge.model import EXACT, Names, value_of, wrong_in
from suave_des.knowledge.ontology_file import OntologyFile
from suave_des.knowledge.situation import Lit
from suave_des.knowledge.state import Value
from suave_des.knowledge.triples import Content
from suave_des.knowledge.vocabulary import OWL, RDF_TYPE, TOMASYS, local_name

#: Comparison operators that a quality attribute type may have.
OPERATORS: Final = ("<", "<=", ">", ">=")
_HAS_VALUE: Final = TOMASYS + "hasValue"
_OPERATOR: Final = TOMASYS + "qa_comparison_operator"
_KINDS: Final = {OWL + "ObjectProperty": False, OWL + "DatatypeProperty": True}


def check_values(content: Content, sources: Sequence[OntologyFile]) -> None:
    """See that numbers are decimals, operators known, and functional properties have one value each.

    A reasoner would not explain the first two. Of two values that an ontology asserts for one functional data
    property Pellet silently keeps the one that it read last.

    Raises:
        KnowledgeError: with the file and line of the individual.
    """
    functional = {s for s, p, o in content.triples if p == RDF_TYPE and o == OWL + "FunctionalProperty"}
    names = Names(content)
    seen: dict[tuple[str, str], Value] = {}
    for subject, predicate, value in content.triples:
        shown = value.text if isinstance(value, Lit) else value
        if predicate == _HAS_VALUE and not _is_decimal(value):
            raise wrong_in(subject, sources, f"hasValue {shown!r} is not an xsd:decimal", "a number such as 2.25")
        if predicate == _OPERATOR and shown not in OPERATORS:
            raise wrong_in(
                subject, sources, f"qa_comparison_operator {shown!r} is unknown", f"one of {' '.join(OPERATORS)}"
            )
        if predicate in functional and isinstance(value, Lit):
            one = value_of(value, names)
            other = seen.setdefault((subject, predicate), one)
            if one != other:
                name = local_name(predicate)
                raise wrong_in(
                    subject,
                    sources,
                    f"contradiction: the functional property {name} has the values {other} and {one}",
                    "keep one of them",
                )


def _is_decimal(value: str | Lit) -> bool:
    return (
        isinstance(value, Lit)
        and value.datatype in EXACT
        and re.fullmatch(r"\s*[+-]?(\d+(\.\d*)?|\.\d+)\s*", value.text, re.ASCII) is not None
    )


def check_rules(content: Content) -> None:
    """See that rules use each property as what it is declared.

    Where one does not, Pellet leaves out every rule with that property, and names the wrong ones.

    Raises:
        KnowledgeError: with the file and the rule.
    """
    declared = {s: _KINDS[o] for s, p, o in content.triples if p == RDF_TYPE and isinstance(o, str) and o in _KINDS}
    words = {True: "data", False: "object"}
    for rule in content.enabled_rules:
        for name, is_data in sorted(rule.properties):
            if declared.get(name, is_data) != is_data:
                raise KnowledgeError(
                    f"{local_name(name)} is declared as {words[not is_data]} property, but used as {words[is_data]} "
                    "property",
                    file=rule.file,
                    place=f"rule {rule.name}",
                    remedy=f"the rule is: {rule.text}",
                )
