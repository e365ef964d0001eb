"""The names that rules may use, and checks of one rule for mistakes that Pellet drops in silence, or that none can use.

Which mistakes Pellet ignores was found by giving it each of them (owlready2 0.51's Pellet).
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final

from suave_des.errors import Finding, KnowledgeError, Level, nearest, with_article
from suave_des.knowledge.rdf import (
    LANGUAGE_NAMESPACES,
    MROS,
    OWL,
    RDF_TYPE,
    RDFS,
    SWRLB,
    TOMASYS,
    XSD,
    Lit,
    Triple,
    is_well_formed,
    local_name,
    reached,
)
from suave_des.knowledge.rules import (
    BUILTINS,
    EXPRESSION,
    TESTERS,
    Atom,
    Named,
    Place,
    Rule,
    RuleError,
    Term,
    Variable,
    literal_text,
)

_DECLARED: Final = {
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
        kinds: what each IRI is declared as or used as: class, object property, data property, annotation property,
            datatype, individual.
        by_name: IRIs by their last part.
        ranges: datatypes that the values of a data property can have, where that is one datatype or a choice of them.
        enumerations: the values that a data property can have, where its range lists them.
    """

    kinds: Mapping[str, frozenset[str]]
    by_name: Mapping[str, tuple[str, ...]]
    ranges: Mapping[str, frozenset[str]]
    enumerations: Mapping[str, frozenset[str]] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        triples: Collection[Triple],
        individuals: Iterable[str] = (),
        enumerations: Mapping[str, frozenset[str]] | None = None,
    ) -> Vocabulary:
        """Collect the names in triples.

        Args:
            triples: of the ontologies.
            individuals: further ones, that exist only in states.
            enumerations: the values that data properties can have, where their ranges list them.
        """
        kinds: dict[str, set[str]] = defaultdict(set, {OWL + "Thing": {"class"}, OWL + "Nothing": {"class"}})
        ranges: dict[str, set[str]] = defaultdict(set)
        by_name: dict[str, list[str]] = defaultdict(list)
        for subject, predicate, value in triples:
            if predicate == RDF_TYPE and isinstance(value, str):
                if value in _DECLARED or not value.startswith(LANGUAGE_NAMESPACES):
                    kinds[subject].add(_DECLARED.get(value, "individual"))
            elif not predicate.startswith(LANGUAGE_NAMESPACES):
                kinds[subject].add("individual")
                if isinstance(value, str):
                    kinds[value].add("individual")
            elif predicate == RDFS + "range" and isinstance(value, str) and value.startswith(XSD):
                ranges[subject].add(value)
        for iri in individuals:
            kinds[iri].add("individual")
        for iri in sorted(kinds):
            by_name[local_name(iri)].append(iri)
        return cls(
            {iri: frozenset(found) for iri, found in kinds.items()},
            {name: tuple(found) for name, found in by_name.items()},
            # All ranges of a property hold at once; which values several of them leave is not worked out.
            {name: frozenset(found) for name, found in ranges.items() if len(found) == 1}
            | dict.fromkeys(enumerations or (), frozenset((XSD + "string",))),
            enumerations or {},
        )

    def candidates(self, name: str) -> tuple[str, ...]:
        """IRIs that a bare name can mean: those of TOMASys and mros take precedence over others."""
        found = self.by_name.get(name, ())
        shared = tuple(iri for iri in found if iri.startswith((TOMASYS, MROS)))
        return shared or found or ((SWRLB + name,) if SWRLB + name in BUILTINS else ())

    def means_itself(self, iri: str) -> bool:
        """Whether the bare name of an IRI means that IRI."""
        return self.candidates(local_name(iri)) == (iri,)

    def guess(self, name: str, wanted: Collection[str]) -> str | None:
        """Suggest a name of the wanted kinds, as a question."""
        bare = local_name(name)
        known = [each for each, iris in self.by_name.items() if any(self.kinds[iri] & {*wanted} for iri in iris)]
        if "builtin" in wanted:
            known += map(local_name, BUILTINS)
        if bare in known and bare != name:
            return f"did you mean {' or '.join(self.candidates(bare))}?"
        return nearest(bare, known)


#: What is wrong in a rule: where, in words, and what would be right, if that is known.
Problem = tuple[Place | None, str, str | None]
_DECLARED_AS: Final = {"class": "class", "object": "object property", "data": "data property"}
_ARGUMENTS: Final = {"class": 1, "range": 1, "object": 2, "data": 2, "same": 2, "different": 2}


def about_rule(
    rule: Rule,
    message: str,
    place: Place | None = None,
    remedy: str | None = None,
    level: Level = Level.ERROR,
    begins: str | None = None,
) -> Finding:
    """Make a finding about a rule, with the line where it begins, or where an atom of it is.

    Args:
        rule: the rule.
        message, remedy, level: of the finding.
        place: of the atom or argument.
        begins: where an ontology has the rule, as "line 12".
    """
    begins = rule.place or begins
    line = place.line if place and rule.place else int(begins.removeprefix("line ")) if begins else None
    return Finding(level, message, str(rule.file), line, rule.name, place.column if place else None, remedy)


