"""Say in one line why a rule does not fire in a state.

What makes a rule useless in every state comes first: it is switched off, cannot be read, or is dropped by Pellet. Else
the answer is the first atom that fails, for the binding that comes nearest, with the value found and the value needed.
Of several atoms that fail, one comes first that no state can make hold.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import Final, NamedTuple

from suave_des.errors import InputError, did_you_mean, nearest, shown
from suave_des.kb.matching import (
    FACT_KINDS,
    Binding,
    Bound,
    Facts,
    Probes,
    bound,
    matched,
    nearest_match,
    shown_bindings,
    stated,
    unified,
    with_bindings,
)
from suave_des.kb.space import Situation
from suave_des.kb.states import FactReader
from suave_des.kb.tracing import Tracer
from suave_des.knowledge.checks import unmeasured_rules
from suave_des.knowledge.content import with_rules
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet import TimeLimit
from suave_des.knowledge.rdf import (
    C_STATUS,
    HAS_QA_VALUE,
    HAS_VALUE,
    IS_QA_TYPE,
    NUMERIC,
    OWL,
    TOMASYS,
    Lit,
    Triple,
    fact_of,
    facts_of,
    local_name,
    reached,
    value_of,
)
from suave_des.knowledge.rules import COMPARISONS, Atom, Rule, Variable, literal_text, texts_of, write_atom
from suave_des.knowledge.rules.checks import fatal_problems
from suave_des.knowledge.rules.files import RulesFile
from suave_des.knowledge.state import ContradictionError, KnowledgeState
from suave_des.scenario.loader import LoadedScenario
from suave_des.scenario_knowledge import open_base

_WORDS: Final = {
    "<": "less than",
    "<=": "at most",
    ">": "greater than",
    ">=": "at least",
    "=": "equal to",
    "!=": "different from",
}
#: Properties and classes of which states assert something.
_SAID_BY_STATES: Final = frozenset(
    {
        *(TOMASYS + name for name in ("Objective", "FunctionGrounding", "QAvalue")),
        *(TOMASYS + name for name in ("typeF", "typeFD", "solvesO", "o_status", "o_always_improve")),
        *(C_STATUS, HAS_QA_VALUE, HAS_VALUE, IS_QA_TYPE),
    }
)
#: What a state asserts, and how to give it.
_GIVEN_BY_STATES: Final[Mapping[str, str]] = {
    TOMASYS + "FunctionGrounding": "ground a function: --at FUNCTION=DESIGN",
    TOMASYS + "typeFD": "ground a function: --at FUNCTION=DESIGN",
    TOMASYS + "solvesO": "ground a function: --at FUNCTION=DESIGN",
    C_STATUS: "report a component: --at COMPONENT=FALSE",
    HAS_QA_VALUE: "measure what the grounded design expects: --at ATTRIBUTE=NUMBER",
    TOMASYS + "Objective": "ask for a function: --at FUNCTION",
}
#: How OWL says what is not, or what all values are: neither follows from facts that are missing.
_CLOSED_WORLD: Final = ("complementOf", "allValuesFrom", "maxCardinality", "maxQualifiedCardinality")


def open_without_unusable(loaded: LoadedScenario) -> tuple[Ontology, dict[str, str]]:
    """Open the knowledge base of a scenario with those of its rules as text that can be used.

    Returns:
        the knowledge base, and by name what is wrong with each other rule, where, and what would be right.

    Raises:
        InputError: something else cannot be read, or the text of a rule cannot be parsed.
    """
    scenario = loaded.scenario
    knowledge = scenario.knowledge.model_copy(update={"disabled_rules": []})
    base = open_base(replace(loaded, scenario=scenario.model_copy(update={"knowledge": knowledge}), rules=()))
    usable: list[Rule] = []
    unusable: dict[str, str] = {}
    for path in loaded.rules:
        for name, rule in RulesFile.read(path).checked(base.vocabulary):
            if isinstance(rule, Rule):
                usable.append(rule)
            else:
                problem, where = rule.problem.removeprefix(f"rule {name}: "), f" ({rule.place})" if rule.place else ""
                unusable[name] = f"{problem}{where}" + (f"; {rule.remedy}" if rule.remedy else "")
    disabled = [name for name in scenario.knowledge.disabled_rules if name not in unusable]
    return replace(base, content=with_rules(base.content, [usable], disabled)), unusable


class WhyNot(NamedTuple):
    """Why a rule does not fire, or that it does.

    Attributes:
        rule: its name.
        answer: in one line, without the name.
        fires: whether its whole body holds.
        atom: the first atom that fails, as the rule writes it; empty where no single atom is the reason.
        bindings: what the variables stand for in the nearest match.
        failing: number of the atoms that do not hold there; 0 where the answer is not about atoms.
    """

    rule: str
    answer: str
    fires: bool = False
    atom: str = ""
    bindings: Bound = ()
    failing: int = 0

    def __str__(self) -> str:
        """As `kb why-not` prints it."""
        return f"{self.rule}: {self.answer}"


@dataclass(frozen=True)
class RuleQuestions:
    """Answers for the rules of one knowledge base.

    Attributes:
        base: ontologies and rules.
        unusable: by name, why the knowledge base could not be loaded with a rule of a text file.

    Example:
        >>> questions = RuleQuestions(knowledge.base)
        >>> print(questions.why_not("compError", knowledge.state()))
        compError: c_status(?c, "FALSE") does not hold: nothing has a c_status; ...
    """

    base: Ontology
    unusable: Mapping[str, str] = field(default_factory=dict)
    _facts: dict[KnowledgeState, Facts | str] = field(default_factory=dict, repr=False)

    @classmethod
    def open(cls, loaded: LoadedScenario, facts: Sequence[str] = ()) -> RuleQuestions:
        """Open the knowledge base of a scenario, even if some of its rules as text cannot be used.

        Args:
            loaded: the scenario.
            facts: additional assertions, as atoms.

        Raises:
            InputError: something cannot be read.
        """
        base, unusable = open_without_unusable(loaded)
        reader = FactReader(base)
        reader.declare(facts)
        return cls(base.with_facts(map(reader.triple, facts)), unusable)

    @property
    def names(self) -> list[str]:
        """Names of all rules."""
        return sorted({*(rule.name for rule in self.base.rules), *self.unusable})

    def why_not(self, name: str, state: KnowledgeState) -> WhyNot:
        """Say why a rule does not fire in a state.

        Raises:
            InputError: there is no rule of that name.
        """
        if name in self.unusable:
            return WhyNot(name, f"never fires: {self.unusable[name]}")
        answers = [self.of(rule, state) for rule in self.base.rules if rule.name == name]
        if not answers:
            raise InputError(f"there is no rule {shown(name)}", remedy=did_you_mean(name, self.names))
        return next((each for each in answers if each.fires), answers[0])

    def of(self, rule: Rule, state: KnowledgeState, start: Binding = MappingProxyType({})) -> WhyNot:
        """Say why a rule, which may have the name of another one, does not fire in a state.

        Args:
            start: what variables must stand for.
        """
        if not rule.enabled:
            return WhyNot(
                rule.name, f"never fires: it is disabled (kb enable-rule {rule.name}, or remove --disable-rule)"
            )
        for problem in fatal_problems(rule, self.base.vocabulary):
            remedy = f"; {problem.remedy}" if problem.remedy else ""
            return WhyNot(rule.name, f"never fires: {problem.message}{remedy}")
        facts = self._known(state)
        if isinstance(facts, str):
            return WhyNot(rule.name, f"nothing follows, as the state contradicts itself: {facts}")
        binding, failing = nearest_match(rule, facts, start)
        identities = [number for number, atom in enumerate(rule.body) if atom.kind in ("same", "different")]
        # What is the same and what is different, Pellet alone knows.
        if not failing and identities and not Probes(self._usable, TimeLimit(), [rule.body]).holding(Situation(state)):
            failing = (identities[0],)
        bindings = shown_bindings(binding, self.base.names)
        if not failing:
            said = ", ".join(self._concluded(atom, binding) for atom in rule.head)
            stays = next((text for atom in rule.head for text in self._remaining(atom, binding, facts)), "")
            return WhyNot(
                rule.name, f"it fires{with_bindings(bindings)}, and concludes {said}{stays}", True, "", bindings
            )
        first = rule.body[min(failing, key=lambda number: (not self._is_fixed(rule.body[number]), number))]
        if first.predicate == HAS_QA_VALUE and id(rule) in self._unmeasured:
            reason = self._unmeasured[id(rule)]
        else:
            reason = describe_failure(self._usable, first, binding, facts)
        others = len(failing) - 1
        more = f" ({others} more {'atom fails' if others == 1 else 'atoms fail'})" if others else ""
        chain = self._concluder(rule, first, binding, facts)
        text = write_atom(first)
        return WhyNot(rule.name, f"{text} does not hold: {reason}{more}{chain}", False, text, bindings, len(failing))

    def missing(self, triple: Triple, state: KnowledgeState) -> list[WhyNot]:
        """Say why no rule concludes a fact, of each that could; those that lack least first."""
        starts = (
            (rule, next((start for head in rule.head if (start := matched(head, triple, {})) is not None), None))
            for rule in self.base.content.enabled_rules
        )
        found = [self.of(rule, state, start) for rule, start in starts if start is not None]
        return sorted((each for each in found if not each.fires), key=lambda each: (each.failing, each.rule))

    def _is_fixed(self, atom: Atom) -> bool:
        """Whether what an atom asks for is neither said by states nor concluded by a rule."""
        content = self._usable.content
        concluded = content.head_properties() | content.head_classes()
        of_states = {triple[1] for individual in self._usable.model.individuals() for triple in individual.own}
        return atom.kind in FACT_KINDS and atom.predicate not in _SAID_BY_STATES | concluded | of_states

    @cached_property
    def _usable(self) -> Ontology:
        """The knowledge base without the rules that Pellet would drop."""
        known = self.base.vocabulary
        return self.base.with_rules(
            each for each in self.base.rules if not (each.enabled and fatal_problems(each, known))
        )

    @cached_property
    def _unmeasured(self) -> dict[int, str]:
        """Why no grounding can have a value of an attribute, by the identities of the rules that need one."""
        found = unmeasured_rules(self.base.content, self.base.model)
        return {id(rule): "; ".join(filter(None, reasons)) for rule, _, *reasons in found}

    def _known(self, state: KnowledgeState) -> Facts | str:
        """All that follows in a state, or what contradicts what in it."""
        if state not in self._facts:
            try:
                tracer = Tracer(self._usable, state)
                self._facts[state] = Facts(_with_languages(tracer.known, tracer.asserted))
            except ContradictionError as error:
                self._facts[state] = error.problem.removeprefix("contradiction: ")
        return self._facts[state]

    def _concluded(self, atom: Atom, binding: Binding) -> str:
        fact = stated(atom, binding)
        return write_atom(atom) if fact is None else str(fact_of(fact, self.base.names))

    def _remaining(self, atom: Atom, binding: Binding, facts: Facts) -> Iterator[str]:
        """Another value that the subject of a head's atom has of the same data property."""
        fact = stated(atom, binding)
        if fact is not None and isinstance(fact[2], Lit) and isinstance(atom.arguments[-1], Lit):
            others = [(*fact[:2], value) for value in facts.values(*fact[:2]) if value != fact[2]]
            for text in sorted(str(each) for each in facts_of(others, self.base.names)):
                yield f"; {text} remains as well, because rules only add values"

    def _concluder(self, rule: Rule, atom: Atom, binding: Binding, facts: Facts) -> str:
        """The rule that comes nearest to concluding what is missing, and why it does not."""
        if atom.kind not in FACT_KINDS:
            return ""
        wanted = [bound(term, binding) for term in atom.arguments]
        found = []
        for other in self._usable.content.enabled_rules:
            for head in other.head if other is not rule else ():
                start = unified(head.arguments, wanted, {})
                if (head.kind, head.predicate) != (atom.kind, atom.predicate) or start is None:
                    continue
                nearest_one, failing = nearest_match(other, facts, start)
                if failing:
                    first = other.body[failing[0]]
                    reason = describe_failure(self._usable, first, nearest_one, facts)
                    found.append((len(failing), other.name, f"its {write_atom(first)} fails: {reason}"))
        return "".join(f"; {name} would conclude it, but {why}" for _, name, why in sorted(found)[:1])


