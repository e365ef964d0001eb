"""Say in one line why a rule does not fire in a state.

What makes a rule useless in every state comes first: it is switched off, or is dropped by Pellet. Else the answer is
the first atom that fails, for the binding that comes nearest, with the value found and the value needed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Final, NamedTuple

from suave_des.errors import InputError, did_you_mean, shown
from suave_des.kb.matching import (
    FACT_KINDS,
    Binding,
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
from suave_des.kb.tracing import Tracer
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet import TimeLimit
from suave_des.knowledge.rdf import (
    C_STATUS,
    HAS_QA_VALUE,
    HAS_VALUE,
    IS_QA_TYPE,
    NUMERIC,
    O_STATUS,
    TOMASYS,
    Lit,
    Triple,
    fact_of,
    local_name,
    value_of,
)
from suave_des.knowledge.rules import COMPARISONS, Atom, Rule, Variable, write_atom, write_term
from suave_des.knowledge.rules.files import fatal_problems
from suave_des.knowledge.state import ContradictionError, KnowledgeState

_WORDS: Final = {
    "<": "less than",
    "<=": "at most",
    ">": "greater than",
    ">=": "at least",
    "=": "equal to",
    "!=": "different from",
}
#: What a state asserts, and how to give it.
_GIVEN_BY_STATES: Final[Mapping[str, str]] = {
    TOMASYS + "FunctionGrounding": "ground a function: --at FUNCTION=DESIGN",
    TOMASYS + "typeFD": "ground a function: --at FUNCTION=DESIGN",
    TOMASYS + "solvesO": "ground a function: --at FUNCTION=DESIGN",
    C_STATUS: "report a component: --at COMPONENT=FALSE",
    HAS_QA_VALUE: "measure what the grounded design expects: --at ATTRIBUTE=NUMBER",
    TOMASYS + "Objective": "ask for a function: --at FUNCTION",
}
#: All that states assert.
_IN_STATES: Final = frozenset(
    {*_GIVEN_BY_STATES, HAS_VALUE, IS_QA_TYPE, O_STATUS}
    | {TOMASYS + name for name in ("QAvalue", "typeF", "o_always_improve")}
)


class WhyNot(NamedTuple):
    """Why a rule does not fire, or that it does.

    Attributes:
        rule: its name.
        answer: in one line, without the name.
        fires: whether its whole body holds.
        failing: number of the atoms that do not hold there; 0 where the answer is not about atoms.
    """

    rule: str
    answer: str
    fires: bool = False
    failing: int = 0

    def __str__(self) -> str:
        """As `kb why-not` prints it."""
        return f"{self.rule}: {self.answer}"


@dataclass(frozen=True)
class RuleQuestions:
    """Answers for the rules of one knowledge base.

    Attributes:
        base: ontologies and rules.

    Example:
        >>> questions = RuleQuestions(knowledge.base)
        >>> print(questions.why_not("compError", knowledge.state()))
        compError: c_status(?c, "FALSE") does not hold: nothing has a c_status; ...
    """

    base: Ontology
    _facts: dict[KnowledgeState, Facts | str] = field(default_factory=dict, repr=False)

    def why_not(self, name: str, state: KnowledgeState) -> WhyNot:
        """Say why a rule does not fire in a state.

        Raises:
            InputError: there is no rule of that name.
        """
        answers = [self.of(rule, state) for rule in self.base.rules if rule.name == name]
        if not answers:
            known = sorted({rule.name for rule in self.base.rules})
            raise InputError(f"there is no rule {shown(name)}", remedy=did_you_mean(name, known))
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
        if not failing:
            bindings = with_bindings(shown_bindings(binding, self.base.names))
            said = ", ".join(self._concluded(atom, binding) for atom in rule.head)
            return WhyNot(rule.name, f"it fires{bindings}, and concludes {said}", fires=True)
        # What no state can bring comes first.
        first = rule.body[min(failing, key=lambda number: (not self._is_fixed(rule.body[number]), number))]
        reason = describe_failure(self._usable, first, binding, facts)
        others = len(failing) - 1
        more = f" ({others} more {'atom fails' if others == 1 else 'atoms fail'})" if others else ""
        chain = self._concluder(rule, first, binding, facts)
        answer = f"{write_atom(first)} does not hold: {reason}{more}{chain}"
        return WhyNot(rule.name, answer, failing=len(failing))

    def missing(self, triple: Triple, state: KnowledgeState) -> list[WhyNot]:
        """Say why no rule concludes a fact, of each that could; those that lack least first."""
        starts = (
            (rule, next((start for head in rule.head if (start := matched(head, triple, {})) is not None), None))
            for rule in self.base.content.enabled_rules
        )
        found = [self.of(rule, state, start) for rule, start in starts if start is not None]
        return sorted((each for each in found if not each.fires), key=lambda each: (each.failing, each.rule))

    def _is_fixed(self, atom: Atom) -> bool:
        """Whether what an atom asks for is neither in states nor concluded by a rule."""
        content = self._usable.content
        concluded = content.concluded
        of_states = {triple[1] for own in self._usable.model.own.values() for triple in own}
        return atom.kind in FACT_KINDS and atom.predicate not in _IN_STATES | concluded | of_states

    @cached_property
    def _usable(self) -> Ontology:
        """The knowledge base without the rules that Pellet would drop."""
        known = self.base.vocabulary
        return self.base.with_rules(
            each for each in self.base.rules if not (each.enabled and fatal_problems(each, known))
        )

    def _known(self, state: KnowledgeState) -> Facts | str:
        """All that follows in a state, or what contradicts what in it."""
        if state not in self._facts:
            try:
                tracer = Tracer(self._usable, state)
                self._facts[state] = Facts(tracer.known)
            except ContradictionError as error:
                self._facts[state] = error.problem.removeprefix("contradiction: ")
        return self._facts[state]

    def _concluded(self, atom: Atom, binding: Binding) -> str:
        fact = stated(atom, binding)
        return write_atom(atom) if fact is None else str(fact_of(fact, self.base.names))

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


def describe_failure(base: Ontology, atom: Atom, binding: Binding, facts: Facts) -> str:
    """Describe why an atom does not hold.

    Args:
        atom: of the body of a rule.
        binding: what variables stand for.
        facts: all that follows.
    """
    if atom.kind == "class":
        return _class(base, atom, binding)
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
        return f"{f'{who} has no' if who else 'nothing has a'} {name}{_help(atom)}"
    if wanted is not None:
        of = f" of {who}" if who else ""
        why = _unequal(values, wanted)
        return f"found {name} {_list(base, values)}{of}, needed {_show(base, wanted)}{why}"
    if who:
        return f"{who} has {name} {_list(base, values)}, but not as the other atoms need it"
    return f"no {name} connects what the other atoms need"


def _class(base: Ontology, atom: Atom, binding: Binding) -> str:
    name, subject = local_name(atom.predicate), bound(atom.arguments[0], binding)
    if isinstance(subject, str):
        return f"{base.names.short(subject)} is not known to be a {name}{_help(atom)}"
    return f"there is no {name}{_help(atom)}"


def _unequal(values: list[str | Lit], wanted: str | Lit) -> str:
    """Why values that look alike are not equal."""
    for value in values:
        if isinstance(value, Lit) and isinstance(wanted, Lit):
            if value.datatype != wanted.datatype:
                kinds = f"{local_name(value.datatype)} and {local_name(wanted.datatype)}"
                return f"; {kinds} never match, even where they look alike: write {write_term(value)}"
            if value.text.strip().lower() == wanted.text.strip().lower():
                return "; they differ in case or spaces"
    return ""


def _help(atom: Atom) -> str:
    """How to give in a state what is missing."""
    given = _GIVEN_BY_STATES.get(atom.predicate)
    return f"; {given}" if given else ""


def _show(base: Ontology, value: str | Lit | None) -> str:
    if value is None:
        return "nothing"
    if isinstance(value, Lit):
        is_plain_number = value.datatype in NUMERIC and str(value_of(value, base.names)) == value.text
        return value.text if is_plain_number else write_term(value)
    return base.names.short(value)


def _list(base: Ontology, values: list[str | Lit], most: int = 3) -> str:
    texts = sorted({_show(base, value) for value in values})
    return ", ".join(texts[:most]) + (f" and {len(texts) - most} more" if len(texts) > most else "")
