"""Checks of the model in the ontologies, of what missions have to do with it, and of what rules can fire in it.

Which rules cannot fire is an upper bound of what can hold in any state, found without a reasoner.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Collection, Iterator
from typing import Final

from rdflib import URIRef

from suave_des.domain import DEFAULT_MODE, GENERATE_SEARCH_PATH, UNGROUND_MODE, WATER_VISIBILITY
from suave_des.errors import KnowledgeError, nearest, with_article
from suave_des.findings import Level
from suave_des.knowledge.checks.registry import Found, Material, check
from suave_des.knowledge.content import Content
from suave_des.knowledge.ontology import OPERATORS, Model, Ontology, assumption, wrong_values
from suave_des.knowledge.ontology_file import is_metamodel
from suave_des.knowledge.rdf import (
    C_STATUS,
    HAS_QA_VALUE,
    HAS_VALUE,
    IS_QA_TYPE,
    LANGUAGE_NAMESPACES,
    O_STATUS,
    OWL,
    PERFORMANCE,
    QA_OPERATOR,
    RDF_TYPE,
    RDFS,
    TOMASYS,
    Lit,
    local_name,
    memberships,
    namespace,
    reached,
)
from suave_des.knowledge.rules import EXPRESSION, Atom, Named, Rule, Term, write_atom

_ABOUT_CLASSES: Final = frozenset(
    (RDFS + "subClassOf", RDFS + "domain", RDFS + "range", OWL + "equivalentClass", OWL + "disjointWith")
)
_PROPERTIES: Final = ("object property", "data property", "annotation property")
_ATTRIBUTE: Final = TOMASYS + "QualityAttributeType"


@check(Level.ERROR)
def values(material: Material) -> Iterator[Found]:
    """Find the values that no state can be compared with, or that contradict one another."""
    for subject, problem, remedy in wrong_values(material.base.stated):
        yield local_name(subject), None, f"{local_name(subject)}: {problem}", remedy


@check(Level.ERROR)
def undefined_names(material: Material) -> Iterator[Found]:
    """Find the classes, properties and individuals that are used and defined nowhere: most are misspelt.

    Only those of the ontologies' own namespaces: names of other vocabularies may be defined elsewhere.
    """
    kinds, triples = material.base.vocabulary.kinds, material.content.triples
    of_states = {each.iri for each in material.base.model.individuals()}
    described = {subject for subject, _, _ in triples} | of_states
    kinds_of = Kinds(material.content, material.base.model)
    namespaces = {namespace(iri) for iri in described}
    assumed = {(material.base.model.attributes[name], QA_OPERATOR) for name in material.base.assumed}
    for subject, predicate, value in triples:
        used: tuple[str, str, Collection[str]] | None = None  # words, what is used, what it should be
        is_term = isinstance(value, str) and not value.startswith(LANGUAGE_NAMESPACES)
        if predicate == RDF_TYPE or predicate in _ABOUT_CLASSES:
            wanted = ("class", "datatype") if predicate == RDFS + "range" else ("class",)
            if is_term and kinds.get(str(value), frozenset()).isdisjoint(wanted):
                used = "class" if predicate == RDF_TYPE else local_name(predicate), str(value), ("class",)
        elif not predicate.startswith(LANGUAGE_NAMESPACES) and (subject, predicate) not in assumed:
            if predicate not in described:
                used = "property", predicate, _PROPERTIES
            elif is_term and value not in described and "object property" in kinds.get(predicate, ()):
                used = local_name(predicate), str(value), ("individual",)
        if used is not None and namespace(used[1]) in namespaces:
            words, name, meant = used
            wanted_kind = kinds_of.wanted.get((predicate, 1)) if meant == ("individual",) else None
            known = [iri for iri in described - of_states if kinds.get(iri, frozenset()) & {*meant}]
            known = [iri for iri in known if wanted_kind is None or wanted_kind in kinds_of.of[iri]]
            same = sorted(iri for iri in known if local_name(iri) == local_name(name))
            remedy = f"did you mean {' or '.join(same)}?" if same else nearest(local_name(name), map(local_name, known))
            if remedy is None and wanted_kind is not None:
                remedy = f"declare {with_article(local_name(wanted_kind))} of this name"
            problem = f"{local_name(subject)}: {words} {local_name(name)} is not defined"
            yield local_name(subject), None, problem, remedy


@check(Level.ERROR)
def missing_functions(material: Material) -> Iterator[Found]:
    """Find the functions that the mission needs and that are not there, or have no design."""
    return ((name, None, problem, remedy) for name, problem, remedy in material.base.unsolved(material.subject.needed))


@check(Level.WARN)
def functions_without_design(material: Material) -> Iterator[Found]:
    """Find the other functions that have no design."""
    others = material.base.model.functions.keys() - {*material.subject.needed}
    return ((name, None, problem, remedy) for name, problem, remedy in material.base.unsolved(others))


def _designs_and_modes(material: Material) -> Iterator[tuple[str, set[str], set[str]]]:
    """(function, its designs, its modes that a design could have the name of) of the model, if modes are checked."""
    for function in sorted(material.base.model.functions if material.subject.modes is not None else ()):
        modes = {*(material.subject.modes or {}).get(function, ())} - {UNGROUND_MODE, DEFAULT_MODE}
        yield function, {*material.base.designs(function)}, modes


@check(Level.ERROR)
def designs_without_mode(material: Material) -> Iterator[Found]:
    """Find the function designs that no mode has the name of."""
    otherwise = "add a mode of this name to the System Modes file, or remove the design"
    for function, designs, modes in _designs_and_modes(material):
        for design in sorted(designs - modes):
            problem = f"function design {design} has no mode of the same name for {function}"
            yield design, None, problem, nearest(design, modes - designs) or otherwise


@check(Level.INFO)
def modes_without_design(material: Material) -> Iterator[Found]:
    """Note the modes that metacontrol never chooses, such as those of behaviour trees."""
    for function, designs, modes in _designs_and_modes(material):
        if spare := sorted(modes - designs):
            problem = (
                f"modes of {function} without function design, which metacontrol never chooses: {', '.join(spare)}"
            )
            yield function, None, problem, None


@check(Level.WARN)
def attributes_that_do_not_fit(material: Material) -> Iterator[Found]:
    """Find quality attributes that missions measure and ontologies lack, or compare with nothing."""
    model, measured = material.base.model, material.subject.measured
    for name in sorted({*(measured or ())} - model.attributes.keys()):
        problem = f"missions measure {name}, but no ontology has a quality attribute type of this name"
        yield name, None, problem, nearest(name, model.attributes) or "declare a QualityAttributeType of this name"
    for name in () if rules_of_2023(material.content) else without_operator(material.content, model, measured or ()):
        designs = ", ".join(sorted(design for design, names in model.estimated.items() if name in names))
        problem = f"{name} has no qa_comparison_operator, so what is measured never rules out a design: {designs}"
        yield name, None, problem, f"give it one of {' '.join(OPERATORS)}, usually <"
    valued = {subject for subject, predicate, _ in material.content.triples if predicate == HAS_VALUE}
    for name, each in model.measurements.items():
        if measured is not None and each.iri in valued and name not in measured:
            problem = f"hasValue of {local_name(each.iri)} is not used: {name} has the value that missions measure"
            yield local_name(each.iri), None, problem, "measure it in the scenario"


def without_operator(content: Content, model: Model, measured: Collection[str]) -> list[str]:
    """Return the quality attributes that missions measure and designs expect, and that cannot be compared."""
    compared = {subject for subject, predicate, _ in content.triples if predicate == QA_OPERATOR}
    expected = frozenset().union(*model.estimated.values()) - {local_name(PERFORMANCE)}
    return sorted(name for name in expected.intersection(measured) if model.attributes[name] not in compared)


@check(Level.WARN)
def thresholds_without_reaction(material: Material) -> Iterator[Found]:
    """Find the search designs whose expected visibility the metric of reactions does not know."""
    known = material.subject.reaction_thresholds_m
    for design in material.base.designs(GENERATE_SEARCH_PATH) if known is not None else ():
        expected_m = material.base.expected(design).get(WATER_VISIBILITY)
        if expected_m is not None and float(expected_m) not in (known or ()):
            problem = f"{design} expects a visibility of {expected_m} m, by which mean_reaction_time_s does not judge"
            yield design, None, problem, "set reaction_metric.visibility_thresholds_m and expected_altitudes_m"


@check(Level.WARN)
def attributes_declared_twice(material: Material) -> Iterator[Found]:
    """Find the quality attribute types that several files declare: what each of them says of one holds."""
    for name, iri in material.base.model.attributes.items():
        declared = (URIRef(iri), URIRef(RDF_TYPE), URIRef(_ATTRIBUTE))
        paths = [each.path for each in material.base.sources if declared in each.graph]
        for path in paths[:-1]:
            problem = f"declares the quality attribute type {name}, and so does {paths[-1]}"
            yield path, None, problem, "declare it in one of them"


@check(Level.INFO)
def unknown_to_missions(material: Material) -> Iterator[Found]:
    """Note the components that nothing reports, the attributes that nothing measures, and what is assumed."""
    content, subject = material.content, material.subject
    asserted = {each for each, predicate, _ in content.triples if predicate == C_STATUS}
    if subject.reported is not None and C_STATUS not in content.head_properties():
        for name, iri in sorted(material.base.model.components.items()):
            if name not in subject.reported and iri not in asserted:
                problem = (
                    f"nothing in the simulation reports the status of component {name}, so missions never have one"
                )
                yield name, None, problem, f"reported are {', '.join(subject.reported)}"
    expected = frozenset().union(*material.base.model.estimated.values()) - {local_name(PERFORMANCE)}
    for name in sorted(expected.difference(subject.measured if subject.measured is not None else expected)):
        yield name, None, f"missions do not measure {name}, so what designs expect of it is compared with nothing", None
    for name, sign in material.base.assumed.items():
        yield name, None, assumption(name, sign), None


def rules_of_2023(content: Content) -> list[tuple[Rule, Atom]]:
    """Find the enabled rules that conclude the status UPDATABLE, as the exemplar's ontologies of 2023 do."""
    return [
        (rule, atom)
        for rule in content.enabled_rules
        for atom in rule.head
        if atom.predicate == O_STATUS and isinstance(atom.arguments[-1], Lit) and atom.arguments[-1].text == "UPDATABLE"
    ]