def fatal_problems(rule: Rule, vocabulary: Vocabulary) -> list[Finding]:
    """Find the problems with which a rule cannot work, in the order of its text."""
    found = list(_variable_problems(rule))
    for number, atom in enumerate(rule.atoms):
        found += _atom_problems(atom, vocabulary, is_head=number >= len(rule.body))
    if not rule.head:
        found.append((None, "the rule concludes nothing", "write at least one atom after ->"))
    ordered = sorted(found, key=lambda problem: (problem[0] or Place(0, 0), problem[1]))
    return [about_rule(rule, message, place, remedy) for place, message, remedy in ordered]


def first_error(rule: Rule, vocabulary: Vocabulary) -> RuleError | None:
    """The first fatal problem of a rule of a text file, as an error."""
    for each in fatal_problems(rule, vocabulary):
        place = f"line {each.line}, column {each.column}" if each.column else rule.place
        return RuleError(f"rule {rule.name}: {each.message}", file=rule.file, place=place, remedy=each.remedy)
    return None


def check_property_use(rules: Iterable[Rule], vocabulary: Vocabulary) -> None:
    """Check that rules use each property as it is declared.

    Otherwise Pellet drops every rule with that property, and names the wrong ones.

    Raises:
        KnowledgeError: with the file and the rule.
    """
    for rule in rules:
        for atom in rule.atoms:
            wanted, declared = _DECLARED_AS.get(atom.kind), vocabulary.kinds.get(atom.predicate, frozenset())
            others = {"object property", "data property"} & declared if atom.kind in ("object", "data") else frozenset()
            if others and wanted not in others:
                problem = f"{local_name(atom.predicate)} is declared as {min(others)}, but used as {wanted}"
                remedy = f"the rule is: {rule.text}"
                raise KnowledgeError(problem, file=rule.file, place=f"rule {rule.name}", remedy=remedy)


def _atom_problems(atom: Atom, vocabulary: Vocabulary, *, is_head: bool) -> Iterator[Problem]:
    name = local_name(atom.predicate)
    for number, term in enumerate(atom.arguments):
        if isinstance(term, Lit) and not is_well_formed(term):
            yield atom.place(number), f"{term.text!r} is not an xsd:{local_name(term.datatype)}", None
            return
    if atom.kind == "builtin":
        yield from _builtin_problems(atom, name, is_head=is_head)
    elif atom.kind == "" or not atom.predicate:
        yield atom.place(), "an atom without a kind that SWRL knows, or without a name", None
    elif (wrong := _predicate_problem(atom, name, vocabulary)) is not None:
        yield wrong
    elif len(atom.arguments) != (wanted := _ARGUMENTS[atom.kind]):
        words = "one argument" if wanted == 1 else "two arguments"
        yield atom.place(), f"{name} takes {words}, not {len(atom.arguments)}", None
    else:
        for number, term in enumerate(atom.arguments):
            yield from _argument_problems(atom, number, term, vocabulary, is_head=is_head)


def _predicate_problem(atom: Atom, name: str, vocabulary: Vocabulary) -> Problem | None:
    """Check that a class, property or datatype is declared, and used as declared."""
    declared = vocabulary.kinds.get(atom.predicate, frozenset())
    if atom.kind == "range":
        is_known = atom.predicate.startswith(XSD) or "datatype" in declared
        return None if is_known else (atom.place(), f"datatype {name} is not defined", None)
    wanted = _DECLARED_AS.get(atom.kind)
    if wanted is None or wanted in declared or atom.predicate == EXPRESSION:
        return None
    if not declared:
        kinds = ("class",) if atom.kind == "class" else ("object property", "data property")
        remedy = vocabulary.guess(atom.predicate, kinds) or f"declare it as {wanted} in the ontology"
        return atom.place(), f"{wanted} {name} is not defined", remedy
    if "class" in declared:
        return atom.place(), f"{name} is a class, but is used as a property", f"write {name}(?x)"
    found = next((kind for kind in ("object property", "data property") if kind in declared), min(declared))
    return atom.place(), f"{name} is {with_article(found)}, but is used as {with_article(wanted)}", None


