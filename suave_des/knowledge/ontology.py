"""An ontology with its imports and rules: merged and checked, ready to be reasoned with and planned on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from functools import cached_property
from pathlib import Path

from suave_des.errors import KnowledgeError
from suave_des.knowledge.content import Content, merge, with_rules
from suave_des.knowledge.model import (
    Model,
    assumption,
    build_model,
    expectations,
    with_operators,
    wrong_in,
    wrong_values,
)
from suave_des.knowledge.ontology_file import OntologyFile, collect, enumerated_texts
from suave_des.knowledge.rdf import Names, Triple, facts_of
from suave_des.knowledge.rules import Rule
from suave_des.knowledge.rules.checks import Vocabulary, check_property_use
from suave_des.knowledge.rules.files import RulesFile
from suave_des.knowledge.state import Fact, KnowledgeState
from suave_des.resources import shipped_folder


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
        check_property_use(base.stated, base.content.enabled_rules)
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
        """Expected value of each quality attribute of a function design (its performance among them)."""
        return self._expected.get(design, {})

    @cached_property
    def _expected(self) -> Mapping[str, Mapping[str, Decimal]]:
        return expectations(self.content, self.model)

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
