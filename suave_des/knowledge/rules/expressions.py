"""Class expressions and data ranges in the atoms of rules, which have no name: in words, as Protégé
writes them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from suave_des.knowledge.rdf import OWL, RDF, STRING, XSD, Lit, Triple, local_name

_BETWEEN = {"intersectionOf": " and ", "unionOf": " or "}
_BEFORE = ("complementOf", "datatypeComplementOf")
_QUANTIFIERS = {
    "someValuesFrom": "some",
    "allValuesFrom": "only",
    "hasValue": "value",
    "hasSelf": "self",
    **dict.fromkeys(("minCardinality", "minQualifiedCardinality"), "min"),
    **dict.fromkeys(("maxCardinality", "maxQualifiedCardinality"), "max"),
    **dict.fromkeys(("cardinality", "qualifiedCardinality"), "exactly"),
}
_FACETS = {
    "minInclusive": ">=",
    "minExclusive": ">",
    "maxInclusive": "<=",
    "maxExclusive": "<",
}


def in_words(triples: Sequence[Triple]) -> str:
    """Write an expression, whose first triple is about it: "hasValue some decimal[>= 2.5]"."""
    return _Writer(triples).text(triples[0][0])


class _Writer:
    def __init__(self, triples: Sequence[Triple]) -> None:
        self._about: dict[str, dict[str, str | Lit]] = {}
        for subject, predicate, value in triples:
            self._about.setdefault(subject, {})[predicate] = value
        self._above: list[str] = []

    def text(self, term: str | Lit) -> str:
        """Write a term; one that has no name, by what is said of it."""
        if isinstance(term, Lit):
            return f'"{term.text}"' if term.datatype == STRING else term.text
        if not term.startswith("_:") or term in self._above:
            return local_name(term)
        self._above.append(term)
        try:
            return self._node({local_name(name): each for name, each in self._parts(term)})
        finally:
            self._above.pop()

    def _parts(self, node: str) -> Iterator[tuple[str, str | Lit]]:
        parts = self._about.get(node, {})
        return ((name, parts[name]) for name in sorted(parts) if name.startswith((OWL, XSD)))

    def _node(self, parts: dict[str, str | Lit]) -> str:
        if "onProperty" in parts:
            return self._restriction(parts)
        if "onDatatype" in parts:
            facets = ", ".join(self._facets(parts["withRestrictions"]))
            return f"{self.text(parts['onDatatype'])}[{facets}]"
        if "oneOf" in parts:
            return f"{{{', '.join(map(self.text, self._list(parts['oneOf'])))}}}"
        for name in filter(parts.__contains__, (*_BETWEEN, *_BEFORE)):
            if name in _BEFORE:
                return f"not {self.text(parts[name])}"
            return f"({_BETWEEN[name].join(map(self.text, self._list(parts[name])))})"
        return "; ".join(f"{name} {self.text(each)}" for name, each in parts.items())

    def _restriction(self, parts: dict[str, str | Lit]) -> str:
        name = next((each for each in _QUANTIFIERS if each in parts), "")
        words = [self.text(parts["onProperty"]), _QUANTIFIERS.get(name, "")]
        if name not in ("", "hasSelf"):
            words.append(self.text(parts[name]))
        qualifiers = [parts[each] for each in ("onClass", "onDataRange") if each in parts]
        return " ".join([*words, *map(self.text, qualifiers[:1])])

    def _facets(self, start: str | Lit) -> Iterator[str]:
        """The facets of the nodes of a list."""
        for node in self._list(start):
            for name, value in sorted(self._about.get(str(node), {}).items()):
                if name.startswith((XSD, RDF + "langRange")):
                    word = local_name(name)
                    yield f"{_FACETS.get(word, word)} {self.text(value)}"

    def _list(self, node: str | Lit) -> Iterator[str | Lit]:
        seen = set[str | Lit]()
        while node not in seen and (parts := self._about.get(str(node), {})):
            seen.add(node)
            yield parts.get(RDF + "first", "")
            node = parts.get(RDF + "rest", RDF + "nil")
