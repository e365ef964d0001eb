"""Say in one line why a rule does not fire in a state.

What makes a rule useless in every state comes first: it is switched off, cannot be read, or is dropped by Pellet. Else
the answer is the first atom that fails, for the binding that comes nearest, with the value found and the value needed.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

from suave_des.errors import InputError, did_you_mean, shown
from suave_des.knowledge.checks.model import no_estimate, unmeasured_rules
from suave_des.knowledge.content import with_rules
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet.limit import TimeLimit
from suave_des.knowledge.rdf import HAS_QA_VALUE, Lit, Triple, fact_of, facts_of, value_of
from suave_des.knowledge.rules.checks import fatal_problems
from suave_des.knowledge.rules.files import RulesFile
from suave_des.knowledge.rules.syntax import Atom, Rule, RuleError
from suave_des.knowledge.rules.writer import write_atom
from suave_des.knowledge.state import ContradictionError, Fact, KnowledgeState, Value, value_text
from suave_des.scenario.loader import LoadedScenario
from suave_des.scenario_knowledge import open_base
from suave_des.workbench.prover import Prover, Situation
from suave_des.workbench.reasons.atom_failure import describe_failure
from suave_des.workbench.reasons.matching import (
    FACT_KINDS,
    Binding,
    Facts,
    NearestFinder,
    bound,
    shown_bindings,
    stated,
    unified,
)
from suave_des.workbench.reasons.tracing import Tracer


@dataclass(frozen=True)
class UnusableRule:
    """A rule of a text file that no knowledge base can be loaded with.

    Attributes:
        reason: what is wrong with it, where, and what would be right.
    """

    name: str
    reason: str

    @classmethod
    def of(cls, name: str, error: RuleError) -> UnusableRule:
        """Write an error as a reason."""
        problem = error.problem.removeprefix(f"rule {name}: ")
        where = f" ({error.place})" if error.place else ""
        return cls(name, f"{problem}{where}" + (f"; {error.remedy}" if error.remedy else ""))


def open_without_unusable(loaded: LoadedScenario) -> tuple[Ontology, list[UnusableRule]]:
    """Open the knowledge base of a scenario with those of its rules as text that can be used, and list the others.

    Raises:
        InputError: something else cannot be read, or the text of a rule cannot be parsed.
    """
    scenario = loaded.scenario
    knowledge = scenario.knowledge.model_copy(update={"disabled_rules": []})
    base = open_base(replace(loaded, scenario=scenario.model_copy(update={"knowledge": knowledge}), rules=()))
    usable: list[Rule] = []
    unusable: list[UnusableRule] = []
    for path in loaded.rules:
        for name, rule in RulesFile.read(path).checked(base.vocabulary):
            if isinstance(rule, Rule):
                usable.append(rule)
            else:
                unusable.append(UnusableRule.of(name, rule))
    broken = {each.name for each in unusable}
    disabled = [name for name in scenario.knowledge.disabled_rules if name not in broken]
    return replace(base, content=with_rules(base.content, [usable], disabled)), unusable


@dataclass(frozen=True)
class WhyNot:
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
    bindings: tuple[tuple[str, Value], ...] = ()
    failing: int = 0

    def __str__(self) -> str:
        """As `kb why-not` prints it."""
        return f"{self.rule}: {self.answer}"


@dataclass(frozen=True)
class RuleQuestions:
    """Answers for the rules of one knowledge base.

    Attributes:
        base: ontologies and rules.
        unusable: rules of text files that the knowledge base could not be loaded with.

    Example:
        >>> questions = RuleQuestions(knowledge.base)
        >>> print(questions.why_not("compError", knowledge.state()))
        compError: c_status(?c, "FALSE") does not hold: nothing has a c_status; ...
    """

    base: Ontology
    unusable: tuple[UnusableRule, ...] = ()
    _facts: dict[KnowledgeState, Facts | str] = field(default_factory=dict, repr=False)

    def why_not(self, name: str, state: KnowledgeState) -> WhyNot:
        """Say why a rule does not fire in a state.

        Raises:
            InputError: there is no rule of that name.
        """
        for each in self.unusable:
            if each.name == name:
                return WhyNot(name, f"never fires: {each.reason}")
        rules = [rule for rule in self.base.rules if rule.name == name]
        if not rules:
            known = sorted({*(rule.name for rule in self.base.rules), *(each.name for each in self.unusable)})
            raise InputError(f"there is no rule {shown(name)}", remedy=did_you_mean(name, known))
        answers = [self.of(rule, state) for rule in rules]
        return next((each for each in answers if each.fires), answers[0])

    def of(self, rule: Rule, state: KnowledgeState, start: Binding | None = None) -> WhyNot:
        """Say why a rule, which may have the name of another one, does not fire in a state.

        Args:
            start: what variables must stand for.
        """
        if not rule.enabled:
            return WhyNot(
                rule.name, f"never fires: it is disabled (kb enable-rule {rule.name}, or remove --disable-rule)"
            )
        problem = next(iter(fatal_problems(rule, self.base.vocabulary)), None)
        if problem is not None:
            remedy = f"; {problem.remedy}" if problem.remedy else ""
            return WhyNot(rule.name, f"never fires: {problem.message}{remedy}")
        facts = self._known(state)
        if isinstance(facts, str):
            return WhyNot(rule.name, f"nothing follows, as the state contradicts itself: {facts}")
        match = NearestFinder(rule, facts, start or {}).find()
        identities = [number for number, atom in enumerate(rule.body) if atom.kind in ("same", "different")]
        if not match.failing and identities and not self._fires_in_pellet(rule, state):
            match = replace(match, failing=(identities[0],))
        bindings = shown_bindings(match.binding, self.base.names)
        if not match.failing:
            return WhyNot(rule.name, self._fires(rule, match.binding, facts), True, bindings=bindings)
        first = rule.body[match.failing[0]]
        if first.predicate == HAS_QA_VALUE and id(rule) in self._unmeasured:
            reason = "; ".join(no_estimate(self._unmeasured[id(rule)]))
        else:
            reason = describe_failure(self._usable, first, match.binding, facts)
        others = len(match.failing) - 1
        more = f" ({others} more {'atom fails' if others == 1 else 'atoms fail'})" if others else ""
        chain = self._concluder(rule, first, match.binding, facts)
        text = write_atom(first)
        return WhyNot(
            rule.name, f"{text} does not hold: {reason}{more}{chain}", False, text, bindings, len(match.failing)
        )

    def _fires_in_pellet(self, rule: Rule, state: KnowledgeState) -> bool:
        """Whether a rule fires: what is the same and what is different, Pellet alone knows."""
        return bool(Prover.load(self._usable, TimeLimit(), [rule.body]).holding(Situation(state)))

    @cached_property
    def _usable(self) -> Ontology:
        """The knowledge base without the rules that Pellet would drop."""
        known = self.base.vocabulary
        return self.base.with_rules(
            each for each in self.base.rules if not (each.enabled and fatal_problems(each, known))
        )

    @cached_property
    def _unmeasured(self) -> dict[int, str]:
        """Attributes of which no grounding can have a value, by the identities of the rules that need one."""
        return {id(rule): attribute for rule, _, attribute in unmeasured_rules(self.base.content, self.base.model)}

    def _known(self, state: KnowledgeState) -> Facts | str:
        """All that follows in a state, or what contradicts what in it."""
        if state not in self._facts:
            try:
                tracer = Tracer(self._usable, state)
                self._facts[state] = Facts(_with_languages(tracer.known, tracer.asserted))
            except ContradictionError as error:
                self._facts[state] = error.problem.removeprefix("contradiction: ")
        return self._facts[state]

    def missing(self, fact: Fact, subject: str, state: KnowledgeState) -> list[WhyNot]:
        """Say of each rule that could conclude a fact why it does not, those that lack least first.

        Args:
            fact: which does not follow.
            subject: IRI of its subject.
        """
        found = []
        for rule in self.base.content.enabled_rules:
            starts = (self._says(head, fact, subject) for head in rule.head)
            start = next((each for each in starts if each is not None), None)
            if start is not None:
                found.append(self.of(rule, state, start))
        return sorted((each for each in found if not each.fires), key=lambda each: (each.failing, each.rule))

    def _says(self, head: Atom, fact: Fact, subject: str) -> Binding | None:
        """The binding with which an atom of a head says a fact, its value left free; None if it cannot."""
        names, last = self.base.names, head.arguments[-1]
        if fact.property != ("type" if head.kind == "class" else names.short(head.predicate)):
            return None
        value = head.predicate if head.kind == "class" else bound(last, {})
        if value is not None and value_text(value_of(value, names)) != value_text(fact.value):
            return None
        return unified(head.arguments[:1], (subject,), {})

    def _fires(self, rule: Rule, binding: Binding, facts: Facts) -> str:
        concluded = []
        stays = ""
        for atom in rule.head:
            fact = stated(atom, binding)
            concluded.append(write_atom(atom) if fact is None else str(fact_of(fact, self.base.names)))
            others = self._other_values(atom, binding, facts)
            if others:
                stays = f"; {others[0]} remains as well, because rules only add values"
        bound = ", ".join(f"?{name} = {value}" for name, value in shown_bindings(binding, self.base.names))
        return f"it fires{f' with {bound}' if bound else ''}, and concludes {', '.join(concluded)}{stays}"

    def _other_values(self, atom: Atom, binding: Binding, facts: Facts) -> list[str]:
        """Facts that give the subject of a head's atom another value of the same data property."""
        subject, last = bound(atom.arguments[0], binding), atom.arguments[-1]
        if atom.kind != "data" or not isinstance(last, Lit) or not isinstance(subject, str):
            return []
        values = [value for value in facts.values(subject, atom.predicate) if value != last]
        triples = [(subject, atom.predicate, value) for value in values]
        return sorted(str(fact) for fact in facts_of(triples, self.base.names))

    def _concluder(self, rule: Rule, atom: Atom, binding: Binding, facts: Facts) -> str:
        """The rule that comes nearest to concluding what is missing, and why it does not."""
        best: tuple[int, str, str] | None = None
        for other, start in self._could_conclude(rule, atom, binding):
            match = NearestFinder(other, facts, start).find()
            if match.failing:
                first = other.body[match.failing[0]]
                reason = describe_failure(self._usable, first, match.binding, facts)
                found = (len(match.failing), other.name, f"{write_atom(first)} fails: {reason}")
                best = found if best is None or found < best else best
        return "" if best is None else f"; {best[1]} would conclude it, but its {best[2]}"

    def _could_conclude(self, rule: Rule, atom: Atom, binding: Binding) -> Iterator[tuple[Rule, Binding]]:
        """Other rules with a head that says what an atom asks for, with the binding with which it does."""
        if atom.kind not in FACT_KINDS:
            return
        wanted = [bound(term, binding) for term in atom.arguments]
        for other in self._usable.content.enabled_rules:
            for head in other.head:
                if other is rule or (head.kind, head.predicate) != (atom.kind, atom.predicate):
                    continue
                start = unified(head.arguments, wanted, {})
                if start is not None:
                    yield other, start


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
