"""States as people write them: mappings, YAML files, NAME=VALUE on the command line, or a recorded mission's time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path
from typing import Any, Final

from suave_des.campaign.knowledge_records import CAMPAIGN_KNOWLEDGE_FILE, KNOWLEDGE_FILE, read_knowledge, read_missions
from suave_des.domain import GENERATE_SEARCH_PATH, MAINTAIN_MOTION
from suave_des.errors import InputError, KeyPath, KnowledgeError, did_you_mean, nearest, shown
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.planning import triggers_adaptation
from suave_des.knowledge.rdf import TOMASYS
from suave_des.knowledge.rules.syntax import texts_of
from suave_des.knowledge.state import UNGROUNDED, KnowledgeState, ObjectiveState
from suave_des.metrics.result import KnowledgeRecord
from suave_des.scenario.models import Scenario
from suave_des.scenario.yamlfile import read_yaml
from suave_des.scenario_knowledge import measured_attributes

#: Functions that every task of the mission asks for.
LASTING: Final = (MAINTAIN_MOTION,)
_STATUSES: Final = {"components": "c_status", "objectives": "o_status"}
_NOUNS: Final = {
    "objectives": "function",
    "groundings": "function",
    "components": "component",
    "measurements": "quality attribute",
}
#: Keys of a state in a YAML file.
STATE_KEYS: Final = tuple(_NOUNS)


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
            improves_exceeded=revision.search_improves_when_exceeded,
            always_improved=frozenset({GENERATE_SEARCH_PATH} if revision.search_always_improves else ()),
            measured=measured_attributes(scenario),
        )

    def objective(self, function: str, design: str | None, status: str | None = None) -> ObjectiveState:
        """Make a function's objective; without a grounding it is UNGROUNDED."""
        known = status if status is not None or design is not None else UNGROUNDED
        return ObjectiveState(function, known, function in self.always_improved)


@dataclass
class StateBuilder:
    """Builds a state from parts whose names it checks. Later parts replace earlier ones.

    Example:
        >>> builder = StateBuilder(Ontology.load(), ManagingSettings())
        >>> builder.add_words("measurements", "--set", ["water_visibility=1.8"])
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
        else:
            if isinstance(value, bool):  # YAML reads a bare FALSE as one
                value = str(value).upper()
            if not isinstance(value, str) and not (kind == "objectives" and value is None):
                raise InputError(f"{name}: {shown(value)} is not a word", remedy="put it in quotes")
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

    def add_words(self, kind: str, option: str, words: Iterable[str]) -> None:
        """Add parts as NAME=VALUE, such as water_visibility=1.8; an objective may be a name alone.

        Raises:
            InputError: as add does, with the option as its place.
        """
        for word in words:
            name, equals, value = word.partition("=")
            if not equals and kind != "objectives":
                raise InputError(f"{shown(word)} has no value", place=option, remedy=f"{option} NAME=VALUE")
            try:
                self.add(kind, name.strip(), value.strip() if equals else None)
            except InputError as error:
                raise InputError(error.problem, place=option, remedy=error.remedy) from None

    def add_file(self, path: Path) -> None:
        """Add the parts in a YAML file with any of the mappings objectives, groundings, components, measurements.

        Raises:
            InputError: the file cannot be read, or as add does, with line and key.
        """
        document = read_yaml(path)
        for key, content in document.data.items():
            if key not in STATE_KEYS:
                raise document.error(f"{shown(key)} is not a key of a state", (key,), did_you_mean(key, STATE_KEYS))
            if isinstance(content, list) and key == "objectives":
                entries: list[tuple[Any, Any, KeyPath]] = [(name, None, (key, at)) for at, name in enumerate(content)]
            elif isinstance(content, Mapping):
                entries = [(name, value, (key, name)) for name, value in content.items()]
            else:
                raise document.error(f"{shown(content)} is not a mapping", (key,), "write `name: value` lines under it")
            for name, value, key_path in entries:
                try:
                    self.add(key, str(name), value)
                except InputError as error:
                    raise document.error(error.problem, key_path, error.remedy) from None

    def add_at(self, words: Iterable[str], option: str = "--at") -> None:
        """Add parts of a state, each in its shortest form.

        Args:
            words: each NAME=VALUE (a quality attribute, a component, or a function with its design), a YAML file of a
                state, or FOLDER@TIME for the last state that a mission recorded up to a time in s.
            option: for messages.

        Raises:
            InputError: it is none of these, or names what the knowledge base does not have.
        """
        for word in words:
            folder, at, time = word.rpartition("@")
            name, equals, value = word.partition("=")
            try:
                if equals and "/" not in name:
                    self.add(self._kind(name.strip()), name.strip(), value.strip())
                elif at:
                    self.add_state(recorded_state(recorded_states(Path(folder)), _seconds(time)))
                else:
                    self.add_file(Path(word))
            except InputError as error:
                if error.file is not None and Path(word).is_file():
                    raise
                remedy = error.remedy or "NAME=VALUE, a YAML file, or FOLDER@SECONDS of a recorded mission"
                raise InputError(error.problem, place=option, remedy=remedy) from None

    def _kind(self, name: str) -> str:
        kinds = ("measurements", "components", "groundings")
        for kind in kinds:
            if name in self._known(kind):
                return kind
        problem = f"there is no quality attribute, component or function {shown(name)}"
        raise InputError(problem, remedy=did_you_mean(name, [each for kind in kinds for each in self._known(kind)]))

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
        return KnowledgeState.of(
            [self.settings.objective(name, self.groundings.get(name), status) for name, status in asked.items()],
            groundings=self.groundings,
            components=self.components,
            measurements=self.measurements,
        )


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
    missions = list(read_missions(folder / CAMPAIGN_KNOWLEDGE_FILE))
    for mission in missions:
        if mission.run == run:
            return mission.records
    runs = sorted({mission.run for mission in missions})
    remedy = f"give run: a number from {runs[0]} to {runs[-1]}" if runs else "record a campaign with --record-knowledge"
    raise InputError(f"{folder} has no states of run {shown(run)}", remedy=remedy)


def recorded_state(records: Iterable[KnowledgeRecord], at_s: float) -> KnowledgeState:
    """Return the last state recorded up to a mission time.

    Raises:
        InputError: the first state was recorded later.
    """
    known = list(records)
    before = [record for record in known if record.t_s <= at_s]
    if not before:
        first = f"the first one is at {known[0].t_s:.2f} s" if known else "there are none"
        raise InputError(f"no state was recorded until {at_s:g} s", remedy=first)
    return before[-1].state
