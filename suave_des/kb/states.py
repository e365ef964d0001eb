"""States, facts and rules as people write them: in YAML files, on the command line, or as a
recorded mission's time.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from decimal import Decimal
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from suave_des.domain import GENERATE_SEARCH_PATH, MAINTAIN_MOTION
from suave_des.errors import InputError, KeyPath, nearest, shown, unknown
from suave_des.files import Json, check_folder
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rdf import (
    C_STATUS,
    OWL,
    RDF_TYPE,
    TOMASYS,
    XSD,
    Lit,
    Triple,
    fact_of,
    local_name,
)
from suave_des.knowledge.reasoner import triggers_adaptation
from suave_des.knowledge.rules import (
    IDENTITIES,
    Atom,
    Named,
    Rule,
    RuleError,
    Term,
    Variable,
    texts_of,
)
from suave_des.knowledge.rules.files import (
    NOUNS,
    RulesFile,
    Vocabulary,
    check_rule,
    looked_up,
    rule_problems,
)
from suave_des.knowledge.rules.parser import parse_rule
from suave_des.knowledge.state import UNGROUNDED, Fact, KnowledgeState, ObjectiveState
from suave_des.records.mission_folder import (
    CAMPAIGN_KNOWLEDGE_FILE,
    KNOWLEDGE_FILE,
    RecordedKnowledge,
    read_missions,
    read_states,
)
from suave_des.scenario.models import Scenario
from suave_des.scenario.yamlfile import read_yaml, validated
from suave_des.scenario_knowledge import REPORTED_STATUSES, measured_attributes

#: Begins the IRIs of individuals that exist in a test or a question only.
NEW_INDIVIDUAL = "urn:suave-des:test#"


@dataclass
class FactReader:
    """Reads facts that are written as atoms of rules, such as fg_status(fg_spiral_high,
    IN_ERROR_NFR).

    Text needs no quotes. A name that the ontologies do not have becomes a new individual where it
    first occurs as a member of a class: Binding(b1).

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
        if not 1 <= len(atom.arguments) <= 2 or any(atom.variables()):
            remedy = "name the individuals, as in Component(c_thruster_1) or fg_status(fg_spiral_high, IN_ERROR_NFR)"
            raise InputError(
                f"{shown(text)} has a variable or too many arguments for a fact", remedy=remedy
            )
        if OWL + atom.predicate in IDENTITIES and len(atom.arguments) == 2:
            one, other = map(self._individual, atom.arguments)
            return one, OWL + atom.predicate, other
        predicate, kind = self._predicate(atom)
        subject = self._individual(atom.arguments[0])
        value = atom.arguments[-1]
        if kind == "class":
            return subject, RDF_TYPE, predicate
        if kind == "object property":
            return subject, predicate, self._individual(value)
        if not isinstance(value, Lit):
            return subject, predicate, Lit(value[0], XSD + "string")
        is_decimal = XSD + "decimal" in self.base.vocabulary.ranges.get(predicate, ())
        if value.datatype == XSD + "integer" and is_decimal:
            value = value._replace(datatype=XSD + "decimal")
        return subject, predicate, value

    def _predicate(self, atom: Atom) -> tuple[str, str]:
        """The IRI and the kind of the class or property of a fact: declared, or concluded by a
        rule.
        """
        vocabulary = self.base.vocabulary
        name = atom.predicate
        kinds = ("class",) if len(atom.arguments) == 1 else ("object property", "data property")
        for iri in (name,) if ":" in name else vocabulary.candidates(name):
            for kind in kinds:
                if kind in vocabulary.kinds.get(iri, ()):
                    return iri, kind
        for head in self.base.content.conclusions:
            kind = NOUNS.get(head.kind, "")
            if kind in kinds and name in (head.predicate, local_name(head.predicate)):
                return head.predicate, kind
        problem = f"there is no {kinds[0].split()[-1]} {shown(local_name(name))}"
        raise InputError(problem, remedy=vocabulary.guess(name, kinds))

    def fact(self, text: str) -> Fact:
        """Read one fact, in the form in which inferences have it.

        Raises:
            InputError: it is not a fact, a name in it is unknown, or it can never follow, for its
                value.
        """
        subject, predicate, value = self.triple(text)
        if isinstance(value, Lit):
            atom = Atom("data", predicate, (Variable("x"), value))
            concluded = Atom("class", OWL + "Thing", (Variable("x"),))
            asked = Rule("", (atom,), (concluded,))
            for problem in rule_problems(asked, self.base.vocabulary):
                raise InputError(problem.message, remedy=problem.remedy)
        return fact_of((subject, predicate, value), self.base.names)

    def _individuals(self, name: str) -> tuple[str, ...]:
        vocabulary = self.base.vocabulary
        return tuple(
            iri
            for iri in vocabulary.candidates(name)
            if "individual" in vocabulary.kinds.get(iri, ())
        )

    def _individual(self, term: Term) -> str:
        if not isinstance(term, Named):
            raise InputError(f"{shown(term[0])} is a value, but an individual is needed")
        if ":" in term.iri:
            return term.iri
        for found in (*self._individuals(term.iri), self.new.get(term.iri)):
            if found is not None:
                return found
        known = [each for each in self.base.vocabulary.by_name if self._individuals(each)]
        remedy = (
            nearest(term.iri, (*known, *self.new))
            or f"introduce it under facts, as Class({term.iri})"
        )
        raise InputError(f"there is no individual {shown(term.iri)}", remedy=remedy)


