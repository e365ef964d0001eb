"""Rules in files: the names that they may use, checks of one rule, rules as text, and rules as RDF
in ontologies.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial
from itertools import chain, count
from pathlib import Path
from typing import NamedTuple

from suave_des.errors import Finding, InputError, KnowledgeError, Level, nearest, with_article
from suave_des.files import decode, read_bytes
from suave_des.knowledge import rdf
from suave_des.knowledge.ontology_file import OntologyFile
from suave_des.knowledge.rdf import (
    DECIMAL,
    EXACT,
    FIRST,
    IS_QA_TYPE,
    LANGUAGE_NAMESPACES,
    MROS,
    OWL,
    RDF,
    RDF_TYPE,
    RDFS,
    REST,
    STRING,
    SWRL,
    SWRLA,
    SWRLB,
    TOMASYS,
    WHOLE,
    XSD,
    Lit,
    Triple,
    local_name,
)
from suave_des.knowledge.rules import (
    ATOM_KINDS,
    BUILTINS,
    DIFFERENT,
    FACT_KINDS,
    IDENTITIES,
    SAME,
    Atom,
    AtomKind,
    Named,
    Place,
    Rule,
    RuleError,
    Term,
    Variable,
    computed,
    write_term,
)
from suave_des.knowledge.rules.expressions import in_words
from suave_des.knowledge.rules.parser import parse_rules

# The names that rules may use, and checks of one rule for mistakes that Pellet drops in silence, or
# that none can use. Which mistakes Pellet ignores was found by giving it each of them (owlready2
# 0.51's Pellet).

_DECLARED = {
    OWL + "Class": "class",
    RDFS + "Class": "class",
    OWL + "ObjectProperty": "object property",
    OWL + "DatatypeProperty": "data property",
    OWL + "AnnotationProperty": "annotation property",
    RDFS + "Datatype": "datatype",
    OWL + "NamedIndividual": "individual",
}


@dataclass(frozen=True)
class Vocabulary:
    """The names that rules may use.

    Attributes:
        kinds: what each IRI is declared as or used as: class, object property, data property,
            annotation property, datatype, individual.
        ranges: datatypes that the values of a data property can have, where that is one datatype or
            a choice of them.
        enumerations: the values that a data property can have, where its range lists them.
        used: what anything says of individuals or of other terms, or a rule concludes, whether or
            not it is declared.
        whole: data properties of which something has or concludes a whole number.
    """

    kinds: Mapping[str, frozenset[str]]
    ranges: Mapping[str, frozenset[str]]
    enumerations: Mapping[str, frozenset[str]]
    used: frozenset[str] = frozenset()
    whole: frozenset[str] = frozenset()

    @classmethod
    def of(
        cls,
        triples: Sequence[Triple],
        structure: Sequence[Triple],
        individuals: Iterable[str],
        enumerations: Mapping[str, frozenset[str]],
    ) -> Vocabulary:
        """Collect the names in triples of ontologies, and those that their structure uses (see
        Content); the individuals are further ones, that exist only in states.
        """
        texts = dict.fromkeys(enumerations, frozenset((STRING,)))
        literals = [(p, o) for _, p, o in triples if isinstance(o, Lit)]
        return cls(
            kinds=_kinds(triples, individuals),
            ranges=_ranges(triples) | texts,
            enumerations=enumerations,
            used=frozenset(
                term for each in (*triples, *structure) for term in each if isinstance(term, str)
            ),
            whole=frozenset(p for p, literal in literals if literal.datatype in WHOLE),
        )

    def with_rules(self, rules: Iterable[Rule]) -> Vocabulary:
        """Add what the heads of rules use."""
        used = {*self.used}
        whole = {*self.whole}
        for atom in (atom for rule in rules for atom in rule.head):
            used |= {atom.predicate, *(t.iri for t in atom.arguments if isinstance(t, Named))}
            # A variable may stand for a whole number.
            if any(isinstance(t, Variable) or t[-1] in WHOLE for t in atom.arguments[1:]):
                whole.add(atom.predicate)
        return replace(self, used=frozenset(used), whole=frozenset(whole))

    @cached_property
    def by_name(self) -> Mapping[str, tuple[str, ...]]:
        """IRIs by their last part, sorted."""
        by_name: dict[str, tuple[str, ...]] = {}
        for iri in sorted(self.kinds):
            by_name[local_name(iri)] = (*by_name.get(local_name(iri), ()), iri)
        return by_name

    def candidates(self, name: str) -> tuple[str, ...]:
        """IRIs that a bare name can mean: those of TOMASys and mros take precedence over others."""
        found = self.by_name.get(name, ())
        shared = tuple(iri for iri in found if iri.startswith((TOMASYS, MROS)))
        return shared or found or ((SWRLB + name,) if SWRLB + name in BUILTINS else ())

    def fitting(self, name: str, wanted: Collection[str]) -> tuple[str, ...]:
        """IRIs that a bare name can mean; if one alone of several is of the wanted kinds, that."""
        found = self.candidates(name)
        if len(found) > 1:
            wished = tuple(iri for iri in found if self.kinds[iri].intersection(wanted))
            return wished if len(wished) == 1 else found
        return found

    def means_itself(self, iri: str) -> bool:
        """Whether the bare name of an IRI means that IRI."""
        return self.candidates(local_name(iri)) == (iri,)

    def guess(self, name: str, wanted: Collection[str]) -> str | None:
        """Suggest a name of the wanted kinds, as a question."""
        bare = local_name(name)
        known = [
            local_name(iri) for iri, kinds in self.kinds.items() if not kinds.isdisjoint(wanted)
        ]
        if "builtin" in wanted:
            known += map(local_name, BUILTINS)
        if bare in known and bare != name:
            return f"did you mean {' or '.join(self.candidates(bare))}?"
        return nearest(bare, known)


def _kinds(triples: Iterable[Triple], individuals: Iterable[str]) -> dict[str, frozenset[str]]:
    """What each name is declared as or used as; further individuals are given."""
    kinds: dict[str, set[str]] = defaultdict(set)
    kinds[OWL + "Thing"].add("class")
    kinds[OWL + "Nothing"].add("class")
    for subject, predicate, value in triples:
        if predicate == RDF_TYPE and isinstance(value, str):
            if value in _DECLARED or not value.startswith(LANGUAGE_NAMESPACES):
                kinds[subject].add(_DECLARED.get(value, "individual"))
        elif not predicate.startswith(LANGUAGE_NAMESPACES):
            kinds[subject].add("individual")
            if isinstance(value, str):
                kinds[value].add("individual")
    for iri in individuals:
        kinds[iri].add("individual")
    return {iri: frozenset(found) for iri, found in kinds.items()}


def _ranges(triples: Iterable[Triple]) -> dict[str, frozenset[str]]:
    """The datatype of each property that has one range.

    All ranges of a property hold at once; which values several of them leave is not worked out.
    """
    ranges: dict[str, set[str]] = defaultdict(set)
    for subject, value in rdf.links(triples, RDFS + "range"):
        if value.startswith(XSD):
            ranges[subject].add(value)
    return {name: frozenset(found) for name, found in ranges.items() if len(found) == 1}


class Problem(NamedTuple):
    """What is wrong in a rule.

    Attributes:
        remedy: what would be right, if that is known.
        is_fatal: whether a reasoner drops the rule, or what it concludes is a contradiction;
            else it only never fires.
    """

    place: Place | None
    message: str
    remedy: str | None = None
    is_fatal: bool = True


#: What the kinds of atoms that name a class or a property are called.
NOUNS = {"class": "class", "object": "object property", "data": "data property"}
_PROPERTIES = ("object property", "data property")
_ARGUMENTS = {"class": 1, "range": 1, "object": 2, "data": 2, "same": 2, "different": 2}


def about_rule(
    rule: Rule, message: str, place: Place | None, remedy: str | None, level: Level = Level.ERROR
) -> Finding:
    """Make a finding about a rule, at the place of an atom or an argument of it, or at the line
    where it begins.
    """
    line, column = place or (rule.line, None)
    return Finding(level, message, str(rule.file), line, rule.name, column, remedy)


def rule_problems(rule: Rule, vocabulary: Vocabulary) -> list[Problem]:
    """Find what keeps a rule from ever having an effect, in the order of its text."""
    found = list(_variable_problems(rule))
    for number, atom in enumerate(rule.atoms):
        found += _atom_problems(atom, vocabulary, is_head=number >= len(rule.body))
    if not rule.head:
        found.append(
            Problem(None, "the rule concludes nothing", "write at least one atom after ->")
        )
    return sorted(found, key=lambda problem: (problem.place or Place(0, 0), problem.message))


def fatal_problems(rule: Rule, vocabulary: Vocabulary) -> list[Finding]:
    """Find the problems with which a rule cannot be used, in the order of its text."""
    return [
        about_rule(rule, each.message, each.place, each.remedy)
        for each in rule_problems(rule, vocabulary)
        if each.is_fatal
    ]


def check_rule(rule: Rule, vocabulary: Vocabulary) -> Rule:
    """Return a rule of a text file that can work.

    Raises:
        RuleError: it cannot; with line and column.
    """
    for place, message, remedy, is_fatal in rule_problems(rule, vocabulary):
        if is_fatal:
            where = str(place or f"line {rule.line}")
            problem = f"rule {rule.name}: {message}"
            raise RuleError(problem, file=rule.file, place=where, remedy=remedy)
    return rule


def check_property_use(rules: Iterable[Rule], vocabulary: Vocabulary) -> None:
    """Check that rules use each property as it is declared.

    Otherwise Pellet drops every rule with that property, and names the wrong ones.

    Raises:
        KnowledgeError: with the file and the rule.
    """
    for rule in rules:
        for atom in rule.atoms:
            others = vocabulary.kinds.get(atom.predicate, frozenset()).intersection(_PROPERTIES)
            wanted = NOUNS.get(atom.kind, "")
            if atom.kind in ("object", "data") and others and wanted not in others:
                problem = f"{local_name(atom.predicate)} is declared as {min(others)}, but used as {wanted}"
                remedy = f"the rule is: {rule.text}"
                raise KnowledgeError(
                    problem, file=rule.file, place=f"rule {rule.name}", remedy=remedy
                )


def _atom_problems(atom: Atom, vocabulary: Vocabulary, *, is_head: bool) -> Iterator[Problem]:
    name = local_name(atom.predicate)
    for number, term in enumerate(atom.arguments):
        if isinstance(term, Lit) and not rdf.is_well_formed(term):
            words = f"{term.text!r} is not an xsd:{local_name(term.datatype)}"
            yield Problem(atom.place(number), words)
            return
    if atom.kind == "builtin":
        yield from _builtin_problems(atom, name, is_head=is_head)
    elif (wrong := _predicate_problem(atom, name, vocabulary, is_head=is_head)) is not None:
        yield wrong
        return
    elif len(atom.arguments) != (wanted := _ARGUMENTS[atom.kind]):
        words = "one argument" if wanted == 1 else "two arguments"
        yield Problem(atom.place(), f"{name} takes {words}, not {len(atom.arguments)}")
        return
    for number, term in enumerate(atom.arguments):
        yield from _argument_problems(atom, number, term, vocabulary, is_head=is_head)


def _predicate_problem(
    atom: Atom, name: str, vocabulary: Vocabulary, *, is_head: bool
) -> Problem | None:
    """Check that a class, property or datatype can hold of something, and is used as declared."""
    if "" in (atom.kind, atom.predicate):
        return Problem(atom.place(), "an atom without a kind that SWRL knows, or without a name")
    if atom.kind == "range":
        return _range_problem(atom, name, vocabulary, is_head=is_head)
    declared = vocabulary.kinds.get(atom.predicate, frozenset())
    wanted = NOUNS.get(atom.kind)
    if wanted is None or wanted in declared or atom.expression:
        return None
    if not declared:
        is_taken = is_head or atom.predicate in vocabulary.used  # by a reasoner, as it is used
        return None if is_taken else _undefined(atom, wanted, vocabulary)
    if "class" in declared:
        words = f"{name} is a class, but is used as a property"
        return Problem(atom.place(), words, f"write {name}(?x)")
    found = max(declared.intersection(_PROPERTIES), default=min(declared))
    words = f"{name} is {with_article(found)}, but is used as {with_article(wanted)}"
    return Problem(atom.place(), words)


def _undefined(atom: Atom, wanted: str, vocabulary: Vocabulary) -> Problem:
    kinds = _PROPERTIES if wanted in _PROPERTIES else (wanted,)
    remedy = vocabulary.guess(atom.predicate, kinds) or f"declare it as {wanted} in the ontology"
    return Problem(atom.place(), f"{wanted} {local_name(atom.predicate)} is not defined", remedy)


def _range_problem(
    atom: Atom, name: str, vocabulary: Vocabulary, *, is_head: bool
) -> Problem | None:
    if is_head:
        words = f"datatype {name} occurs in the head"
        return Problem(atom.place(), words, "Pellet takes datatypes in bodies only")
    from rdflib import XSD  # with all of rdflib, which few rules need

    defined = (iri for iri, kinds in vocabulary.kinds.items() if "datatype" in kinds)
    known = [*map(str, dir(XSD)), *defined]
    if atom.expression or atom.predicate in known:
        return None
    words = f"datatype {name} is not defined"
    return Problem(atom.place(), words, nearest(name, map(local_name, known)))


def _argument_problems(
    atom: Atom, number: int, term: Term, vocabulary: Vocabulary, *, is_head: bool
) -> Iterator[Problem]:
    """Check that an argument is an individual or a value, as required, and possible for that
    property.
    """
    name = local_name(atom.predicate)
    place = atom.place(number)
    takes_value = atom.takes_value(number)
    if isinstance(term, Lit) and not takes_value:
        words = f"{name}: {write_term(term)} is a value, but an individual is needed"
        yield Problem(place, words)
    elif isinstance(term, Named):
        thing = local_name(term.iri)
        if takes_value:
            words = f"{name}: {thing} is an individual where a value is needed"
            yield Problem(place, words, f'a text needs quotes: "{thing}"')
        elif not is_head and _asks_of_nothing(atom, term, vocabulary):
            words = f"individual {thing} is not defined"
            yield Problem(place, words, vocabulary.guess(term.iri, ("individual",)))
    elif isinstance(term, Lit) and atom.kind == "data":
        yield from _value_problems(atom, place, term, vocabulary, is_head=is_head)


def _asks_of_nothing(atom: Atom, term: Named, vocabulary: Vocabulary) -> bool:
    """Whether an atom asks for a class or property of a name that stands for nothing."""
    is_known = term.iri in vocabulary.used or term.iri in vocabulary.kinds
    holds_of_all = atom.predicate == OWL + "Thing" or bool(atom.expression)
    return atom.kind in NOUNS and not holds_of_all and not is_known


def _value_problems(
    atom: Atom, place: Place | None, term: Lit, vocabulary: Vocabulary, *, is_head: bool
) -> Iterator[Problem]:
    """Check that a property can have a value."""
    name = local_name(atom.predicate)
    consequence = "contradicts whatever it is concluded of" if is_head else "never matches"
    ranges = vocabulary.ranges.get(atom.predicate, frozenset({term.datatype}))
    values = vocabulary.enumerations.get(atom.predicate, frozenset({term.text}))
    may_be_whole = is_head or atom.predicate in vocabulary.whole
    if not _is_in(ranges, term, may_be_whole=may_be_whole):
        wanted = " or ".join(sorted(map(local_name, ranges)))
        words = f"{write_term(term)} is not {with_article(wanted)}, the range of {name}: it {consequence}"
        remedy = f"a value of {wanted}"
        if term.datatype in WHOLE and DECIMAL in ranges:
            remedy = f"write {term.text}.0"
        yield Problem(place, words, remedy, is_head)
    elif term.text not in values:
        words = f"{write_term(term)} is not among the values of {name}: it {consequence}"
        remedy = nearest(term.text, values) or f"one of {', '.join(sorted(values))}"
        yield Problem(place, words, remedy, is_head)


def _is_in(ranges: Collection[str], value: Lit, *, may_be_whole: bool) -> bool:
    """Whether a value is in one of some datatypes.

    A whole number is a decimal, which matches no decimal as they are measured, but one that
    `may_be_whole`.
    """
    if value.datatype not in WHOLE:
        return value.datatype in ranges
    taking = EXACT if may_be_whole else WHOLE
    return not taking.isdisjoint(ranges)


def _builtin_problems(atom: Atom, name: str, *, is_head: bool) -> Iterator[Problem]:
    counts = BUILTINS.get(atom.predicate)
    if counts is None:
        known = sorted(map(local_name, BUILTINS))
        suggestion = nearest(name, known) or f"known: {', '.join(known)}"
        yield Problem(atom.place(), f"there is no builtin {name} in Pellet", suggestion)
        return
    if is_head:
        words = f"builtin {name} occurs in the head"
        yield Problem(atom.place(), words, "Pellet takes builtins in bodies only")
    least, most = counts
    if not least <= len(atom.arguments) <= most:
        wanted = {least: f"{least}", 99: f"{least} or more"}.get(most, f"{least} to {most}")
        words = f"{name} takes {wanted} arguments, not {len(atom.arguments)}"
        remedy = "arguments are separated by commas, and decimals have a point"
        yield Problem(atom.place(), words, remedy)


def variable_uses(atoms: Iterable[Atom]) -> Iterator[tuple[Atom, int, str]]:
    """(atom, number of the argument, name) of each variable."""
    for atom in atoms:
        for number, term in enumerate(atom.arguments):
            if isinstance(term, Variable):
                yield atom, number, term.name


def _variable_problems(rule: Rule) -> Iterator[Problem]:
    """Find unbound variables, and variables that stand for both an individual and a value."""
    individuals: dict[str, Place | None] = {}
    values: dict[str, Place | None] = {}
    for atom, number, name in variable_uses(rule.atoms):
        places = values if atom.takes_value(number) else individuals
        places.setdefault(name, atom.place(number))
    for name in sorted(individuals.keys() & values.keys()):
        place = max(filter(None, (individuals[name], values[name])), default=None)
        yield Problem(place, f"?{name} stands for an individual and for a value")
    bound = _bound_in(rule)
    testing = [atom for atom in rule.body if atom.kind in ("builtin", "range")]
    for atom, number, name in variable_uses(testing):
        if name not in bound:
            words = f"?{name} has no value in {local_name(atom.predicate)}: no other atom binds it"
            yield Problem(atom.place(number), words, nearest(name, bound))
    for atom, number, name in variable_uses(rule.head):
        if name not in bound:
            words = f"?{name} occurs in the head, but the body does not bind it"
            yield Problem(atom.place(number), words, nearest(name, bound))


def _bound_in(rule: Rule) -> set[str]:
    """The variables of a rule that facts give a value, or built-ins compute from these."""
    facts = (atom for atom in rule.body if atom.kind in FACT_KINDS)
    bound = {name for atom in facts for name in atom.variables()}
    while more := {name for atom in rule.body for name in computed(atom, bound)} - bound:
        bound |= more
    return bound


# Rules as text.

RULES_LIMIT_BYTES = 8 * 2**20


@dataclass(frozen=True)
class RulesFile:
    """A file of rules as text.

    Attributes:
        parsed: its rules, before their names are looked up.
        errors: one for each rule that cannot be read.
    """

    path: Path
    text: str
    parsed: tuple[Rule, ...]
    errors: tuple[RuleError, ...]

    @classmethod
    def read(cls, path: Path) -> RulesFile:
        """Read a file.

        Raises:
            InputError: it is missing, a folder, too large, or not text in UTF-8.
        """
        text = decode(path, read_bytes(path, RULES_LIMIT_BYTES))
        if text.lstrip().startswith("<?xml"):
            raise InputError(
                "this is XML, not rules as text", file=path, remedy="give it with --ontology"
            )
        text = text.replace("\r\n", "\n").replace("\r", "\n")
        return cls(path, text, *parse_rules(text, path))

    def rules(self, vocabulary: Vocabulary) -> tuple[Rule, ...]:
        """Look up the names in its rules, and check those that are enabled.

        Raises:
            RuleError: a rule cannot be read or used; with line and column.
        """
        for error in self.errors:
            raise error
        found = [looked_up(rule, vocabulary) for rule in self.parsed]
        known = vocabulary.with_rules(found)  # one may conclude what another asks for
        return tuple(check_rule(rule, known) if rule.enabled else rule for rule in found)


def looked_up(rule: Rule, vocabulary: Vocabulary) -> Rule:
    """Look up all names of a rule that was parsed.

    Raises:
        RuleError: a name is unknown or ambiguous; with line and column.
    """
    resolved = partial(_resolved, vocabulary=vocabulary, file=rule.file)
    return replace(rule, body=tuple(map(resolved, rule.body)), head=tuple(map(resolved, rule.head)))


def _resolved(atom: Atom, vocabulary: Vocabulary, file: Path) -> Atom:
    kinds = (*NOUNS.values(), "builtin")
    predicate = _iri(atom.predicate, atom.place(), vocabulary, file, kinds)

    def named(number: int, word: str) -> Named:
        otherwise = f'declare it, or write "{word}" for a text, ?{word} for a variable'
        if predicate == IS_QA_TYPE and number == 1:
            otherwise = f"declare it: an individual {word} of QualityAttributeType"
        return Named(_iri(word, atom.place(number), vocabulary, file, ("individual",), otherwise))

    arguments = tuple(
        named(n, term.iri) if isinstance(term, Named) else term
        for n, term in enumerate(atom.arguments)
    )
    return Atom(_kind(predicate, arguments, vocabulary), predicate, arguments, atom.places)


def _iri(
    name: str,
    place: Place | None,
    vocabulary: Vocabulary,
    file: Path,
    kinds: Collection[str],
    otherwise: str = "",
) -> str:
    if ":" in name:
        return name
    if name in ("sameAs", "differentFrom") and "class" in kinds:
        return OWL + name
    found = vocabulary.fitting(name, kinds)
    if len(found) == 1:
        return found[0]
    problem = f"{name} is ambiguous"
    remedy = f"write {' or '.join(found)}"
    if not found:
        problem = f"{name} is not defined"
        remedy = vocabulary.guess(name, kinds) or otherwise
    raise RuleError(problem, file=file, place=str(place) if place else None, remedy=remedy)


def _kind(predicate: str, arguments: tuple[Term, ...], vocabulary: Vocabulary) -> AtomKind:
    """Return the kind of an atom's name: as declared if possible, otherwise as its arguments
    suggest.
    """
    if predicate in IDENTITIES:
        return "same" if predicate == SAME else "different"
    if predicate.startswith(SWRLB):
        return "builtin"
    if predicate.startswith(XSD):
        return "range"
    declared = vocabulary.kinds.get(predicate, frozenset())
    if "datatype" in declared:
        return "range"
    if len(arguments) < 2:
        return "class"
    takes_value = isinstance(arguments[1], Lit)
    used_for = declared.intersection(_PROPERTIES)
    if len(used_for) == 1:
        takes_value = "data property" in used_for
    return "data" if takes_value else "object"


_IMP = SWRL + "Imp"
_VARIABLE = SWRL + "Variable"
ENABLED = SWRLA + "isRuleEnabled"
_PREDICATE_OF = {
    "object": "propertyPredicate",
    "data": "propertyPredicate",
    "class": "classPredicate",
    "range": "dataRange",
    "builtin": "builtin",
}
_NAMES: Mapping[str, str] = {"same": SAME, "different": DIFFERENT}
_CLASS_OF = {kind: name for name, kind in ATOM_KINDS.items()}

#: Ends the names that rules without one get.
WITHOUT_NAME = "without a name"
#: Begins the IRIs given to variables, as Protégé does.
_VARIABLES = "urn:swrl:var#"


# as many as there are files in the cache of those: their rules are read again and again
@lru_cache(maxsize=4)
def rules_of(file: OntologyFile) -> tuple[Rule, ...]:
    """All rules of one file, enabled or not, sorted by name and text."""
    read = {node: _read_rule(file, node) for node in rdf.members(file.triples, [_IMP])}
    rules: list[Rule] = []
    numbers = count(1)
    for node, rule in sorted(read.items(), key=lambda each: (each[1].text, each[0])):
        label = file.value(node, RDFS + "label")
        name = label.text if isinstance(label, Lit) else local_name(node)
        if label is None and rdf.is_node(node):
            name = f"rule {next(numbers)} {WITHOUT_NAME}"
        rules.append(replace(rule, name=name, line=file.line_of_rule(name)))
    return tuple(sorted(rules, key=lambda rule: (rule.name, rule.text)))


def _read_rule(file: OntologyFile, node: str) -> Rule:
    """Read a rule without its name."""
    names: dict[str, str] = {}
    body, head = (_read_side(file, node, side, names) for side in ("body", "head"))
    undeclared = tuple(name for iri, name in names.items() if _VARIABLE not in file.kinds(iri))
    mark = file.value(node, ENABLED)
    enabled = not isinstance(mark, Lit) or mark.text.strip().lower() not in ("false", "0")
    triples = tuple(_closure(file, node))
    return Rule("", body, head, enabled, file.path, triples=triples, undeclared=undeclared)


def _closure(file: OntologyFile, start: str) -> Iterator[Triple]:
    """The triples of a rule: its own, and those of its lists and atoms, in a fixed order."""
    waiting = [start]
    seen = {start}
    while waiting:
        for triple in sorted(file.about(waiting.pop()), key=lambda triple: triple[1]):
            yield triple
            value = triple[2]
            if isinstance(value, str) and value not in seen and _is_part_of_rule(file, value):
                seen.add(value)
                waiting.append(value)


def _is_part_of_rule(file: OntologyFile, node: str) -> bool:
    """Whether a node is a list or an atom of a rule: a blank node, or a named one, as older editors
    write them.
    """
    kinds = file.kinds(node)
    named = any(kind.startswith(SWRL) and kind.endswith(("Atom", "AtomList")) for kind in kinds)
    return named or rdf.is_node(node)


def _read_side(file: OntologyFile, rule: str, side: str, names: dict[str, str]) -> tuple[Atom, ...]:
    """Body or head, with short names for variables, which are added to those of the rule, by
    IRI.
    """
    return tuple(
        _read_atom(file, atom, names) for atom in file.items(file.value(rule, SWRL + side))
    )


def _read_atom(file: OntologyFile, node: str | Lit, names: dict[str, str]) -> Atom:
    kinds = file.kinds(node)
    kind: AtomKind = next((ATOM_KINDS[name] for name in kinds if name in ATOM_KINDS), "")
    predicates = (file.value(node, SWRL + name) for name in dict.fromkeys(_PREDICATE_OF.values()))
    name = next((str(term) for term in predicates if term is not None), _NAMES.get(kind, ""))
    # With their nodes numbered equal expressions are equal.
    expression = tuple(rdf.numbered_nodes(_closure(file, name), "_:e")) if rdf.is_node(name) else ()
    atom = Atom(kind, f"_:{in_words(expression)}" if expression else name, (), (), expression)
    terms = (
        _read_term(file, term, names, takes_value=atom.takes_value(number))
        for number, term in enumerate(_arguments_of(file, node, kind))
    )
    return replace(atom, arguments=tuple(terms))


def _arguments_of(file: OntologyFile, node: str | Lit, kind: AtomKind) -> list[str | Lit]:
    if kind == "builtin":
        return list(file.items(file.value(node, SWRL + "arguments")))
    given = (file.value(node, f"{SWRL}argument{number}") for number in (1, 2))
    return [each for each in given if each is not None]


def _read_term(
    file: OntologyFile, term: str | Lit, names: dict[str, str], *, takes_value: bool
) -> Term:
    """A term as Pellet takes it: in a value's place every name is that of a variable."""
    if isinstance(term, Lit):
        return term
    if not takes_value and _VARIABLE not in file.kinds(term):
        return Named(term)
    if term not in names:
        wish = re.sub(r"[^\w-]", "_", local_name(term)).lstrip("-") or "v"
        wishes = chain([wish], (f"{wish}_{number}" for number in count(2)))
        names[term] = next(each for each in wishes if each not in names.values())
    return Variable(names[term])


