"""Check the model in the ontologies: names, functions, designs, modes, and rules that can never fire."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Final

from suave_des.domain import DEFAULT_MODE, UNGROUND_MODE
from suave_des.errors import nearest
from suave_des.knowledge.checks.findings import Finding, Level, finding_about
from suave_des.knowledge.content import Content
from suave_des.knowledge.model import Model, expectations
from suave_des.knowledge.ontology_file import OntologyFile
from suave_des.knowledge.rdf import (
    HAS_QA_VALUE,
    IS_QA_TYPE,
    LANGUAGE_NAMESPACES,
    OWL,
    PERFORMANCE,
    RDF_TYPE,
    RDFS,
    TOMASYS,
    XSD,
    Lit,
    canonical,
    local_name,
    memberships,
    namespace,
)
from suave_des.knowledge.rules.names import Vocabulary
from suave_des.knowledge.rules.syntax import EXPRESSION, Atom, Named, Rule

_PROPERTIES: Final = ("object property", "data property", "annotation property")
_ANY: Final = "any value"
#: Axioms by which individuals are different: declared so, or members of disjoint classes or properties.
_MAKE_DIFFERENT: Final = re.compile(OWL + "(different|AllDifferent|AllDisjoint|disjoint|propertyDisjoint|complement)")
_ANY_TEXT: Final = "any text"
_SUBCLASS: Final = RDFS + "subClassOf"
_ABOUT_CLASSES: Final = frozenset(
    (_SUBCLASS, RDFS + "domain", RDFS + "range", OWL + "equivalentClass", OWL + "disjointWith")
)
_SPREADS: Final = (RDFS + "subPropertyOf", OWL + "inverseOf", OWL + "equivalentProperty")


def undefined_names(
    content: Content, model: Model | None, vocabulary: Vocabulary, sources: Sequence[OntologyFile]
) -> Iterator[Finding]:
    """Find the classes, properties and individuals that are used and defined nowhere: most are misspelt.

    Names of other vocabularies than those of the ontologies may be defined elsewhere, and are a warning.
    """
    described = {subject for subject, _, _ in content.triples}
    if model is not None:
        described |= {individual.iri for individual in model.individuals()}
    namespaces = {namespace(iri) for iri in described}

    def undefined(subject: str, what: str, name: str, *kinds: str) -> Finding:
        bare = local_name(name)
        known = [iri for iri in described if vocabulary.kinds.get(iri, frozenset()) & {*kinds}]
        same = sorted(iri for iri in known if local_name(iri) == bare)
        remedy = f"did you mean {' or '.join(same)}?" if same else nearest(bare, set(map(local_name, known)))
        level = Level.ERROR if namespace(name) in namespaces else Level.WARN
        message = f"{local_name(subject)}: {what} is not defined"
        return finding_about(local_name(subject), sources, level, message, remedy)

    for subject, predicate, value in content.triples:
        own_value = isinstance(value, str) and not value.startswith(LANGUAGE_NAMESPACES)
        if predicate == RDF_TYPE:
            if own_value and "class" not in vocabulary.kinds.get(str(value), ()):
                yield undefined(subject, f"class {local_name(str(value))}", str(value), "class")
        elif predicate in _ABOUT_CLASSES:
            if own_value and "class" not in vocabulary.kinds.get(str(value), ()):
                what = f"{local_name(predicate)} {local_name(str(value))}"
                if predicate != RDFS + "range" or "datatype" not in vocabulary.kinds.get(str(value), ()):
                    yield undefined(subject, what, str(value), "class")
        elif not predicate.startswith(LANGUAGE_NAMESPACES):
            if predicate not in described:
                yield undefined(subject, f"property {local_name(predicate)}", predicate, *_PROPERTIES)
            elif own_value and value not in described and "object property" in vocabulary.kinds.get(predicate, ()):
                what = f"{local_name(predicate)} {local_name(str(value))}"
                yield undefined(subject, what, str(value), "individual")


def check_designs(
    content: Content,
    model: Model,
    sources: Sequence[OntologyFile],
    modes: Mapping[str, Collection[str]] | None,
    required: Collection[str],
    effects: Mapping[str, Mapping[str, object]],
) -> Iterator[Finding]:
    """Check that functions have designs, and designs have modes.

    Args:
        content: the ontologies.
        model: the functions and designs in them.
        sources: the files that they come from.
        modes: names of the modes by function; None: modes are not checked.
        required: functions that the mission cannot do without.
        effects: what modes do, by function and mode.
    """
    designs: dict[str, set[str]] = {name: set() for name in model.functions}
    functions = {iri: name for name, iri in model.functions.items()}
    names = {iri: name for name, iri in model.designs.items()}
    for design, predicate, function in content.triples:
        if predicate == TOMASYS + "solvesF" and design in names and function in functions:
            designs[functions[str(function)]].add(names[design])
    for name in sorted({*model.functions, *required}):
        level = Level.ERROR if name in required else Level.WARN
        if name not in model.functions:
            message = f"there is no function {name}, which the mission needs"
            yield finding_about(name, sources, Level.ERROR, message)
        elif not designs[name]:
            remedy = f"add an individual of FunctionDesign with solvesF {name}"
            yield finding_about(name, sources, level, f"function {name} has no function design", remedy)
        if modes is not None:
            named, solving = set(modes.get(name, ())), designs.get(name, set())
            spare = named - solving - {UNGROUND_MODE, DEFAULT_MODE}
            for design in sorted(solving - named):
                remedy = nearest(design, spare) or (
                    "add a mode of this name to the System Modes file, or remove the design"
                )
                message = f"function design {design} has no mode of the same name for {name}"
                yield finding_about(design, sources, level, message, remedy)
            for mode in sorted(spare):
                message = f"mode {mode} of {name} has no function design, so it is never chosen"
                does = effects.get(name, {})
                # Nothing is lost if another mode does the same, as with those that only behaviour trees set.
                same = [
                    each for each in sorted(solving | {UNGROUND_MODE}) if mode in does and does.get(each) == does[mode]
                ]
                use = f"mode {same[0]} does the same" if same else None
                yield finding_about(name, sources, Level.INFO if same else Level.WARN, message, use)


def designs_without_performance(content: Content, model: Model, sources: Sequence[OntologyFile]) -> Iterator[Finding]:
    """Find the function designs without an expected performance."""
    expected = expectations(content, model)
    for name in sorted(model.designs):
        if local_name(PERFORMANCE) not in expected.get(name, {}):
            remedy = "add a hasQAestimation of type performance"
            message = f"function design {name} has no performance, so 0.001 is assumed"
            yield finding_about(name, sources, Level.WARN, message, remedy)


def unused_individuals(content: Content, model: Model, sources: Sequence[OntologyFile]) -> Iterator[Finding]:
    """Find the individuals that no fact and no rule mentions, and that mean nothing by themselves."""
    mentioned = {value for _, predicate, value in content.triples if predicate != RDF_TYPE and isinstance(value, str)}
    mentioned |= {
        term.iri for rule in content.rules for atom in rule.atoms for term in atom.arguments if isinstance(term, Named)
    }
    holders = {subject for subject, name, _ in content.triples if not name.startswith(LANGUAGE_NAMESPACES)}
    mentioned |= holders & {*model.components.values()}
    mentioned |= {*model.designs.values(), *(individual.iri for individual in model.individuals())}
    individuals = {individual for individual, _ in memberships(content.triples)}
    for name in sorted(local_name(iri) for iri in individuals - mentioned if not iri.startswith(TOMASYS)):
        yield finding_about(name, sources, Level.INFO, f"nothing refers to {name}")


class _Possible:
    """The classes that can have members, and the values that properties can have: an upper bound for any state."""

    def __init__(self, content: Content, model: Model) -> None:
        self.structure = "".join(content.structure)
        self.classes = {OWL + "Thing", *(TOMASYS + name for name in ("Objective", "FunctionGrounding"))}
        self.classes |= {name for _, name in memberships(content.triples)}
        self.values: dict[str, set[object]] = {}
        self.axioms = [triple for triple in content.triples if triple[1].startswith(LANGUAGE_NAMESPACES)]
        for _, predicate, value in content.triples:
            if not predicate.startswith(LANGUAGE_NAMESPACES):
                self.values.setdefault(predicate, set()).add(canonical(value))
        for name in ("typeF", "typeFD", "solvesO", "o_always_improve"):
            self.values[TOMASYS + name] = {_ANY}
        for name in ("o_status", "c_status"):
            self.values.setdefault(TOMASYS + name, set()).add(_ANY_TEXT)
        if model.attributes:
            self.classes.add(TOMASYS + "QAvalue")
            self.values.update({TOMASYS + name: {_ANY} for name in ("isQAtype", "hasValue")})
        if any(model.estimated.values()):
            self.values[HAS_QA_VALUE] = {_ANY}
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
    """Find the enabled rules that fire in no state, each with an atom of its body that can never hold.

    An atom cannot hold if no ontology asserts it, no state adds it and no rule that can fire concludes it. Each
    property is considered separately, and individuals are not distinguished. So every rule that is returned is dead,
    but not every dead rule is returned.
    """
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


def undeclared_differences(content: Content) -> list[tuple[Rule, Atom]]:
    """Find the enabled rules that ask for different individuals (differentFrom), where nothing makes any different.

    Values of functional properties can, so such a rule is suspicious, not dead.
    """
    terms = (*(predicate for _, predicate, _ in content.triples), *content.structure)
    if any(map(_MAKE_DIFFERENT.search, terms)):
        return []
    rules = content.enabled_rules
    if any(atom.kind == "different" for rule in rules for atom in rule.head):
        return []
    return [(rule, atom) for rule in rules for atom in rule.body if atom.kind == "different"]


def no_estimate(attribute: str) -> tuple[str, str]:
    """Say why no grounding has a value of an attribute, and what would give it one."""
    problem = f"no function design has an estimate of {attribute}, so no grounding has a value of it"
    return problem, f"add a hasQAestimation of type {attribute} to a design"


def no_value(attribute: str, model: Model) -> tuple[str, str]:
    """Say why no grounding has a value of an attribute, as no_estimate does, or because missions do not measure it."""
    if not any(attribute in names for names in model.estimated.values()):
        return no_estimate(attribute)
    return f"missions do not measure {attribute}, so no grounding has a value of it", ""


def unmeasured_rules(
    content: Content, model: Model, measured: Collection[str] | None = None
) -> list[tuple[Rule, Atom, str]]:
    """Find the enabled rules that need a grounding's value (hasQAvalue) of an attribute of which no grounding has one.

    A grounding has the measured values of those attributes that its function design has an estimate of.

    Args:
        content: the ontologies and rules.
        model: what is in them.
        measured: quality attributes that missions measure; None: any.

    Returns:
        each rule with the atom that names the attribute, and the attribute's name.
    """
    has_value, is_type = HAS_QA_VALUE, IS_QA_TYPE
    estimated = frozenset().union(*model.estimated.values())
    never = {
        iri: name
        for name, iri in model.attributes.items()
        if name not in estimated or (measured is not None and name not in measured)
    }
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


def rules_without_values(content: Content, measured: Collection[str]) -> list[tuple[Rule, Atom, str]]:
    """Find the enabled rules that need a value of an attribute of which neither ontologies nor missions have one.

    Args:
        content: the ontologies and rules.
        measured: quality attributes that missions measure.

    Returns:
        each rule with the atom that names the attribute, and the attribute's name.
    """
    if IS_QA_TYPE in content.head_properties():
        return []
    valued = {str(value) for _, predicate, value in content.triples if predicate == IS_QA_TYPE}
    return [
        (rule, atom, local_name(term.iri))
        for rule in content.enabled_rules
        for atom in rule.body
        if atom.predicate == IS_QA_TYPE and isinstance(term := atom.arguments[-1], Named)
        if term.iri not in valued and local_name(term.iri) not in measured
    ]
