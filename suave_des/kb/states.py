"""States, facts and rules as people write them: in YAML files, on the command line, or as a recorded mission's time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path
from typing import Any, Final

from pydantic import BaseModel, ConfigDict

from suave_des.domain import GENERATE_SEARCH_PATH, MAINTAIN_MOTION
from suave_des.errors import InputError, KeyPath, KnowledgeError, did_you_mean, nearest, shown
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.planning import triggers_adaptation
from suave_des.knowledge.rdf import RDF_TYPE, TOMASYS, XSD, Lit, Triple, fact_of, local_name
from suave_des.knowledge.rules import Atom, Named, Rule, RuleError, Term, Variable, texts_of
from suave_des.knowledge.rules.checks import Vocabulary
from suave_des.knowledge.rules.files import RulesFile, read_rule
from suave_des.knowledge.rules.parser import parse_rule
from suave_des.knowledge.state import UNGROUNDED, Fact, KnowledgeState, ObjectiveState
from suave_des.metrics.result import KnowledgeRecord
from suave_des.records.knowledge import CAMPAIGN_KNOWLEDGE_FILE, KNOWLEDGE_FILE, read_knowledge, read_missions
from suave_des.scenario.models import Scenario
from suave_des.scenario.schema import validated
from suave_des.scenario.yamlfile import read_yaml
from suave_des.scenario_knowledge import measured_attributes

#: Begins the IRIs of individuals that exist in a test or a question only.
NEW_INDIVIDUAL: Final = "urn:suave-des:test#"


@dataclass
class FactReader:
    """Reads facts that are written as atoms of rules, such as fg_status(fg_spiral_high, IN_ERROR_NFR).

    Text needs no quotes. A name that the ontologies do not have becomes a new individual where it first occurs as a
    member of a class: Binding(b1).

    Attributes:
        new: IRIs of the new individuals, by name.
    """

    base: Ontology
    new: dict[str, str] = field(default_factory=dict)

    def declare(self, texts: Iterable[str]) -> None:
        """Note the new individuals that facts introduce."""
        for text in texts:
            atom = _parsed(text)
            if len(atom.arguments) == 1 and isinstance(atom.arguments[0], Named):
                name = atom.arguments[0].iri
                if ":" not in name and not self._individuals(name):
                    self.new[name] = NEW_INDIVIDUAL + name

    def triple(self, text: str) -> Triple:
        """Read one fact.

        Raises:
            InputError: it is not a fact, or a name in it is unknown.
        """
        atom = _parsed(text)
        if not 1 <= len(atom.arguments) <= 2 or any(isinstance(term, Variable) for term in atom.arguments):
            remedy = "name the individuals, as in Component(c_thruster_1) or fg_status(fg_spiral_high, IN_ERROR_NFR)"
            what = "has a variable, and so is not" if "?" in text else "is not"
            raise InputError(f"{shown(text)} {what} a fact", remedy=remedy)
        subject = self._individual(atom.arguments[0])
        if len(atom.arguments) == 1:
            return subject, RDF_TYPE, self._predicate(atom.predicate, ("class",))[0]
        value = atom.arguments[1]
        predicate, kind = self._predicate(atom.predicate, ("object property", "data property"))
        return (
            subject,
            predicate,
            self._individual(value) if kind == "object property" else self._value(predicate, value),
        )

    def fact(self, text: str) -> Fact:
        """Read one fact, in the form in which inferences have it.

        Raises:
            InputError: it is not a fact, a name in it is unknown, or it can never follow, for its value.
        """
        triple = self.triple(text)
        _, predicate, value = triple
        values = self.base.vocabulary.enumerations.get(predicate)
        if values is not None and isinstance(value, Lit) and value.text not in values:
            remedy = nearest(value.text, values) or f"one of {', '.join(sorted(values))}"
            raise InputError(f"{shown(value.text)} is not among the values of {local_name(predicate)}", remedy=remedy)
        ranges = self.base.vocabulary.ranges.get(predicate)
        if ranges is not None and isinstance(value, Lit) and value.datatype not in ranges:
            wanted = " or ".join(sorted(map(local_name, ranges)))
            problem = f"{shown(value.text)} is not a value of {local_name(predicate)}, whose range is {wanted}"
            raise InputError(problem, remedy="write true or false" if ranges == {XSD + "boolean"} else None)
        return fact_of(triple, self.base.names)

    def _predicate(self, name: str, kinds: tuple[str, ...]) -> tuple[str, str]:
        vocabulary = self.base.vocabulary
        used = {iri: is_data for rule in self.base.rules for iri, is_data in rule.properties}
        for iri in (name,) if ":" in name else vocabulary.candidates(name):
            declared = vocabulary.kinds.get(iri, frozenset())
            kind = next((each for each in kinds if each in declared), None)
            if kind is None and iri in used and kinds != ("class",):
                kind = "data property" if used[iri] else "object property"
            if kind is not None:
                return iri, kind
        what = "class" if kinds == ("class",) else "property"
        raise InputError(f"there is no {what} {shown(local_name(name))}", remedy=vocabulary.guess(name, kinds))

    def _individuals(self, name: str) -> tuple[str, ...]:
        vocabulary = self.base.vocabulary
        return tuple(iri for iri in vocabulary.candidates(name) if "individual" in vocabulary.kinds.get(iri, ()))

    def _individual(self, term: Term) -> str:
        if not isinstance(term, Named):
            raise InputError(f"{shown(term[0])} is a value, but an individual is needed")
        name = term.iri
        if ":" in name:
            return name
        found = self._individuals(name)
        if found:
            return found[0]
        if name in self.new:
            return self.new[name]
        known = [each for each in self.base.vocabulary.by_name if self._individuals(each)]
        near = nearest(name, (*known, *self.new))
        remedy = f"{near.removesuffix('?')}? or introduce it" if near else "introduce it"
        raise InputError(f"there is no individual {shown(name)}", remedy=f"{remedy} under facts, as Class({name})")

    def _value(self, predicate: str, term: Term) -> Lit:
        if isinstance(term, Named):
            return Lit(term.iri, XSD + "string")
        assert isinstance(term, Lit)
        ranges = self.base.vocabulary.ranges.get(predicate, frozenset())
        if term.datatype == XSD + "integer" and XSD + "decimal" in ranges:
            return Lit(term.text, XSD + "decimal")
        return term


def read_rules(given: str, vocabulary: Vocabulary) -> tuple[Rule, ...]:
    """Read a rule that is given as "name: body -> head", or the rules of a file with the extension .swrl.

    Raises:
        InputError: there is no such file.
        RuleError: it is no rule, or cannot be used.
    """
    if given.endswith(".swrl") and "->" not in given:
        return RulesFile.read(Path(given)).rules(vocabulary)
    return (read_rule(given, vocabulary, Path("the rule")),)


def _parsed(text: str) -> Atom:
    try:
        rule = parse_rule(f"fact: -> {text}")
    except RuleError as error:
        if text.count("(") > text.count(")"):
            remedy = "in a YAML list in brackets a fact needs quotes, because of its comma"
            raise InputError(f"{shown(text)} is an incomplete fact", remedy=remedy) from None
        remedy = error.remedy or "write it as an atom of a rule: fg_status(fg_spiral_high, IN_ERROR_NFR)"
        raise InputError(f"{shown(text)} is not a fact: {error.problem}", remedy=remedy) from None
    if len(rule.head) != 1:
        raise InputError(f"{shown(text)} has {len(rule.head)} facts", remedy="write one")
    return rule.head[0]


#: Functions that every task of the mission asks for.
LASTING: Final = (MAINTAIN_MOTION,)
_STATUSES: Final = {"components": "c_status", "objectives": "o_status"}
#: Parts of a state, and what their names are.
_NOUNS: Final = {
    "measurements": "quality attribute",
    "components": "component",
    "groundings": "function",
    "objectives": "function",
}


class StateContent(BaseModel):
    """The keys of a state in a YAML file."""

    model_config = ConfigDict(extra="forbid")

    objectives: dict[str, str | None] | list[str] = {}
    groundings: dict[str, str] = {}
    components: dict[str, str | bool] = {}
    measurements: dict[str, int | float | bool | str] = {}

    def parts(self) -> Iterator[tuple[str, str, Any, KeyPath]]:
        """Yield kind, name, value and key path of each part."""
        for kind in _NOUNS:
            content = getattr(self, kind)
            if isinstance(content, list):
                yield from ((kind, name, None, (kind, at)) for at, name in enumerate(content))
            else:
                yield from ((kind, name, value, (kind, name)) for name, value in content.items())


@dataclass(frozen=True)
class ManagingSettings:
    """Behaviour of the managing subsystem that is not in the rules.

    Attributes:
        improves_exceeded: whether an objective is also adapted when a measured value exceeds what its current design
            expects (revision 2023).
        always_improved: functions whose objective has o_always_improve (revision 1.5).
        measured: quality attribute types that the scenario measures.
    """

    improves_exceeded: bool = False
    always_improved: frozenset[str] = frozenset()
    measured: tuple[str, ...] = ()

    @classmethod
    def of(cls, scenario: Scenario) -> ManagingSettings:
        """Read the settings of a scenario's revision."""
        revision = scenario.revision.metacontrol
        return cls(
            improves_exceeded=revision.improve_when_exceeded,
            always_improved=frozenset(revision.always_improve),
            measured=measured_attributes(scenario),
        )

    def state(
        self, asked: Mapping[str, str | None], groundings: Mapping[str, str], **more: Mapping[str, Any]
    ) -> KnowledgeState:
        """Make a state.

        Args:
            asked: o_status of the objectives, by function; None: UNGROUNDED without a grounding, else no status.
            groundings: function design by function.
            more: components and measurements, as KnowledgeState.of takes them.
        """
        objectives = [
            ObjectiveState(name, status or (None if name in groundings else UNGROUNDED), name in self.always_improved)
            for name, status in asked.items()
        ]
        return KnowledgeState.of(objectives, groundings=groundings, **more)