def check_revision(base: Ontology, measured: Collection[str], revision: str) -> None:
    """Check that ontologies of the exemplar's revision 2023 are used with that revision.

    With a later one no design is ever ruled out, as its code assumes no operator, so that objectives stay in error;
    the first thruster that recovers then contradicts that.

    Args:
        base: the ontologies with the operators that the revision assumes, and rules.
        measured: the quality attributes that the scenario measures.
        revision: the scenario's, for the message.

    Raises:
        KnowledgeError: with the file and line of the rule.
    """
    missing = without_operator(base.content, base.model, measured)
    for rule, atom in rules_of_2023(base.content) if missing else ():
        raise KnowledgeError(
            f"these are ontologies of revision 2023, and the scenario's revision is {revision}: rule {rule.name} "
            f"concludes {write_atom(atom)}, and {missing[0]} has no qa_comparison_operator",
            file=rule.file,
            place=base.place_of(rule),
            remedy=f'write revision: "2023" in the scenario, or use ontologies of revision {revision}',
        )


#: Axioms by which the members of a class, or the values of a property, are those of another, or members of a class.
_LEADS: Final = tuple(RDFS + name for name in ("subClassOf", "subPropertyOf", "domain", "range"))
_BOTH_WAYS: Final = tuple(OWL + name for name in ("equivalentClass", "equivalentProperty", "inverseOf"))
#: What states assert, whatever the ontologies say.
_IN_STATES: Final = tuple(
    TOMASYS + name for name in ("Objective", "FunctionGrounding", "typeF", "typeFD", "solvesO", "o_always_improve")
)
#: Axioms by which individuals are different: declared so, or members of disjoint classes or properties.
_MAKE_DIFFERENT: Final = re.compile(OWL + "(different|AllDifferent|AllDisjoint|disjoint|propertyDisjoint|complement)")
#: Classes of which nothing is a member of two, unless an ontology or a rule says so.
_KINDS: Final = frozenset(
    TOMASYS + name
    for name in (
        *("Component", "Function", "FunctionDesign", "FunctionGrounding"),
        *("Objective", "QAvalue", "QualityAttributeType"),
    )
)


