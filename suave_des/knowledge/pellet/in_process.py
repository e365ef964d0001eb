"""Pellet, kept running inside this process.

The ontologies are loaded once. Each inference works on a copy of that knowledge base, to which the assertions of
the state are added: nothing inferred is kept, so an inference depends on its state alone.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from typing import Any, Final, NamedTuple

from suave_des.errors import KnowledgeError
from suave_des.knowledge.content import RULE_IRI, Terms
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet import java
from suave_des.knowledge.rdf import RDF_TYPE, XSD, Lit, Triple, canonical, facts_of, for_pellet, n_triple
from suave_des.knowledge.rules import Atom, Rule
from suave_des.knowledge.state import ContradictionError

_LITERAL: Final = re.compile(r"literal\((.*),([^,]*),([^,]*)\)", re.DOTALL)
#: An escape of N-Triples; of them all, Jena's reader does not know the one of eight digits.
_ESCAPE: Final = re.compile(r"\\(?:U([0-9A-F]{8})|.)")
_RULE: Final = re.compile(re.escape(RULE_IRI) + r"(\d+)")
_PELLET: Final = "org.mindswap.pellet."
#: One inference at a time in a process: Pellet's term factory is shared by all its knowledge bases.
one_at_a_time: Final = threading.RLock()


def load_n_triples(text: str, *, explain: bool = False) -> Any:
    """Load a Pellet knowledge base; call this with the lock held."""
    model = java.java_class("com.hp.hpl.jena.rdf.model.ModelFactory").createDefaultModel()
    if "\\U" in text:
        text = _ESCAPE.sub(lambda found: chr(int(found[1], 16)) if found[1] else found[0], text)
    model.read(java.java_class("java.io.StringReader")(text), None, "N-TRIPLES")
    knowledge_base = java.java_class(_PELLET + "KnowledgeBase")()
    knowledge_base.setDoExplanation(explain)
    loader = java.java_class(_PELLET + "jena.graph.loader.DefaultGraphLoader")()
    loader.setKB(knowledge_base)
    loader.load(java.java_class("java.util.Collections").singleton(model.getGraph()))
    return knowledge_base


@contextmanager
def _java_errors(ontology: Ontology) -> Iterator[None]:
    """Convert Java's exceptions, if Pellet cannot use the ontologies at all, to an error for the user."""
    try:
        yield
    except java.JavaError as error:
        reason = " ".join(str(error).split()).rpartition("Exception: ")[2]
        raise KnowledgeError(
            f"Pellet cannot use the ontologies: {reason}",
            file=_files(ontology),
            remedy="suave-des kb check may say where",
        ) from error