@dataclass
class StateBuilder:
    """Builds a state from parts whose names it checks. Later parts replace earlier ones.

    Example:
        >>> builder = StateBuilder(Ontology.load(), ManagingSettings())
        >>> builder.add_words(["water_visibility=1.8"])
        >>> builder.state().measurements
        (('water_visibility', Decimal('1.8')),)
    """

    base: Ontology
    settings: ManagingSettings
    objectives: dict[str, str | None] = field(default_factory=dict)
    groundings: dict[str, str] = field(default_factory=dict)
    components: dict[str, str] = field(default_factory=dict)
    measurements: dict[str, Any] = field(default_factory=dict)

    def add(self, kind: str, name: str, value: Any) -> None:
        """Add one part: one of the objectives, groundings, components or measurements.

        Raises:
            InputError: the knowledge base has no such name, or the value makes no sense.
        """
        if name not in (known := self._known(kind)):
            raise InputError(f"there is no {_NOUNS[kind]} {shown(name)}", remedy=did_you_mean(name, known))
        if kind == "measurements":
            if isinstance(value, bool) or not isinstance(value, int | float | str | Decimal):
                raise InputError(f"{name}: {shown(value)} is not a number", remedy=f"for instance {name}: 1.8")
            KnowledgeState.of(measurements={name: value})  # raises if it is not a number
        elif isinstance(value, bool):  # YAML reads a bare FALSE as one
            value = str(value).upper()
        if isinstance(value, str) and kind in _STATUSES:
            self._check_status(_STATUSES[kind], value)
        if kind == "groundings" and value not in self.base.designs(name):
            remedy = did_you_mean(value, self.base.designs(name))
            raise InputError(f"{name} has no function design {shown(value)}", remedy=remedy)
        getattr(self, kind)[name] = value

    def _known(self, kind: str) -> tuple[str, ...]:
        """Names that parts of a kind can have."""
        base = self.base
        return {"components": base.components, "measurements": base.quality_attributes}.get(kind, base.functions)

    def _check_status(self, property_name: str, value: str) -> None:
        """Reject a status that resembles one that a rule mentions, because nothing would follow from it."""
        known = texts_of((atom for rule in self.base.rules for atom in rule.atoms), TOMASYS + property_name)
        if property_name == "o_status":
            known.add(UNGROUNDED)
        if value not in known and not triggers_adaptation(value) and nearest(value.upper(), known) is not None:
            remedy = did_you_mean(value.upper(), sorted(known))
            raise InputError(f"no rule mentions the {property_name} {shown(value)}", remedy=remedy)

    def add_file(self, path: Path) -> None:
        """Add the parts in a YAML file with the keys of StateContent.

        Raises:
            InputError: the file cannot be read, or as add does, with line and key.
        """
        document = read_yaml(path)
        for kind, name, value, key_path in validated(document, StateContent).parts():
            try:
                self.add(kind, name, value)
            except InputError as error:
                raise document.error(error.problem, key_path, error.remedy) from None

    def add_words(self, words: Iterable[str], option: str = "--at") -> None:
        """Add parts of a state as they are written on the command line.

        Args:
            words: each NAME=VALUE (a quality attribute with its measured value, a component with its status, or a
                function with its design or the status of its objective), the name of a function that has an objective,
                a YAML file of a state, or FOLDER@TIME for the last state that a mission recorded up to a time in s.
            option: for messages.

        Raises:
            InputError: it is none of these, or names what the knowledge base does not have.
        """
        for word in words:
            folder, at, time = word.rpartition("@")
            name, equals, value = (part.strip() for part in word.partition("="))
            try:
                if equals and "/" not in name:
                    self._add_value(name, value)
                elif at:
                    self.add_state(recorded_state(recorded_states(Path(folder)), _seconds(time)))
                elif name in self.base.functions:
                    self.add("objectives", name, None)
                elif self._kind(name):
                    raise InputError(f"{shown(name)} has no value", remedy=f"{name}=VALUE")
                else:
                    self.add_file(Path(word))
            except InputError as error:
                if error.file is not None:
                    raise
                remedy = error.remedy or "NAME=VALUE, a YAML file, or FOLDER@SECONDS of a recorded mission"
                raise InputError(error.problem, place=option, remedy=remedy) from None

    def _kind(self, name: str) -> str | None:
        return next((each for each in _NOUNS if name in self._known(each)), None)

    def _add_value(self, name: str, value: str) -> None:
        kind = self._kind(name)
        if kind is None:
            problem = f"there is no quality attribute, component or function {shown(name)}"
            raise InputError(problem, remedy=did_you_mean(name, [each for one in _NOUNS for each in self._known(one)]))
        is_status = kind == "groundings" and (value == UNGROUNDED or triggers_adaptation(value))
        self.add("objectives" if is_status else kind, name, value)

    def add_state(self, state: KnowledgeState) -> None:
        """Add all parts of a state; reports about things that the ontologies do not have are ignored.

        Raises:
            InputError: the knowledge base lacks a function or a design.
        """
        for kind, content in state_dict(state).items():
            for name, value in content.items():
                if kind in ("objectives", "groundings") or name in self._known(kind):
                    self.add(kind, name, value)

    def state(self) -> KnowledgeState:
        """Build the state. Without objectives, it has those of the groundings, else those of the search task.

        Raises:
            KnowledgeError: the ontologies have no function that an objective could ask for.
        """
        if not self.base.functions:
            raise KnowledgeError(
                "there is no function, so there is nothing to decide",
                file=", ".join(map(str, self.base.files)),
                remedy="give an ontology that uses TOMASys as suave.owl does",
            )
        search = [name for name in (*LASTING, GENERATE_SEARCH_PATH) if name in self.base.functions]
        asked = self.objectives or dict.fromkeys(self.groundings or search)
        parts = {"components": self.components, "measurements": self.measurements}
        return self.settings.state(asked, self.groundings, **parts)