def read_rules(given: str, vocabulary: Vocabulary) -> tuple[Rule, ...]:
    """Read a rule that is given as "name: body -> head", or the rules of a file with the extension
    .swrl.

    Raises:
        InputError: there is no such file.
        RuleError: it is no rule, or cannot be used.
    """
    if given.endswith(".swrl") and "->" not in given:
        return RulesFile.read(Path(given)).rules(vocabulary)
    return (check_rule(looked_up(parse_rule(given, Path("the rule")), vocabulary), vocabulary),)


def _parsed(text: str) -> Atom:
    try:
        (atom,) = parse_rule(f"fact: -> {text}").head
    except (RuleError, ValueError) as error:
        remedy = "write one atom of a rule: fg_status(fg_spiral_high, IN_ERROR_NFR), in quotes in a YAML list"
        problem = f": {error.problem}" if isinstance(error, RuleError) else ""
        raise InputError(f"{shown(text)} is not a fact{problem}", remedy=remedy) from None
    return atom


#: Functions that every task of the mission asks for.
LASTING = (MAINTAIN_MOTION,)
_STATUSES = {"components": "c_status", "objectives": "o_status"}
#: Parts of a state, and what their names are.
_NOUNS = {
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

    def parts(self) -> Iterator[tuple[str, str, object, KeyPath]]:
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
        improves_exceeded: whether an objective is also adapted when a measured value exceeds what
            its current design expects (revision 2023).
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
        self,
        objectives: Mapping[str, str | None],
        groundings: Mapping[str, str],
        **more: Mapping[str, Any],
    ) -> KnowledgeState:
        """Make a state.

        Args:
            objectives: o_status of each, by function; None: UNGROUNDED without a grounding, else no
                status.
            groundings: function design by function.
            more: components and measurements, as KnowledgeState.of takes them.
        """
        asked = [
            ObjectiveState(
                name,
                status or (None if name in groundings else UNGROUNDED),
                name in self.always_improved,
            )
            for name, status in objectives.items()
        ]
        return KnowledgeState.of(asked, groundings=groundings, **more)


