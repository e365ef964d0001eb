"""An ontology with its imports and rules: merged and checked, ready to be reasoned with and planned on.

Its model has the functions, designs, components and quality attributes, and the triples of a state in its terms.
"""

from __future__ import annotations

import hashlib
import json
import operator
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import Final, Literal

from suave_des.errors import KnowledgeError
from suave_des.knowledge.content import Content, merge, with_rules
from suave_des.knowledge.ontology_file import OntologyFile, collect, enumerated_texts, place_of
from suave_des.knowledge.rdf import (
    C_STATUS,
    EXACT,
    HAS_QA_VALUE,
    HAS_VALUE,
    IS_QA_TYPE,
    MROS,
    O_STATUS,
    OWL,
    QA_OPERATOR,
    RDF_TYPE,
    RDFS,
    TOMASYS,
    XSD,
    Lit,
    Names,
    Triple,
    facts_of,
    is_fact,
    local_name,
    namespace,
    number_in,
    reached,
    value_of,
)
from suave_des.knowledge.rules import Rule
from suave_des.knowledge.rules.checks import Vocabulary, check_property_use
from suave_des.knowledge.rules.files import RulesFile
from suave_des.knowledge.state import Fact, KnowledgeState, Value, grounding_name, measurement_name, objective_name
from suave_des.resources import shipped_folder