def _with_languages(known: Iterable[Triple], asserted: Iterable[Triple]) -> list[Triple]:
    """Facts with the languages of texts, which Pellet's answers leave out."""
    languages: dict[tuple[str, str, str], list[Triple]] = {}
    for triple in asserted:
        if isinstance(triple[2], Lit) and triple[2].datatype.startswith("@"):
            languages.setdefault((triple[0], triple[1], triple[2].text), []).append(triple)
    found: list[Triple] = []
    for triple in known:
        subject, predicate, value = triple
        found += languages.get((subject, predicate, value.text), [triple]) if isinstance(value, Lit) else [triple]
    return found


def describe_failure(base: Ontology, atom: Atom, binding: Binding, facts: Facts) -> str:
    """Describe why an atom does not hold.

    Args:
        atom: of the body of a rule.
        binding: what variables stand for.
        facts: all that follows.
    """
    if atom.kind == "class":
        return _class(base, atom, binding, facts)
    if atom.kind in FACT_KINDS:
        return _property(base, atom, binding, facts)
    if atom.predicate in COMPARISONS and len(atom.arguments) == 2:
        return _comparison(base, atom, binding)
    if atom.kind == "different":
        return "OWL does not assume that different names mean different individuals: assert it"
    if atom.kind == "same":
        return "these individuals are not known to be the same"
    values = [f"?{name} = {_show(base, binding[name])}" for name in atom.variables() if name in binding]
    return f"it is false for {', '.join(values)}" if values else "it is false for these values"


