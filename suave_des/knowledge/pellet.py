"""Pellet, kept running inside this process.

The ontologies are loaded once. Each inference works on a copy of that knowledge base, to which the facts of
the state are added: nothing inferred is ever carried over, so an inference depends on its state alone.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator, Sequence
from typing import Any, Final

from suave_des.errors import KnowledgeError
from suave_des.knowledge import jvm
from suave_des.knowledge.base import KnowledgeBase
from suave_des.knowledge.model import properties_to_read
from suave_des.knowledge.rules import Rule
from suave_des.knowledge.situation import Lit, Triple
from suave_des.knowledge.triples import RULE_IRI
from suave_des.knowledge.vocabulary import RDF_TYPE, XSD, local_name

_LITERAL: Final = re.compile(r"literal\((.*),([^,]*),([^,]*)\)", re.DOTALL)
_RULE: Final = re.compile(re.escape(RULE_IRI) + r"(\d+)")
_CLASH: Final = re.compile(r"Individual (\S+) has more than one value for the functional property (\S+)")
_PELLET: Final = "org.mindswap.pellet."
#: One inference at a time in a process: Pellet's term factory is shared by all its knowledge bases.
_one_at_a_time: Final = threading.RLock()


class InProcessPellet:
    """Pellet with one knowledge base loaded.

    Raises:
        KnowledgeError: the ontologies are inconsistent by themselves, or Pellet drops one of the rules.
    """

    def __init__(self, kb: KnowledgeBase) -> None:
        self._kb = kb
        with _one_at_a_time:
            jvm.start()
            self._make_term = jvm.java_class(_PELLET + "utils.ATermUtils").makeTermAppl
            self._make_literal = jvm.java_class(_PELLET + "utils.ATermUtils").makeTypedLiteral
            self._make_plain = jvm.java_class(_PELLET + "utils.ATermUtils").makePlainLiteral
            self._base = self._load(kb.content.n_triples())
            self._terms: dict[str, Any] = {}
            self._properties = [(name, self._term(name)) for name in properties_to_read(kb.content)]
            self._classes = [(name, self._term(name)) for name in sorted(kb.content.head_classes())]
            if not self._base.isConsistent():
                raise self.inconsistency("the ontologies contradict themselves", self._base)
            # A copy, because Pellet compiles the rules of a knowledge base when it first reasons on it.
            self._base.copy().isConsistent()
            self._refuse_dropped_rules()

    def infer(self, situation: Sequence[Triple], describe: str) -> frozenset[Triple]:
        """All values of the properties to read, and members of the classes to read, in a situation.

        Args:
            situation: triples added to the ontologies.
            describe: the situation in words, for an error.

        Raises:
            KnowledgeError: the situation contradicts itself.
        """
        with _one_at_a_time:
            copy = self._base.copy()
            for subject, predicate, value in situation:
                self._add(copy, subject, predicate, value)
            if not copy.isConsistent():
                raise self.inconsistency(f"contradiction in the state {describe}", copy)
            found = frozenset(self._read(copy))
            self._refuse_dropped_rules()
            return found

    def inconsistency(self, where: str, knowledge_base: Any) -> KnowledgeError:
        """An error that says what clashes, from Pellet's explanation."""
        explanation = str(knowledge_base.getExplanation())
        jvm.take_warnings()
        clash = _CLASH.search(explanation)
        files = ", ".join(map(str, self._kb.files))
        if clash is None:
            return KnowledgeError(f"{where}: {explanation}", file=files)
        individual, name = (local_name(part) for part in clash.groups())
        return KnowledgeError(
            f"{where}: individual {individual} would have more than one value of the functional property {name}",
            file=files,
            remedy=f"no two of these may hold at once: {self._sources(name)}",
        )

    def _sources(self, name: str) -> str:
        """What can give an individual a value of a property: the state, and rules by name."""
        rules = sorted(
            rule.name
            for rule in self._kb.content.enabled_rules
            if name in {local_name(head) for head, _ in rule.head_properties}
        )
        return ", ".join(["the value in the state", *(f"rule {rule}" for rule in rules)])

    def _term(self, iri: str) -> Any:
        term = self._terms.get(iri)
        if term is None:
            term = self._terms[iri] = self._make_term(iri)
        return term

    def _load(self, text: str) -> Any:
        model = jvm.java_class("com.hp.hpl.jena.rdf.model.ModelFactory").createDefaultModel()
        model.read(jvm.java_class("java.io.StringReader")(text), None, "N-TRIPLES")
        loader = jvm.java_class(_PELLET + "jena.graph.loader.DefaultGraphLoader")()
        knowledge_base = jvm.java_class(_PELLET + "KnowledgeBase")()
        loader.setKB(knowledge_base)
        loader.load(jvm.java_class("java.util.Collections").singleton(model.getGraph()))
        return knowledge_base

    def _add(self, knowledge_base: Any, subject: str, predicate: str, value: str | Lit) -> None:
        individual = self._term(subject)
        knowledge_base.addIndividual(individual)
        if isinstance(value, Lit):
            if value.datatype.startswith("@"):
                data = self._make_plain(value.text, value.datatype[1:])
            else:
                data = self._make_literal(value.text, value.datatype)
            knowledge_base.addPropertyValue(self._term(predicate), individual, data)
        elif predicate == RDF_TYPE:
            knowledge_base.addType(individual, self._term(value))
        else:
            knowledge_base.addIndividual(self._term(value))
            knowledge_base.addPropertyValue(self._term(predicate), individual, self._term(value))

    def _read(self, knowledge_base: Any) -> Iterator[Triple]:
        for name, term in self._properties:
            for entry in knowledge_base.getPropertyValues(term).entrySet():
                subject = str(entry.getKey().toString())
                for value in entry.getValue():
                    yield subject, name, _value(str(value.toString()))
        for name, term in self._classes:
            for individual in knowledge_base.getInstances(term):
                yield str(individual.toString()), RDF_TYPE, name

    def _refuse_dropped_rules(self) -> None:
        for warning in jvm.take_warnings():
            named = _RULE.search(warning)
            if named is not None:
                rule = self._kb.content.rules[int(named.group(1))]
                raise dropped(rule, warning)
            if "SWRL" in warning or "rule" in warning.lower():
                raise KnowledgeError(f"Pellet does not take part of a rule: {warning}", file=_files(self._kb))


def dropped(rule: Rule, warning: str) -> KnowledgeError:
    """The error for a rule that Pellet would leave out with nothing but a line in its log."""
    reason = warning.rpartition("): ")[2] if "): " in warning else warning
    return KnowledgeError(
        f"Pellet does not use rule {rule.name}: {_RULE.sub(rule.name, reason)}",
        file=rule.file,
        place=f"rule {rule.name}",
        remedy=f"the rule is: {rule.text}",
    )


def _files(kb: KnowledgeBase) -> str:
    return ", ".join(map(str, kb.files))


def _value(text: str) -> str | Lit:
    """A term as Pellet prints it: an IRI, or literal(text,language,datatype)."""
    found = _LITERAL.fullmatch(text)
    if found is None:
        return text
    # Pellet keeps all text as PlainLiteral, without a language as "()".
    datatype = found.group(3) if not found.group(3).endswith("PlainLiteral") else XSD + "string"
    return Lit(_unescape(found.group(1)), datatype)


def _unescape(text: str) -> str:
    """Undo the escapes of a term's text."""
    if "\\" not in text:
        return text
    from owlready2.reasoning import _unescape_pellet_str

    return str(_unescape_pellet_str(text))