def _argument_problems(
    atom: Atom, number: int, term: Term, vocabulary: Vocabulary, *, is_head: bool
) -> Iterator[Problem]:
    """Check that an argument is an individual or a value, as required, and possible for that property."""
    name, place, takes_value = local_name(atom.predicate), atom.place(number), atom.takes_value(number)
    if isinstance(term, Lit) and not takes_value:
        yield place, f"{name}: {literal_text(term)} is a value, but an individual is needed", None
    elif isinstance(term, Named):
        thing = local_name(term.iri)
        if takes_value:
            problem = f"{name}: {thing} is an individual where a value is needed"
            yield place, problem, f'a text needs quotes: "{thing}"'
        elif "individual" not in vocabulary.kinds.get(term.iri, ()):
            yield place, f"individual {thing} is not defined", vocabulary.guess(term.iri, ("individual",))
    elif isinstance(term, Lit) and atom.kind == "data":
        consequence = "contradicts whatever it is concluded of" if is_head else "never matches"
        ranges = vocabulary.ranges.get(atom.predicate, frozenset({term.datatype}))
        values = vocabulary.enumerations.get(atom.predicate, frozenset({term.text}))
        whole = term.datatype == XSD + "integer" and XSD + "decimal" in ranges  # matches no decimal, but is one
        if term.datatype not in ranges and not (whole and is_head):
            wanted = " or ".join(sorted(map(local_name, ranges)))
            problem = f"{literal_text(term)} is not {with_article(wanted)}, the range of {name}: it {consequence}"
            yield place, problem, f"write {term.text}.0" if whole else f"a value of {wanted}"
        elif term.text not in values:
            problem = f"{literal_text(term)} is not among the values of {name}: it {consequence}"
            yield place, problem, nearest(term.text, values) or f"one of {', '.join(sorted(values))}"


def _builtin_problems(atom: Atom, name: str, *, is_head: bool) -> Iterator[Problem]:
    counts = BUILTINS.get(atom.predicate)
    if counts is None:
        known = sorted(map(local_name, BUILTINS))
        suggestion = nearest(name, known) or f"known: {', '.join(known)}"
        yield atom.place(), f"there is no builtin {name} in Pellet", suggestion
        return
    if is_head:
        yield atom.place(), f"builtin {name} occurs in the head", "Pellet takes builtins in bodies only"
    least, most = counts
    if not least <= len(atom.arguments) <= most:
        wanted = str(least) if least == most else f"{least} or more" if most == 99 else f"{least} to {most}"
        has_comma = [isinstance(term, Lit) and term.datatype == XSD + "integer" for term in atom.arguments[-2:]]
        remedy = "write decimals with a point" if has_comma == [True, True] else None
        yield atom.place(), f"{name} takes {wanted} arguments, not {len(atom.arguments)}", remedy
    for number, term in enumerate(atom.arguments):
        if isinstance(term, Named):
            yield atom.place(number), f"{name}: {local_name(term.iri)} is an individual where a value is needed", None


def _uses(atoms: Iterable[Atom]) -> Iterator[tuple[Atom, int, str]]:
    """(atom, number of the argument, name) of each variable."""
    for atom in atoms:
        for number, term in enumerate(atom.arguments):
            if isinstance(term, Variable):
                yield atom, number, term.name


def _variable_problems(rule: Rule) -> Iterator[Problem]:
    """Find unbound variables, and variables that stand for both an individual and a value."""
    individuals: dict[str, Place] = {}
    values: dict[str, Place] = {}
    for atom, number, name in _uses(rule.atoms):
        (values if atom.takes_value(number) else individuals).setdefault(name, atom.place(number) or Place(0, 0))
    for name in sorted(individuals.keys() & values.keys()):
        yield max(individuals[name], values[name]), f"?{name} stands for an individual and for a value", None
    bound = {
        name for atom in rule.body if atom.kind in ("class", "object", "data", "same") for name in atom.variables()
    }
    builtins = [atom for atom in rule.body if atom.kind == "builtin" and atom.arguments]
    while more := _computed(builtins, bound) - bound:
        bound |= more
    known = bound | {name for atom in rule.atoms for name in atom.variables()}
    for atom, number, name in _uses(builtins):
        if name not in bound:
            reason = "" if number or atom.predicate in TESTERS else ", nor can be computed"
            problem = f"?{name} has no value in {local_name(atom.predicate)}: no other atom binds it{reason}"
            yield atom.place(number), problem, nearest(name, known - {name})
    for atom, number, name in _uses(rule.head):
        if name not in bound:
            problem = f"?{name} occurs in the head, but the body does not bind it"
            yield atom.place(number), problem, nearest(name, bound)


def _computed(builtins: Iterable[Atom], bound: set[str]) -> set[str]:
    """Variables that builtins compute: the first argument, once all others have values."""
    return {
        first.name
        for first, *others in (atom.arguments for atom in builtins if atom.computes)
        if isinstance(first, Variable) and all(not isinstance(term, Variable) or term.name in bound for term in others)
    }


def recursing_rules(rules: Iterable[Rule]) -> list[Rule]:
    """Find rules whose computed values feed back, through any rules, into their own computation."""
    enabled = [rule for rule in rules if rule.enabled]
    steps = {(atom.predicate, head.predicate) for rule in enabled for atom in rule.body for head in rule.head}
    return [
        rule
        for rule in enabled
        if not reached(_computed_properties(rule), steps).isdisjoint(atom.predicate for atom in rule.body)
    ]


def _computed_properties(rule: Rule) -> set[str]:
    """Properties of which a rule concludes a value that it computes."""
    bound = {name for atom in rule.body if atom.kind != "builtin" for name in atom.variables()}
    computed = {name for atom in rule.body if atom.kind == "builtin" for name in atom.variables()} - bound
    return {atom.predicate for atom in rule.head if atom.kind == "data" and computed.intersection(atom.variables())}