def _comparison(base: Ontology, atom: Atom, binding: Binding) -> str:
    sides = [bound(term, binding) for term in atom.arguments]
    texts = [
        _show(base, value) + (f" (?{term.name})" if isinstance(term, Variable) else "")
        for term, value in zip(atom.arguments, sides, strict=True)
    ]
    words = _WORDS[COMPARISONS[atom.predicate]]
    kinds = [value.datatype for value in sides if isinstance(value, Lit)]
    numbers = [kind in NUMERIC for kind in kinds]
    if len(kinds) == 2 and numbers[0] != numbers[1]:
        text = texts[numbers.index(False)]
        return (
            f"{text} is text, and never compares with the number {texts[numbers.index(True)]}; write it without quotes"
        )
    return f"found {texts[0]}, needed {words} {texts[1]}"


def _property(base: Ontology, atom: Atom, binding: Binding, facts: Facts) -> str:
    name = local_name(atom.predicate)
    subject, wanted = (bound(term, binding) for term in (atom.arguments[0], atom.arguments[-1]))
    who = base.names.short(subject) if isinstance(subject, str) else None
    values = facts.values(subject if isinstance(subject, str) else None, atom.predicate)
    if not values:
        return f"{f'{who} has no' if who else 'nothing has a'} {name}{_help(base, atom)}"
    if wanted is not None:
        of = f" of {who}" if who else ""
        why = _unequal(base, atom.predicate, values, wanted)
        return f"found {name} {_list(base, values)}{of}, needed {_show(base, wanted)}{why}"
    if who:
        return f"{who} has {name} {_list(base, values)}, but not as the other atoms need it"
    return f"no {name} connects what the other atoms need"


