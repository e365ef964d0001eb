"""Turn a knowledge state into the triples that a reasoner is given besides the ontologies.

Both backends are given the same triples, in the same order, so that they can differ in nothing else.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal
from typing import Final, NamedTuple

from suave_des.errors import KnowledgeError
from suave_des.knowledge.state import KnowledgeState
from suave_des.knowledge.vocabulary import RDF_TYPE, TOMASYS, XSD


class Lit(NamedTuple):
    """A literal: its text, and the IRI of its datatype or, for text in a language, "@" and the language."""

    text: str
    datatype: str


#: Subject IRI, predicate IRI, and an IRI or a literal.
Triple = tuple[str, str, str | Lit]

_TYPE_F: Final = TOMASYS + "typeF"
_TYPE_FD: Final = TOMASYS + "typeFD"
_SOLVES_O: Final = TOMASYS + "solvesO"
_O_STATUS: Final = TOMASYS + "o_status"
_ALWAYS: Final = TOMASYS + "o_always_improve"
_C_STATUS: Final = TOMASYS + "c_status"
_HAS_QA_VALUE: Final = TOMASYS + "hasQAvalue"
_IS_QA_TYPE: Final = TOMASYS + "isQAtype"
_HAS_VALUE: Final = TOMASYS + "hasValue"
#: What a state says of an objective, a grounding or a measurement; an ontology's own word on it is left out.
STATE_PROPERTIES: Final = frozenset(
    {_TYPE_F, _TYPE_FD, _SOLVES_O, _O_STATUS, _ALWAYS, _HAS_QA_VALUE, _IS_QA_TYPE, _HAS_VALUE}
    | {TOMASYS + "fg_status", TOMASYS + "o_updatable"}
)


@dataclass(frozen=True)
class Individual:
    """An individual that exists only in some states, with what the ontologies say of it (for example hasNFR)."""

    iri: str
    own: tuple[Triple, ...] = ()


@dataclass(frozen=True)
class Model:
    """The names in a knowledge base that states are made of, each with its IRI.

    Attributes:
        functions, designs, components, attributes: IRI by name.
        objectives: the objective that a function may get, by the function's name.
        groundings: the grounding that a function design may get, by the design's name.
        measurements: the measured value that a quality attribute type may get, by the type's name.
        estimated: the quality attribute types of which a design has an expected value, by the design's name.
        initial: what the ontologies assert of a component's status, by the component's name.
    """

    functions: Mapping[str, str]
    designs: Mapping[str, str]
    components: Mapping[str, str]
    attributes: Mapping[str, str]
    objectives: Mapping[str, Individual]
    groundings: Mapping[str, Individual]
    measurements: Mapping[str, Individual]
    estimated: Mapping[str, frozenset[str]]
    initial: Mapping[str, tuple[Triple, ...]]

    def situation(self, state: KnowledgeState) -> tuple[Triple, ...]:
        """The triples of a state.

        A component or a quality attribute that the knowledge base does not have can match no rule, and is
        left out: monitors may well report more than a model speaks of.

        Raises:
            KnowledgeError: a function or a function design is not in the knowledge base.
        """
        for objective in state.objectives:
            self._known(objective.function, self.functions, "function")
        for function, design in state.groundings:
            self._known(function, self.functions, "function")
            self._known(design, self.designs, "function design")
        present = {self.objectives[objective.function].iri for objective in state.objectives}
        present |= {self.groundings[design].iri for _, design in state.groundings}
        present |= {self.measurements[name].iri for name, _ in state.measurements if name in self.attributes}
        absent = {
            individual.iri
            for group in (self.objectives, self.groundings, self.measurements)
            for individual in group.values()
        } - present
        return tuple(triple for triple in self._triples(state) if triple[2] not in absent)

    @staticmethod
    def _known(name: str, names: Mapping[str, str], what: str) -> None:
        if name not in names:
            raise KnowledgeError(
                f"the knowledge base has no {what} {name}", remedy=f"known: {', '.join(sorted(names)) or 'none'}"
            )

    def _triples(self, state: KnowledgeState) -> Iterator[Triple]:
        for objective in state.objectives:
            individual = self.objectives[objective.function]
            yield individual.iri, RDF_TYPE, TOMASYS + "Objective"
            yield from individual.own
            yield individual.iri, _TYPE_F, self.functions[objective.function]
            if objective.status is not None:
                yield individual.iri, _O_STATUS, Lit(objective.status, XSD + "string")
            if objective.always_improve:
                yield individual.iri, _ALWAYS, Lit("true", XSD + "boolean")
        yield from self._groundings(state)
        reported = dict(state.components)
        for name, iri in self.components.items():
            if name in reported:
                yield iri, _C_STATUS, Lit(reported[name], XSD + "string")
            else:
                yield from self.initial.get(name, ())
        for name, value in state.measurements:
            if name in self.attributes:
                yield from self._measurement(name, value)

    def _groundings(self, state: KnowledgeState) -> Iterator[Triple]:
        asked = {objective.function for objective in state.objectives}
        for function, design in state.groundings:
            individual = self.groundings[design]
            yield individual.iri, RDF_TYPE, TOMASYS + "FunctionGrounding"
            yield from individual.own
            yield individual.iri, _TYPE_FD, self.designs[design]
            if function in asked:
                yield individual.iri, _SOLVES_O, self.objectives[function].iri
            for name, _ in state.measurements:
                if name in self.estimated[design]:
                    yield individual.iri, _HAS_QA_VALUE, self.measurements[name].iri

    def _measurement(self, name: str, value: Decimal) -> Iterator[Triple]:
        individual = self.measurements[name]
        yield individual.iri, RDF_TYPE, TOMASYS + "QAvalue"
        yield from individual.own
        yield individual.iri, _IS_QA_TYPE, self.attributes[name]
        yield individual.iri, _HAS_VALUE, Lit(format(value, "f"), XSD + "decimal")