def dead_rules(content: Content, model: Model) -> list[tuple[Rule, Atom]]:
    """Find the enabled rules that fire in no state, each with an atom of its body that can never hold.

    An atom cannot hold if no ontology asserts its class or property, no state adds it and no rule that can fire
    concludes it. Individuals and values are not distinguished. So every rule that is returned is dead, but not every
    dead rule is returned.
    """
    steps = [(one, str(other)) for one, name, other in content.triples if name in (*_LEADS, *_BOTH_WAYS)]
    steps += [
        (str(other), one) for one, name, other in content.triples if name in (*_BOTH_WAYS, RDFS + "subPropertyOf")
    ]
    structure = "".join(content.structure)
    held = {OWL + "Thing", EXPRESSION, C_STATUS, O_STATUS, *_IN_STATES}
    held |= {*(name for _, name in memberships(content.triples)), *(name for _, name, _ in content.triples)}
    held |= {TOMASYS + "QAvalue", IS_QA_TYPE, HAS_VALUE} if model.attributes else set()
    held |= {HAS_QA_VALUE} if any(model.estimated.values()) else set()
    waiting, possible = list(content.enabled_rules), reached(held, steps)

    def allows(atom: Atom) -> bool:
        is_named = atom.kind in ("class", "object", "data") and atom.arguments
        # Class expressions and property chains are not followed.
        return not is_named or atom.predicate in possible or f"<{atom.predicate}>" in structure

    while firing := [rule for rule in waiting if all(map(allows, rule.body))]:
        held.update(atom.predicate for rule in firing for atom in rule.head)
        possible = reached(held, steps)
        waiting = [rule for rule in waiting if rule not in firing]
    return [(rule, next(atom for atom in rule.body if not allows(atom))) for rule in waiting]