class InProcessPellet:
    """Pellet with one ontology loaded.

        pellet = InProcessPellet(ontology)
        pellet.infer(ontology.assertions(state))  # values and members, as triples

    Args:
        terms: what to read after an inference; None: what decisions depend on, and what rules assert.

    Raises:
        KnowledgeError: the ontologies are inconsistent by themselves, or Pellet drops one of the rules.
    """

    def __init__(self, ontology: Ontology, terms: Terms | None = None) -> None:
        self._ontology = ontology
        terms = terms or ontology.content.decision_terms()
        with one_at_a_time, _java_errors(ontology):
            java.start()
            self._terms = java.java_class(_PELLET + "utils.ATermUtils")
            self._term = cache(self._terms.makeTermAppl)
            self._base = load_n_triples(ontology.content.n_triples())
            self._properties = [(name, self._term(name)) for name in terms.properties]
            self._classes = [(name, self._term(name)) for name in terms.classes]
            if not self._base.isConsistent():
                raise contradiction(ontology, ())
            # A copy, because Pellet compiles the rules of a knowledge base when it first reasons on it.
            self._base.copy().isConsistent()
            # Entailment is monotonic: what the ontologies entail, every state entails.
            self._known = self._collections(self._base)
            self._always = frozenset(self._read(self._base))
            self._refuse_dropped_rules()

    def infer(self, assertions: Sequence[Triple]) -> frozenset[Triple]:
        """Return all values of the properties to read, and members of the classes to read.

        Args:
            assertions: triples added to the ontologies.

        Raises:
            KnowledgeError: they contradict one another, or the ontologies.
        """
        java.start()  # an error in a process that was forked since
        with one_at_a_time, _java_errors(self._ontology):
            copy = self._base.copy()
            for subject, predicate, value in assertions:
                self._add(copy, subject, predicate, value)
            if not copy.isConsistent():
                raise contradiction(self._ontology, assertions)
            found = self._always.union(self._read(copy, self._known))
            self._refuse_dropped_rules()
            return found

    def _add(self, knowledge_base: Any, subject: str, predicate: str, value: str | Lit) -> None:
        individual = self._term(subject)
        knowledge_base.addIndividual(individual)
        if isinstance(value, Lit):
            value = for_pellet(value)
            if value.datatype.startswith("@"):
                data = self._terms.makePlainLiteral(value.text, value.datatype[1:])
            else:
                data = self._terms.makeTypedLiteral(value.text, value.datatype)
            knowledge_base.addPropertyValue(self._term(predicate), individual, data)
        elif predicate == RDF_TYPE:
            knowledge_base.addType(individual, self._term(value))
        else:
            knowledge_base.addIndividual(self._term(value))
            knowledge_base.addPropertyValue(self._term(predicate), individual, self._term(value))

    def _read(self, knowledge_base: Any, known: Sequence[Any] | None = None) -> Iterator[Triple]:
        """Read values and members, without those in the collections of a smaller knowledge base."""
        for number, (collection, (name, _)) in enumerate(
            zip(self._collections(knowledge_base), [*self._properties, *self._classes], strict=True)
        ):
            if known is not None:
                collection.removeAll(known[number])  # in Java, so that few cross to Python
            yield from (_values if number < len(self._properties) else _members)(collection, name)

    def _collections(self, knowledge_base: Any) -> list[Any]:
        """The (subject, values) entries of each property to read, and the members of each class to read."""
        return [
            *(knowledge_base.getPropertyValues(term).entrySet() for _, term in self._properties),
            *(java.java_class("java.util.HashSet")(knowledge_base.getInstances(term)) for _, term in self._classes),
        ]

    def _refuse_dropped_rules(self) -> None:
        """Raise an error if Pellet logged that it drops a rule; warnings that name the rule come first."""
        warnings = sorted(java.take_warnings(), key=lambda warning: _RULE.search(warning) is None)
        for warning in warnings:
            named = _RULE.search(warning)
            if named is not None:
                raise _dropped(self._ontology.content.rules[int(named.group(1))], warning)
            if "SWRL" in warning or "rule" in warning.lower():
                raise KnowledgeError(f"Pellet does not use part of a rule: {warning}", file=_files(self._ontology))


def _values(entries: Any, name: str) -> Iterator[Triple]:
    """Read the values of a property from Pellet's (subject, values) entries."""
    for entry in entries:
        subject = str(entry.getKey().toString())
        for value in entry.getValue():
            yield subject, name, read_term(str(value.toString()))


def _members(individuals: Any, name: str) -> Iterator[Triple]:
    return ((str(each.toString()), RDF_TYPE, name) for each in individuals)


def entailed(text: str, asked: Iterable[Atom]) -> frozenset[Triple]:
    """Load N-Triples alone, and read the values of the properties and the members of the classes that atoms name.

    There are none where the triples contradict one another.
    """
    with one_at_a_time:
        knowledge_base = load_n_triples(text)
        found: set[Triple] = set()
        term = java.java_class(_PELLET + "utils.ATermUtils").makeTermAppl
        for kind, name in {(atom.kind, atom.predicate) for atom in asked} if knowledge_base.isConsistent() else ():
            if kind in ("object", "data"):
                found.update(_values(knowledge_base.getPropertyValues(term(name)).entrySet(), name))
            elif kind == "class":
                found.update(_members(knowledge_base.getInstances(term(name)), name))
        java.take_warnings()
        return frozenset(found)