def triples_of(rule: Rule) -> Sequence[Triple]:
    """The RDF of a rule, which begins with its node: as an ontology has it, or as one would."""
    if rule.triples:
        return rule.triples
    node = "_:rule"
    triples: list[Triple] = [
        (node, RDF_TYPE, _IMP),
        (node, RDFS + "label", Lit(rule.name, STRING)),
    ]
    for variable in dict.fromkeys(name for atom in rule.atoms for name in atom.variables()):
        triples.append((_VARIABLES + variable, RDF_TYPE, _VARIABLE))
    for side, atoms in (("body", rule.body), ("head", rule.head)):
        nodes = [_write_atom(atom, triples) for atom in atoms]
        items = _write_list(nodes, SWRL + "AtomList", triples)
        triples.append((node, SWRL + side, items))
    return triples


def _write_term(term: Term) -> str | Lit:
    if isinstance(term, Lit):
        return term
    return term.iri if isinstance(term, Named) else _VARIABLES + term.name


def _write_atom(atom: Atom, triples: list[Triple]) -> str:
    node = f"_:atom{len(triples)}"
    triples.append((node, RDF_TYPE, _CLASS_OF[atom.kind]))
    if atom.kind in _PREDICATE_OF:
        # Its nodes get names of their own in each atom.
        of_atom = list(rdf.numbered_nodes(atom.expression, f"{node}e"))
        predicate = of_atom[0][0] if of_atom else atom.predicate
        triples.append((node, SWRL + _PREDICATE_OF[atom.kind], predicate))
        triples += of_atom
    if atom.kind == "builtin":
        terms = [_write_term(term) for term in atom.arguments]
        arguments = _write_list(terms, RDF + "List", triples)
        triples.append((node, SWRL + "arguments", arguments))
    else:
        for number, term in enumerate(atom.arguments[:2], start=1):
            triples.append((node, f"{SWRL}argument{number}", _write_term(term)))
    return node


def _write_list(items: Sequence[str | Lit], kind: str, triples: list[Triple]) -> str:
    rest = RDF + "nil"
    for item in reversed(items):
        node = f"_:list{len(triples)}"
        triples += [
            (node, RDF_TYPE, kind),
            (node, FIRST, item),
            (node, REST, rest),
        ]
        rest = node
    return rest
