"""The knowledge base: what the ontologies say, ready to be reasoned with and planned on."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from pathlib import Path

from suave_des.errors import KnowledgeError
from suave_des.knowledge.catalogue import collect
from suave_des.knowledge.checks import check_rules, check_values
from suave_des.knowledge.model import Names, build_model, expectations, facts_of
from suave_des.knowledge.ontology_file import OntologyFile
from suave_des.knowledge.rule_files import RulesFile, hash_with_rules, with_rules
from suave_des.knowledge.rule_names import Vocabulary
from suave_des.knowledge.rules import Rule
from suave_des.knowledge.situation import Model, Triple
from suave_des.knowledge.state import Fact, KnowledgeState
from suave_des.knowledge.triples import Content, merge
from suave_des.resources import shipped_folder


@dataclass(frozen=True, eq=False)
class KnowledgeBase:
    """Ontologies, merged and checked. It never changes: what changes is a KnowledgeState.

    Attributes:
        files: the ontology files in use, imports included, sorted by path, and the files of rules as text.
        content_hash: SHA-256 of all their content, of the overridden values and of the names of rules switched off,
            whatever the order of ontologies.
        rules: the SWRL rules, disabled ones included.
        facts: what the ontologies assert of individuals.
        content: all triples for a reasoner.
    """

    files: tuple[Path, ...]
    content_hash: str
    rules: tuple[Rule, ...] = field(repr=False)
    facts: frozenset[Fact] = field(repr=False)
    content: Content = field(repr=False)
    names: Names = field(repr=False)
    model: Model = field(repr=False)
    vocabulary: Vocabulary = field(repr=False)
    _designs: Mapping[str, tuple[str, ...]] = field(repr=False)
    _expected: Mapping[str, Mapping[str, Decimal]] = field(repr=False)
    _sources: tuple[OntologyFile, ...] = field(repr=False)

    @classmethod
    def load(
        cls,
        ontologies: Sequence[Path | str] = (),
        *,
        values: Mapping[str, Decimal] | None = None,
        rules: Sequence[Path | str] = (),
        disabled_rules: Collection[str] = (),
    ) -> KnowledgeBase:
        """Read ontologies, in any order, and what they import; without any, the shipped suave.owl.

        Args:
            ontologies: files in RDF/XML.
            values: replaces the hasValue of a named QAvalue individual, such as qa_water_visibility_low.
            rules: files of rules as text; each rule takes the place of those of its name that were read before.
            disabled_rules: names of rules to switch off.

        Raises:
            KnowledgeError: a file or an import cannot be used, a value names no QAvalue, or there is no such rule to
                switch off.
            RuleError: a rule as text cannot be read or used.
        """
        given = [Path(path) for path in ontologies] or [shipped_folder("ontology") / "suave.owl"]
        sources = collect(given)
        content = merge(sources, dict(values or {}))
        names = Names(content)
        check_values(content, sources)
        everything = content.triples
        model, content = build_model(content, names, sources)
        vocabulary = Vocabulary.of(everything, model)
        files = [RulesFile.read(Path(path)) for path in rules]
        content = with_rules(content, [file.rules(vocabulary) for file in files], disabled_rules)
        check_rules(replace(content, triples=everything))
        expected = expectations(content, model)
        designs: dict[str, list[str]] = {name: [] for name in model.functions}
        for fact in facts_of(content.triples, names):
            if fact.property == "solvesF" and fact.value in designs and fact.subject in model.designs:
                designs[str(fact.value)].append(fact.subject)
        return cls(
            files=(*sorted(source.path for source in sources), *(file.path for file in files)),
            content_hash=hash_with_rules(_content_hash(sources, values or {}), files, disabled_rules),
            rules=content.rules,
            facts=frozenset(facts_of(content.triples, names)),
            content=content,
            names=names,
            model=model,
            vocabulary=vocabulary,
            _designs={name: tuple(sorted(found)) for name, found in designs.items()},
            _expected=expected,
            _sources=sources,
        )

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

    def expected(self, design: str) -> Mapping[str, Decimal]:
        """Expected value of each quality attribute of a function design (its performance among them)."""
        return self._expected.get(design, {})

    def situation(self, state: KnowledgeState) -> tuple[Triple, ...]:
        """The triples that a state adds to the ontologies.

        Raises:
            KnowledgeError: a function or a function design is not in the knowledge base.
        """
        return self.model.situation(state)

    def asserted(self, state: KnowledgeState) -> frozenset[Fact]:
        """The facts of the ontologies and of a state."""
        return self.facts.union(facts_of(self.situation(state), self.names))

    def check(self, functions: Collection[str]) -> None:
        """See that the mission's functions can be solved at all.

        Raises:
            KnowledgeError: the knowledge base has no such function, or no function design for it.
        """
        where = ", ".join(map(str, self.files))
        for function in sorted(functions):
            if function not in self.model.functions:
                raise KnowledgeError(
                    f"there is no function {function}",
                    file=where,
                    remedy=f"the mission needs it; functions in the ontology: {', '.join(self.functions) or 'none'}",
                )
            if not self.designs(function):
                raise KnowledgeError(
                    f"function {function} has no function design",
                    file=where,
                    remedy=f"add an individual of FunctionDesign with solvesF {function}",
                )


def _content_hash(sources: Sequence[OntologyFile], values: Mapping[str, Decimal]) -> str:
    total = hashlib.sha256()
    for digest in sorted(hashlib.sha256(source.content).hexdigest() for source in sources):
        total.update(digest.encode())
    for name, value in sorted(values.items()):
        total.update(f"{name}={format(value.normalize(), 'f')}\n".encode())
    return total.hexdigest()