@dataclass
class StateBuilder:
    """Builds a state from parts whose names it checks. Later parts replace earlier ones."""

    base: Ontology
    settings: ManagingSettings
    parts: dict[str, dict[str, object]] = field(
        default_factory=lambda: {kind: {} for kind in _NOUNS}
    )
    measured_since: dict[str, Decimal] | None = None  # of a recorded state, until a value is given

    def add(self, kind: str, name: str, value: Any) -> None:
        """Add one part: one of the objectives, groundings, components or measurements.

        Raises:
            InputError: the knowledge base has no such name, or the value makes no sense.
        """
        known = self._known(kind)
        if name not in known:
            raise unknown(f"there is no {_NOUNS[kind]} {shown(name)}", name, known)
        if kind == "measurements":
            _check_number(name, value)
            self.measured_since = None
        elif isinstance(value, bool):  # YAML reads a bare FALSE as one
            value = str(value).upper()
        # Both raise an error if the value is no number, or no text.
        if kind == "objectives":
            KnowledgeState.of([ObjectiveState(name, value)])
        else:
            part: Json = {kind: {name: value}}
            KnowledgeState.of(**part)
        if isinstance(value, str) and kind in _STATUSES:
            self._check_status(_STATUSES[kind], value)
        if kind == "groundings" and value not in self.base.designs(name):
            problem = f"{name} has no function design {shown(value)}"
            raise unknown(problem, value, self.base.designs(name))
        self.parts[kind][name] = value

    def _known(self, kind: str) -> tuple[str, ...]:
        """Names that parts of a kind can have."""
        model = self.base.model
        own = {"components": model.components, "measurements": model.attributes}
        return tuple(own.get(kind, model.functions))

    def _check_status(self, property_name: str, value: str) -> None:
        """Reject a status that resembles one that a rule mentions, because nothing would follow
        from it.
        """
        known = texts_of(
            (atom for rule in self.base.rules for atom in rule.atoms), TOMASYS + property_name
        )
        if property_name == "o_status":
            known.add(UNGROUNDED)
        if (
            value not in known
            and not triggers_adaptation(value)
            and nearest(value.upper(), known) is not None
        ):
            problem = f"no rule mentions the {property_name} {shown(value)}"
            raise unknown(problem, value.upper(), sorted(known))

    def _check_reported(self, value: str) -> None:
        """Reject a status from which nothing follows, unless a rule reads whatever it is."""
        atoms = [
            atom for rule in self.base.rules for atom in rule.atoms if atom.predicate == C_STATUS
        ]
        asked = {term for atom in atoms for term in atom.arguments[1:]}
        known = texts_of(atoms, C_STATUS).union(*REPORTED_STATUSES.values())
        if value not in known and not any(isinstance(term, Variable) for term in asked):
            problem = f"no rule mentions the c_status {shown(value)}, and nothing reports it"
            raise unknown(problem, value, sorted(known))

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

    def add_words(self, words: Iterable[str]) -> None:
        """Add parts of a state as they are written on the command line.

        Args:
            words: each NAME=VALUE (a quality attribute with its measured value, a component with
                its status, or a function with its design or the status of its objective), the name
                of a function that has an objective, a YAML file of a state, or FOLDER@TIME for the
                last state that a mission recorded up to a time in s.

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
                    self.add_state(recorded_state(Path(folder), time))
                elif name in self.base.functions:
                    self.add("objectives", name, None)
                else:
                    self.add_file(Path(word))
            except InputError as error:
                if error.file is not None:
                    raise
                remedy = (
                    error.remedy
                    or "NAME=VALUE, a YAML file, or FOLDER@SECONDS of a recorded mission"
                )
                raise InputError(error.problem, place="--at", remedy=remedy) from None

    def _add_value(self, name: str, value: str) -> None:
        kind = next((each for each in _NOUNS if name in self._known(each)), None)
        if kind is None:
            known = dict.fromkeys(each for one in _NOUNS for each in self._known(one))
            problem = f"there is no quality attribute, component or function {shown(name)}"
            raise unknown(problem, name, known)
        if kind == "components":
            self._check_reported(value)
        is_status = kind == "groundings" and (value == UNGROUNDED or triggers_adaptation(value))
        self.add("objectives" if is_status else kind, name, value)

    def add_state(self, state: KnowledgeState) -> None:
        """Add all parts of a state; reports about things that the ontologies do not have are
        ignored.

        Raises:
            InputError: the knowledge base lacks a function or a design.
        """
        for kind, content in state_dict(state).items():
            for name, value in content.items():
                if kind in ("objectives", "groundings") or name in self._known(kind):
                    self.add(kind, name, value)
        if state.measured_since is not None:
            known = self._known("measurements")
            self.measured_since = {name: at for name, at in state.measured_since if name in known}

    def state(self) -> KnowledgeState:
        """Build the state. Without objectives, it has those of the groundings, else those of the
        search task.
        """
        search = [name for name in (*LASTING, GENERATE_SEARCH_PATH) if name in self.base.functions]
        asked = self.parts["objectives"] or dict.fromkeys(self.parts["groundings"] or search)
        state = self.settings.state(**self.parts | {"objectives": asked})
        if self.measured_since is None:
            return state
        return replace(state, measured_since=tuple(sorted(self.measured_since.items())))


def _check_number(name: str, value: object) -> None:
    if isinstance(value, bool) or not isinstance(value, int | float | str | Decimal):
        remedy = f"for instance {name}: 1.8"
        raise InputError(f"{name}: {shown(value)} is not a number", remedy=remedy)


def state_dict(state: KnowledgeState) -> Json:
    """The content of a YAML or JSON file for a state; numbers are text, so that they stay exact."""
    return {
        "objectives": {each.function: each.status for each in state.objectives},
        "groundings": dict(state.groundings),
        "components": dict(state.components),
        "measurements": {name: format(value, "f") for name, value in state.measurements},
    }


def recorded_missions(folder: Path) -> Iterator[tuple[Path, RecordedKnowledge]]:
    """Read the missions that recorded their states, with their folders; the run of a mission of its
    own is 0.

    The folder is the output of a mission or of a campaign, or has such folders in it.

    Raises:
        InputError: there is none, or a file cannot be read.
    """
    check_folder(folder)
    is_any_found = False
    for each in [folder, *sorted(filter(Path.is_dir, folder.iterdir()))]:
        if (each / KNOWLEDGE_FILE).is_file():
            is_any_found = True
            yield each, RecordedKnowledge("", 0, 0, *read_states(each))
        if (each / CAMPAIGN_KNOWLEDGE_FILE).is_file():
            is_any_found = True
            for mission in read_missions(each / CAMPAIGN_KNOWLEDGE_FILE):
                yield each, mission
    if not is_any_found:
        problem = f"has no {KNOWLEDGE_FILE} or {CAMPAIGN_KNOWLEDGE_FILE}, nor has a folder in it"
        remedy = "record with run --manager metacontrol --out, or campaign --record-knowledge"
        raise InputError(problem, file=folder, remedy=remedy)


def recorded_state(folder: Path, time: str | float, run: int = 0) -> KnowledgeState:
    """Return the last state that a mission recorded up to a time.

    Args:
        time: mission time, s.
        run: of the campaign whose folder it is; 0: the folder is the mission's own.

    Raises:
        InputError: there is no such mission, the first state was recorded later, or the time is no
            number.
    """
    records = next(
        (mission.records for _, mission in recorded_missions(folder) if mission.run == run), ()
    )
    try:
        before = [record.state for record in records if record.t_s <= float(time)]
    except ValueError:
        raise InputError(
            f"{shown(time)} is not a time in seconds", remedy="such as flown@53.7"
        ) from None
    if not before:
        of = f" of run {run}" if run else ""
        remedy = "give a later time, or a run of the campaign"
        raise InputError(f"{folder} has no state{of} until {time} s", remedy=remedy)
    return before[-1]