def _class(base: Ontology, atom: Atom, binding: Binding, facts: Facts) -> str:
    name = local_name(atom.predicate)
    closed = next(_closed_world(base, atom.predicate), None)
    if closed is not None:
        why = f"; {name} is defined by {closed}, which never follows from missing facts (open world)"
    else:
        why = _help(base, atom)
    subject = bound(atom.arguments[0], binding)
    if isinstance(subject, str):
        return f"{base.names.short(subject)} is not known to be a {name}{why}"
    return f"there is no {name}{why}"


def _unequal(base: Ontology, predicate: str, values: list[str | Lit], wanted: str | Lit) -> str:
    """Why values that look alike are not equal."""
    if not isinstance(wanted, Lit):
        return ""
    for value in values:
        if not isinstance(value, Lit):
            continue
        if value.datatype != wanted.datatype:
            kinds = f"{local_name(value.datatype)} and {local_name(wanted.datatype)}"
            return f"; {kinds} never match, even where they look alike: write {literal_text(value)}"
        if value.text.strip().lower() == wanted.text.strip().lower():
            return "; they differ in case or spaces"
    heads = (atom for rule in base.content.enabled_rules for atom in rule.head)
    if wanted.text in base.vocabulary.enumerations.get(predicate, texts_of(heads, predicate)):
        return ""  # a right value, however much it resembles the one that was found
    near = nearest(wanted.text, [value.text for value in values if isinstance(value, Lit)])
    return f"; {near}" if near else ""


def _help(base: Ontology, atom: Atom) -> str:
    """Return a remedy if nothing is known of a property or class."""
    given = _GIVEN_BY_STATES.get(atom.predicate)
    return f"; {given}" if given else ""


def _closed_world(base: Ontology, iri: str) -> Iterator[str]:
    """Constructors in the definition of a class that need a closed world."""
    lines = [line.rstrip(" .\n").split(" ", 2) for line in base.content.structure]
    inside = reached([f"<{iri}>"], [(subject, value) for subject, _, value in lines if value.startswith("_:")])
    for subject, predicate, _ in lines:
        if subject in inside and predicate.strip("<>").removeprefix(OWL) in _CLOSED_WORLD:
            yield local_name(predicate.strip("<>"))


def _show(base: Ontology, value: str | Lit | None) -> str:
    if value is None:
        return "nothing"
    if isinstance(value, Lit):
        is_plain_number = value.datatype in NUMERIC and str(value_of(value, base.names)) == value.text
        return value.text if is_plain_number else literal_text(value)
    return base.names.short(value)


def _list(base: Ontology, values: list[str | Lit], most: int = 3) -> str:
    texts = sorted({_show(base, value) for value in values})
    return ", ".join(texts[:most]) + (f" and {len(texts) - most} more" if len(texts) > most else "")