class Trace(NamedTuple):
    """Pellet's trace of a contradiction.

    Attributes:
        message: the individual and the property that it names.
        axioms: all that it used, sorted, as it writes them: rule(...), prop(...), type(...), and those of the schema.
        rules: numbers of the rules among them.
    """

    message: str
    axioms: tuple[str, ...]
    rules: tuple[int, ...]


def trace_contradiction(text: str) -> Trace:
    """Load contradictory N-Triples with Pellet's tracing, which is off otherwise, because it takes time."""
    options = java.java_class(_PELLET + "PelletOptions")
    options.USE_TRACING = True
    try:
        knowledge_base = load_n_triples(text, explain=True)
        knowledge_base.isConsistent()
        message = str(knowledge_base.getExplanation())
        axioms = sorted(str(axiom.toString()) for axiom in knowledge_base.getExplanationSet())
        numbers = {int(number) for axiom in axioms for number in _RULE.findall(axiom)[:1]}
        return Trace(message, tuple(axioms), tuple(sorted(numbers)))
    finally:
        options.USE_TRACING = False
        java.take_warnings()


def contradiction(ontology: Ontology, assertions: Sequence[Triple]) -> ContradictionError:
    """Explain a contradiction: its subject, the rules involved, and the assertions of the state."""
    reason, axioms, numbers = trace_contradiction(ontology.content.n_triples() + "".join(map(n_triple, assertions)))
    involved = [ontology.rules[number] for number in numbers]
    places = [", ".join(filter(None, (rule.file.name, ontology.place_of(rule)))) for rule in involved]
    rules = sorted(f"{rule.name} ({place})" for rule, place in zip(involved, places, strict=True))
    facts = [
        str(fact)
        for triple in assertions
        if any(axiom.startswith(f"prop({triple[1]},{triple[0]},") for axiom in axioms)
        for fact in facts_of([triple], ontology.names)
    ]
    problem = re.sub(r"https?://[^\s,()]+", lambda iri: ontology.names.short(iri.group()), reason)
    if rules:
        problem += f", by the rule{'s' if len(rules) > 1 else ''} {', '.join(rules)}"
    if facts:
        problem += f", in the state {', '.join(facts)}"
    return ContradictionError(
        f"contradiction: {problem[0].lower()}{problem[1:]}",
        file=_files(ontology),
        remedy="change a rule, so that no two of these hold at once" if rules else "correct the ontology",
    )


def _dropped(rule: Rule, warning: str) -> KnowledgeError:
    """Make the error for a rule that Pellet drops with only a line in its log."""
    reason = warning.rpartition("): ")[2] if "): " in warning else warning
    return KnowledgeError(
        f"Pellet does not use rule {rule.name}: {_RULE.sub(rule.name, reason)}",
        file=rule.file,
        place=f"rule {rule.name}",
        remedy=f"the rule is: {rule.text}",
    )


def _files(ontology: Ontology) -> str:
    return ", ".join(map(str, ontology.files))


def read_term(text: str) -> str | Lit:
    """Read a term as Pellet prints it: an IRI, or literal(text,language,datatype)."""
    found = _LITERAL.fullmatch(text)
    if found is None:
        return text
    # Pellet keeps all text as PlainLiteral, without a language as "()".
    datatype = found.group(3) if not found.group(3).endswith("PlainLiteral") else XSD + "string"
    return canonical(Lit(unescape(found.group(1)), datatype))


def unescape(text: str) -> str:
    """Undo the escapes of text as Pellet prints it."""
    if "\\" not in text:
        return text
    from owlready2.reasoning import _unescape_pellet_str

    return str(_unescape_pellet_str(text))