def rules_for_other_models(material: Material) -> list[Rule]:
    """Find the rules of TOMASys and mros that need what this model does not have; they have rules for any."""
    found = []
    for rule, _ in dead_rules(material.content, material.base.model):
        source = material.base.source_of(rule)
        is_known = all(
            atom.kind == "builtin" or material.base.vocabulary.kinds.get(atom.predicate) for atom in rule.atoms
        )
        if is_known and source is not None and is_metamodel(source):
            found.append(rule)
    return found


def unmeasured_rules(
    content: Content, model: Model, measured: Collection[str] | None = None
) -> list[tuple[Rule, Atom, str, str | None]]:
    """Find the enabled rules that need a value of a quality attribute of which nothing has one.

    A grounding has the measured values (hasQAvalue) of those attributes that its function design has an estimate of.
    Other values are in the ontologies, or measured.

    Args:
        content: the ontologies and rules.
        model: what is in them.
        measured: quality attributes that missions measure; None: any.

    Returns:
        each rule with the atom that names the attribute, what is wrong, and what would be right.
    """
    if IS_QA_TYPE in content.head_properties():
        return []
    elsewhere = HAS_QA_VALUE in content.head_properties() or any(p == HAS_QA_VALUE for _, p, _ in content.triples)
    estimated = frozenset().union(*model.estimated.values())
    valued = {local_name(str(value)) for _, predicate, value in content.triples if predicate == IS_QA_TYPE}
    found = []
    for rule in content.enabled_rules:
        held = {atom.arguments[-1] for atom in rule.body if atom.predicate == HAS_QA_VALUE}
        for atom in rule.body:
            if atom.predicate != IS_QA_TYPE or len(atom.arguments) != 2 or not isinstance(atom.arguments[1], Named):
                continue
            name = local_name(atom.arguments[1].iri)
            is_measured = measured is None or name in measured
            problem: tuple[str, str | None] | None = None
            if atom.arguments[0] not in held:
                if not is_measured and name not in valued:
                    problem = f"missions do not measure {name}, and no ontology has a value of it", None
            elif name in model.attributes and not elsewhere:
                if name not in estimated:
                    reason = f"no function design has an estimate of {name}, so no grounding has a value of it"
                    problem = reason, f"add a hasQAestimation of type {name} to a design"
                elif not is_measured:
                    problem = f"missions do not measure {name}, so no grounding has a value of it", None
            if problem is not None:
                found.append((rule, atom, *problem))
    return found