def state_dict(state: KnowledgeState) -> dict[str, Any]:
    """The content of a YAML or JSON file for a state; numbers are text, so that they stay exact."""
    return {
        "objectives": {each.function: each.status for each in state.objectives},
        "groundings": dict(state.groundings),
        "components": dict(state.components),
        "measurements": {name: format(value, "f") for name, value in state.measurements},
    }


def _seconds(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{shown(text)} is not a time in seconds", remedy="such as flown@53.7") from None


def recorded_states(folder: Path, run: int | None = None) -> tuple[KnowledgeRecord, ...]:
    """The states of a recorded mission, or of one run of a campaign that recorded its knowledge.

    Raises:
        InputError: there are none, or the campaign has no such run.
    """
    if (folder / KNOWLEDGE_FILE).is_file():
        return read_knowledge(folder / KNOWLEDGE_FILE)
    if not (folder / CAMPAIGN_KNOWLEDGE_FILE).is_file():
        remedy = "give the folder of suave-des run --manager metacontrol --out FOLDER"
        raise InputError(f"{folder} has no recorded states", remedy=remedy)
    runs: dict[int, tuple[KnowledgeRecord, ...]] = {}
    for mission in read_missions(folder / CAMPAIGN_KNOWLEDGE_FILE):
        runs.setdefault(mission.run, mission.records)
    if run not in runs:
        numbers = f"a number from {min(runs)} to {max(runs)}" if runs else "of a campaign with --record-knowledge"
        raise InputError(f"{folder} has no states of run {shown(run)}", remedy=f"give run: {numbers}")
    return runs[run]


def recorded_state(records: Sequence[KnowledgeRecord], at_s: float) -> KnowledgeState:
    """Return the last state recorded up to a mission time.

    Raises:
        InputError: the first state was recorded later.
    """
    before = [record.state for record in records if record.t_s <= at_s]
    if not before:
        first = f"the first one is at {records[0].t_s:.2f} s" if records else "there are none"
        raise InputError(f"no state was recorded until {at_s:g} s", remedy=first)
    return before[-1]