#: Comparison operators that a quality attribute type may have.
OPERATORS: Final[Mapping[str, Callable[[Decimal, Decimal], bool]]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
_HAS_QA_ESTIMATION: Final = TOMASYS + "hasQAestimation"
_ALWAYS: Final = TOMASYS + "o_always_improve"
_SOLVES_F: Final = TOMASYS + "solvesF"
_SOLVES_O: Final = TOMASYS + "solvesO"
_TYPE_F: Final = TOMASYS + "typeF"
_TYPE_FD: Final = TOMASYS + "typeFD"
#: What a state asserts of an objective, a grounding or a measurement, in place of what an ontology asserts of it.
_STATE_PROPERTIES: Final = frozenset(
    {_TYPE_F, _TYPE_FD, _SOLVES_O, O_STATUS, _ALWAYS, HAS_QA_VALUE, IS_QA_TYPE, HAS_VALUE}
    | {TOMASYS + "fg_status", TOMASYS + "o_updatable"}
)


@dataclass(frozen=True)
class Individual:
    """An individual that exists only in some states, with what the ontologies assert of it (for example hasNFR)."""

    iri: str
    own: tuple[Triple, ...] = ()

    def described_as(self, kind: str) -> Iterator[Triple]:
        """Its class of TOMASys, and what the ontologies assert of it."""
        yield self.iri, RDF_TYPE, TOMASYS + kind
        yield from self.own


@dataclass(frozen=True)
class Model:
    """The named things of an ontology that states are made of.

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

    def individuals(self) -> Iterator[Individual]:
        """All objectives, groundings and measurements that states may have."""
        return chain.from_iterable(group.values() for group in (self.objectives, self.groundings, self.measurements))

    def triples(self) -> Iterator[Triple]:
        """Assertions of the ontologies that only apply in states: about these individuals, and components' statuses."""
        own = (individual.own for individual in self.individuals())
        return chain.from_iterable((*own, *self.initial.values()))

    def assertions(self, state: KnowledgeState) -> tuple[Triple, ...]:
        """Return the triples that assert a state, for every reasoner in the same order.

        A component or a quality attribute that the ontology does not have can match no rule, and is left out:
        monitors may report more than an ontology describes.

        Raises:
            KnowledgeError: a function or a function design is not in the ontology.
        """
        named = [*((each.function, self.functions, "function") for each in state.objectives)]
        named += [(name, self.functions, "function") for name, _ in state.groundings]
        named += [(design, self.designs, "function design") for _, design in state.groundings]
        for name, known, what in named:
            if name not in known:
                remedy = f"known: {', '.join(sorted(known)) or 'none'}"
                raise KnowledgeError(f"the knowledge base has no {what} {name}", remedy=remedy)
        present = {self.objectives[objective.function].iri for objective in state.objectives}
        present |= {self.groundings[design].iri for _, design in state.groundings}
        present |= {self.measurements[name].iri for name, _ in state.measurements if name in self.attributes}
        absent = {individual.iri for individual in self.individuals()} - present
        return tuple(triple for triple in self._triples(state) if triple[2] not in absent)

    def _triples(self, state: KnowledgeState) -> Iterator[Triple]:
        for objective in state.objectives:
            individual = self.objectives[objective.function]
            yield from individual.described_as("Objective")
            yield individual.iri, _TYPE_F, self.functions[objective.function]
            if objective.status is not None:
                yield individual.iri, O_STATUS, Lit(objective.status, XSD + "string")
            if objective.always_improve:
                yield individual.iri, _ALWAYS, Lit("true", XSD + "boolean")
        required = {objective.function for objective in state.objectives}
        for function, design in state.groundings:
            individual = self.groundings[design]
            yield from individual.described_as("FunctionGrounding")
            yield individual.iri, _TYPE_FD, self.designs[design]
            if function in required:
                yield individual.iri, _SOLVES_O, self.objectives[function].iri
            for name, _ in state.measurements:
                if name in self.estimated[design]:
                    yield individual.iri, HAS_QA_VALUE, self.measurements[name].iri
        reported = dict(state.components)
        for name, iri in self.components.items():
            if name in reported:
                yield iri, C_STATUS, Lit(reported[name], XSD + "string")
            else:
                yield from self.initial.get(name, ())
        for name, value in state.measurements:
            if name in self.attributes:
                individual = self.measurements[name]
                yield from individual.described_as("QAvalue")
                yield individual.iri, IS_QA_TYPE, self.attributes[name]
                yield individual.iri, HAS_VALUE, Lit(format(value, "f"), XSD + "decimal")


def build_model(content: Content, sources: Sequence[OntologyFile]) -> tuple[Model, Content]:
    """Find the model, and return the content without the triples that only states assert.

    Objectives, groundings and measurements that the ontologies describe already (an objective's hasNFR, a
    grounding's requiresO) are taken out, and come with the states that have them.

    Raises:
        KnowledgeError: two functions, designs, components or quality attribute types share a name.
    """
    triples = content.triples

    def linked(predicate: str, place: Literal[0, 2]) -> set[str]:
        """Subjects (0) or things as objects (2) of a property."""
        return {str(each[place]) for each in triples if each[1] == predicate and isinstance(each[2], str)}

    def by_name(iris: Iterable[str], what: str) -> dict[str, str]:
        """IRI by name; two of one kind must not share a name, since states are written with names."""
        found: dict[str, str] = {}
        for iri in sorted(iris):
            other = found.setdefault(local_name(iri), iri)
            if other != iri:
                raise wrong_in(iri, sources, f"two {what} have this name: {other} and {iri}", "rename one of them")
        return dict(sorted(found.items()))

    functions = by_name(_members(triples, "Function") | linked(_SOLVES_F, 2), "functions")
    designs = by_name(_members(triples, "FunctionDesign") | linked(_SOLVES_F, 0), "function designs")
    parts = (
        _members(triples, "Component") | linked(MROS + "requiredBy", 0) | {s for s, p, _ in triples if p == C_STATUS}
    )
    components = by_name(parts, "components")
    attributes = by_name(_members(triples, "QualityAttributeType") | linked(IS_QA_TYPE, 2), "quality attribute types")
    existing = {local_name(iri): iri for iri in sorted({triple[0] for triple in triples}, reverse=True)}
    groups = [
        {name: existing.get(rename(name), namespace(iri) + rename(name)) for name, iri in things.items()}
        for things, rename in (
            (functions, objective_name),
            (designs, grounding_name),
            (attributes, measurement_name),
        )
    ]
    in_states = {iri for group in groups for iri in group.values()}
    if len(in_states) < sum(map(len, groups)):
        raise KnowledgeError(
            "two functions, function designs or quality attribute types differ in their prefix only",
            file=sources[0].path,
            remedy="rename one, for example f_search and search",
        )
    own: dict[str, list[Triple]] = {iri: [] for iri in in_states}
    for triple in triples:
        subject, predicate, value = triple
        holder = subject if subject in in_states else value
        if isinstance(holder, str) and holder in own and predicate not in _STATE_PROPERTIES and is_fact(triple):
            own[holder].append(triple)
    objectives, groundings, measurements = (
        {name: Individual(iri, tuple(own[iri])) for name, iri in group.items()} for group in groups
    )
    estimated: dict[str, set[str]] = {name: set() for name in designs}
    for design, attribute, _ in estimations(triples, designs, attributes):
        estimated[design].add(attribute)
    model = Model(
        functions=functions,
        designs=designs,
        components=components,
        attributes=attributes,
        objectives=objectives,
        groundings=groundings,
        measurements=measurements,
        estimated={name: frozenset(found) for name, found in estimated.items()},
        initial={
            name: tuple(triple for triple in triples if triple[:2] == (iri, C_STATUS))
            for name, iri in components.items()
        },
    )
    kept = tuple(t for t in triples if t[0] not in in_states and t[2] not in in_states and t[1] != C_STATUS)
    return model, replace(content, triples=kept)


def assumption(name: str, sign: str) -> str:
    """Describe which comparison operator is assumed for a quality attribute type."""
    return f"{name} has no qa_comparison_operator in the ontologies: {sign} is assumed, as in the revision's code"


def with_operators(content: Content, model: Model, operators: Mapping[str, str]) -> tuple[Content, dict[str, str]]:
    """Add the comparison operators of quality attribute types that have none; return those that were added, by name."""
    present = {subject for subject, predicate, _ in content.triples if predicate == QA_OPERATOR}
    added = {
        name: sign
        for name, sign in sorted(operators.items())
        if name in model.attributes and model.attributes[name] not in present
    }
    if not added:
        return content, {}
    more = [(model.attributes[name], QA_OPERATOR, Lit(sign, XSD + "string")) for name, sign in added.items()]
    return replace(content, triples=tuple(sorted((*content.triples, *more), key=str))), added


def _members(triples: Iterable[Triple], name: str) -> set[str]:
    """Individuals of a class of TOMASys or of its subclasses."""
    below = ((str(o), s) for s, p, o in triples if p == RDFS + "subClassOf")
    classes = reached([TOMASYS + name], below)
    return {s for s, p, o in triples if p == RDF_TYPE and o in classes}


def estimations(
    triples: Iterable[Triple], designs: Mapping[str, str], attributes: Mapping[str, str]
) -> Iterator[tuple[str, str, str]]:
    """(design, quality attribute type, IRI of the QAvalue individual) of each hasQAestimation."""
    design_names = {iri: name for name, iri in designs.items()}
    attribute_names = {iri: name for name, iri in attributes.items()}
    types = {s: attribute_names[o] for s, p, o in triples if p == IS_QA_TYPE and isinstance(o, str)}
    for subject, predicate, value in triples:
        if predicate == _HAS_QA_ESTIMATION and subject in design_names and value in types:
            yield design_names[subject], types[str(value)], str(value)


def wrong_values(triples: Iterable[Triple]) -> Iterator[tuple[str, str, str]]:
    """Find numbers that are no decimals, unknown operators, and functional properties with several values.

    A reasoner would not explain the first two. Of two values that an ontology asserts for one functional data
    property Pellet silently keeps the one that it read last.

    Yields:
        the IRI of the individual, what is wrong, and what would be right.
    """
    triples = tuple(triples)
    functional = {s for s, p, o in triples if p == RDF_TYPE and o == OWL + "FunctionalProperty"}
    names = Names(triples)
    seen: dict[tuple[str, str], Value] = {}
    for subject, predicate, value in triples:
        shown, datatype = value if isinstance(value, Lit) else (value, "")
        if predicate == HAS_VALUE and (number_in(value) is None or datatype not in EXACT):
            but = f" but an xsd:{local_name(datatype)}" if datatype not in (*EXACT, "") else ""
            yield subject, f"hasValue {shown!r} is not an xsd:decimal{but}", "a number such as 2.25"
        if predicate == QA_OPERATOR and shown not in OPERATORS:
            yield subject, f"qa_comparison_operator {shown!r} is unknown", f"one of {' '.join(OPERATORS)}"
        if predicate in functional and isinstance(value, Lit):
            one = value_of(value, names)
            other = seen.setdefault((subject, predicate), one)
            if one != other:
                values = f"the values {other} and {one}"
                problem = f"contradiction: the functional property {local_name(predicate)} has {values}"
                yield subject, problem, "keep one of them"


def wrong_in(subject: str, sources: Sequence[OntologyFile], problem: str, remedy: str) -> KnowledgeError:
    """Return an error on an individual, with the file and line where it is described."""
    name = local_name(subject)
    file, line = place_of(name, sources)
    return KnowledgeError(f"{name}: {problem}", file=file, place=f"line {line}" if line else None, remedy=remedy)


@dataclass(frozen=True, eq=False)
class Ontology:
    """Ontology files and files of rules, merged and checked. It is immutable: only a KnowledgeState changes.

        ontology = Ontology.load(["suave.owl"], rules=["mine.swrl"])
        ontology.designs("f_generate_search_path")  # ('fd_spiral_high', 'fd_spiral_low', 'fd_spiral_medium')
        ontology.expected("fd_spiral_low")  # {'performance': Decimal('0.25'), 'water_visibility': Decimal('1.25')}

    Attributes:
        files: the ontology files in use, imports included, sorted by path, and the files of rules as text.
        content_hash: SHA-256 of all their content, of the overridden values and of the names of disabled rules,
            whatever the order of ontologies.
        content: all triples and rules for a reasoner.
        names: short names of IRIs, for facts.
        model: the functions, designs, components and quality attributes.
        vocabulary: the names that rules may use.
        sources: the ontology files with their graphs.
        stated: all triples of the files, those that only states assert among them.
        assumed: the comparison operators that were added to the ontologies, by quality attribute type.
    """

    files: tuple[Path, ...]
    content_hash: str
    content: Content = field(repr=False)
    names: Names = field(repr=False)
    model: Model = field(repr=False)
    vocabulary: Vocabulary = field(repr=False)
    sources: tuple[OntologyFile, ...] = field(repr=False)
    stated: tuple[Triple, ...] = field(repr=False)
    assumed: Mapping[str, str]

    @classmethod
    def load(
        cls,
        ontologies: Sequence[Path | str] = (),
        *,
        values: Mapping[str, Decimal] | None = None,
        rules: Sequence[Path | str] = (),
        disabled_rules: Collection[str] = (),
        operators: Mapping[str, str] | None = None,
    ) -> Ontology:
        """Read ontologies, in any order, and their imports; without any, the shipped suave.owl.

        Args:
            ontologies: files in RDF/XML.
            values: replaces the hasValue of a named QAvalue individual, such as qa_water_visibility_low.
            rules: files of rules as text; each rule replaces earlier rules of the same name.
            disabled_rules: names of rules to disable.
            operators: qa_comparison_operator of quality attribute types that have none, by name.

        Raises:
            KnowledgeError: a file or an import cannot be used, a value names no QAvalue, or there is no such rule to
                disable.
            RuleError: a rule as text cannot be read or used.
        """
        sources = collect([Path(path) for path in ontologies] or [shipped_folder("ontology") / "suave.owl"])
        files = [RulesFile.read(Path(path)) for path in rules]
        base = cls.merged(sources, files, RulesFile.rules, values or {}, disabled_rules, operators or {})
        for subject, problem, remedy in wrong_values(base.stated):
            raise wrong_in(subject, sources, problem, remedy)
        check_property_use(base.content.enabled_rules, base.vocabulary)
        return base

    @classmethod
    def merged(
        cls,
        sources: Sequence[OntologyFile],
        files: Sequence[RulesFile],
        usable: Callable[[RulesFile, Vocabulary], Sequence[Rule]],
        values: Mapping[str, Decimal],
        disabled_rules: Collection[str],
        operators: Mapping[str, str],
    ) -> Ontology:
        """Merge files that have been read; values and property use are not checked.

        Args:
            sources: the ontologies with their imports.
            files: of rules as text.
            usable: gives those rules of a file that can be used.
            values, disabled_rules, operators: as of load.

        Raises:
            KnowledgeError: two things share a name, a value names no QAvalue, or there is no such rule to disable.
        """
        merged = merge(sources, values)
        model, content = build_model(merged, sources)
        content, assumed = with_operators(content, model, operators)
        individuals = (individual.iri for individual in model.individuals())
        vocabulary = Vocabulary.of(merged.triples, individuals, enumerated_texts(sources))
        return cls(
            files=(*sorted(source.path for source in sources), *(file.path for file in files)),
            content_hash=_content_hash(sources, values, assumed, files, disabled_rules),
            content=with_rules(content, [usable(file, vocabulary) for file in files], disabled_rules),
            names=Names(merged.triples),
            model=model,
            vocabulary=vocabulary,
            sources=tuple(sources),
            stated=merged.triples,
            assumed=assumed,
        )

    def with_rules(self, rules: Iterable[Rule]) -> Ontology:
        """Return the same ontology with different rules, enabled or not."""
        return replace(self, content=replace(self.content, rules=tuple(rules)))

    def with_facts(self, facts: Iterable[Triple]) -> Ontology:
        """Return the same ontology with further facts about individuals."""
        return replace(self, content=replace(self.content, triples=(*self.content.triples, *facts)))

    def with_triples(self, triples: Iterable[Triple]) -> Ontology:
        """Return the ontology with different triples, in which the model is found again."""
        whole = replace(self.content, triples=(*triples, *self.model.triples()))
        model, content = build_model(whole, self.sources)
        return replace(self, content=content, model=model, names=Names(whole.triples), stated=whole.triples)

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What was added to the ontologies, in words."""
        return tuple(assumption(name, sign) for name, sign in self.assumed.items())

    @property
    def rules(self) -> tuple[Rule, ...]:
        """The SWRL rules, disabled ones included."""
        return self.content.rules

    @cached_property
    def facts(self) -> frozenset[Fact]:
        """The facts that the ontologies assert about individuals."""
        return frozenset(facts_of(self.content.triples, self.names))

    @property
    def functions(self) -> tuple[str, ...]:
        """Names of the functions."""
        return tuple(self.model.functions)

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the components."""
        return tuple(self.model.components)

    @property
    def quality_attributes(self) -> tuple[str, ...]:
        """Names of the quality attribute types."""
        return tuple(self.model.attributes)

    def designs(self, function: str) -> tuple[str, ...]:
        """Function designs that solve a function, sorted by name; none for an unknown function."""
        return self._designs.get(function, ())

    @cached_property
    def _designs(self) -> Mapping[str, tuple[str, ...]]:
        solving = sorted((fact.subject, fact.value) for fact in self.facts if fact.property == "solvesF")
        return {
            name: tuple(one for one, solved in solving if solved == name and one in self.model.designs)
            for name in self.functions
        }

    def expected(self, design: str) -> Mapping[str, Decimal]:
        """Expected value of each quality attribute of a function design, its performance among them; of several, the
        smallest."""
        return self._expected.get(design, {})

    @cached_property
    def _expected(self) -> Mapping[str, Mapping[str, Decimal]]:
        triples, found = self.content.triples, {name: dict[str, Decimal]() for name in self.model.designs}
        numbers = {
            s: Decimal(value.text.strip()) for s, p, value in triples if p == HAS_VALUE and isinstance(value, Lit)
        }
        for design, attribute, individual in estimations(triples, self.model.designs, self.model.attributes):
            if individual in numbers:
                value = numbers[individual]
                found[design][attribute] = min(value, found[design].get(attribute, value))
        return {name: dict(sorted(expected.items())) for name, expected in found.items()}

    def source_of(self, rule: Rule) -> OntologyFile | None:
        """The ontology that a rule is from; None for a rule as text."""
        return next((each for each in self.sources if each.path == rule.file), None)

    def place_of(self, rule: Rule) -> str | None:
        """The line of a rule in its file, as "line 12", as far as the file shows where it is."""
        source = self.source_of(rule)
        line = None if source is None else source.line_of_rule(rule.name)
        return rule.place or (f"line {line}" if line else None)

    def assertions(self, state: KnowledgeState) -> tuple[Triple, ...]:
        """Return the triples that assert a state.

        Raises:
            KnowledgeError: a function or a function design is not in the ontology.
        """
        return self.model.assertions(state)

    def asserted(self, state: KnowledgeState) -> frozenset[Fact]:
        """The facts of the ontologies and of a state."""
        return self.facts.union(facts_of(self.assertions(state), self.names))

    def unsolved(self, functions: Iterable[str]) -> Iterator[tuple[str, str, str]]:
        """Yield those functions that are not there or have no design: name, what is wrong, what would be right."""
        for name in sorted(functions):
            if name not in self.model.functions:
                remedy = f"functions in the ontology: {', '.join(self.functions) or 'none'}"
                yield name, f"there is no function {name}, which the mission needs", remedy
            elif not self.designs(name):
                remedy = f"add an individual of FunctionDesign with solvesF {name}"
                yield name, f"function {name} has no function design", remedy

    def check(self, functions: Collection[str]) -> None:
        """Check that the mission's functions have function designs.

        Raises:
            KnowledgeError: there is no such function, or no function design for it.
        """
        for _, problem, remedy in self.unsolved(functions):
            raise KnowledgeError(problem, file=", ".join(map(str, self.files)), remedy=remedy)


def _content_hash(
    sources: Sequence[OntologyFile],
    values: Mapping[str, Decimal],
    operators: Mapping[str, str],
    files: Sequence[RulesFile],
    disabled: Collection[str],
) -> str:
    contents = sorted(hashlib.sha256(source.content).hexdigest() for source in sources)
    numbers = {name: format(value.normalize(), "f") for name, value in values.items()}
    parts = contents, numbers, dict(operators), [file.text for file in files], sorted(set(disabled))
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()