def undeclared_differences(content: Content) -> Iterator[tuple[Rule, Atom]]:
    """Find the enabled rules that ask for different individuals (differentFrom), where nothing makes any different.

    Values of functional properties can, so such a rule is suspicious, not dead.
    """
    rules = content.enabled_rules
    terms = (*(predicate for _, predicate, _ in content.triples), *content.structure)
    if any(map(_MAKE_DIFFERENT.search, terms)) or any(atom.kind == "different" for rule in rules for atom in rule.head):
        return iter(())
    return ((rule, atom) for rule in rules for atom in rule.body if atom.kind == "different")


class Kinds:
    """What properties are declared for (rdfs:domain, rdfs:range): the kinds of things in TOMASys.

    A reasoner contradicts no other use: it concludes that the thing is both, and a rule that needs both never fires.
    Where an ontology or a rule makes something a thing of two kinds, none excludes another.
    """

    def __init__(self, content: Content, model: Model) -> None:
        steps = [(s, str(o)) for s, p, o in content.triples if p in (RDFS + "subClassOf", OWL + "equivalentClass")]
        self.of: dict[str, set[str]] = defaultdict(set)
        for thing, name in (*memberships(content.triples), *steps):
            self.of[thing] |= reached({name}, steps) & _KINDS
        groups = (("Objective", model.objectives), ("FunctionGrounding", model.groundings))
        for kind, individuals in (*groups, ("QAvalue", model.measurements)):
            for each in individuals.values():
                self.of[each.iri].add(TOMASYS + kind)
        heads = content.head_classes()
        self._is_mixed = any(len(kinds) > 1 for kinds in self.of.values()) or not _KINDS.isdisjoint(heads)
        #: Kind by the property and the argument's number.
        self.wanted: dict[tuple[str, int], str] = {}
        for subject, predicate, value in content.triples:
            if predicate in (RDFS + "domain", RDFS + "range") and value in _KINDS:
                self.wanted[subject, int(predicate == RDFS + "range")] = str(value)

    def uses(self, rule: Rule) -> Iterator[tuple[Atom, Term, str]]:
        """(atom, argument, kind) wherever a rule needs a thing of a kind; classes in heads are concluded."""
        if self._is_mixed:
            return
        for atom in rule.body:
            if atom.kind == "class" and atom.predicate in _KINDS and len(atom.arguments) == 1:
                yield atom, atom.arguments[0], atom.predicate
        for atom in rule.atoms:
            for number, term in enumerate(atom.arguments if atom.kind in ("object", "data") else ()):
                kind = self.wanted.get((atom.predicate, number))
                if kind is not None and not isinstance(term, Lit):
                    yield atom, term, kind
