"""States as people write them: a YAML file, or NAME=VALUE on the command line."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from suave_des.domain import GENERATE_SEARCH_PATH, MAINTAIN_MOTION
from suave_des.errors import InputError, KeyPath, KnowledgeError, did_you_mean, shown
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.planning import calls
from suave_des.knowledge.rdf import Lit
from suave_des.knowledge.state import KnowledgeState, ObjectiveState
from suave_des.knowledge.vocabulary import TOMASYS, XSD, nearest
from suave_des.scenario.models import Scenario
from suave_des.scenario.yamlfile import YamlDocument, read_yaml

UNGROUNDED: Final = "UNGROUNDED"
SEARCH: Final = GENERATE_SEARCH_PATH
LASTING: Final = (MAINTAIN_MOTION,)
_STATUSES: Final = {"components": "c_status", "objectives": "o_status"}
_KEYS: Final = ("objectives", "groundings", "components", "measurements")


@dataclass(frozen=True)
class Loop:
    """What the managing subsystem does in code, besides what the rules say.

    Attributes:
        improves_exceeded: whether an objective is adapted too when a measured value exceeds what its present design
            expects (revision 2023).
        always_improved: functions whose objective carries o_always_improve (revision 1.5).
        measured: quality attribute types that the scenario measures.
    """

    improves_exceeded: bool = False
    always_improved: frozenset[str] = frozenset()
    measured: tuple[str, ...] = ()

    @classmethod
    def of(cls, scenario: Scenario) -> Loop:
        """The loop of a scenario's revision."""
        revision = scenario.revision.metacontrol
        battery = ("battery_level",) if scenario.battery is not None else ()
        return cls(
            improves_exceeded=revision.search_improves_when_exceeded,
            always_improved=frozenset({SEARCH} if revision.search_always_improves else ()),
            measured=tuple(sorted({*scenario.signals, *battery})),
        )

    def objective(self, function: str, design: str | None, status: str | None = None) -> ObjectiveState:
        """A function's objective as the loop has it: without a grounding it is UNGROUNDED."""
        known = status if status is not None or design is not None else UNGROUNDED
        return ObjectiveState(function, known, function in self.always_improved)


@dataclass
class StateParts:
    """A state under construction. Later additions win over earlier ones."""

    base: Ontology
    objectives: dict[str, str | None] = field(default_factory=dict)
    groundings: dict[str, str] = field(default_factory=dict)
    components: dict[str, str] = field(default_factory=dict)
    measurements: dict[str, Any] = field(default_factory=dict)

    def add(self, kind: str, name: str, value: Any) -> None:
        """Add one part.

        Raises:
            InputError: the knowledge base has no such name, or the value cannot be meant.
        """
        known = {
            "objectives": self.base.functions,
            "groundings": self.base.functions,
            "components": self.base.components,
            "measurements": self.base.quality_attributes,
        }[kind]
        what = {"components": "component", "measurements": "quality attribute"}.get(kind, "function")
        if name not in known:
            raise InputError(f"there is no {what} {shown(name)}", remedy=did_you_mean(name, known))
        if kind == "measurements":
            if isinstance(value, bool) or not isinstance(value, int | float | str):
                raise InputError(f"{name}: {shown(value)} is not a number", remedy=f"for instance {name}: 1.8")
            KnowledgeState.of(measurements={name: value})  # raises when it is no number
        else:
            if isinstance(value, bool):  # YAML takes a bare FALSE for one
                value = str(value).upper()
            if not isinstance(value, str) and not (kind == "objectives" and value is None):
                raise InputError(f"{name}: {shown(value)} is not a word", remedy="put it in quotes")
        if isinstance(value, str) and kind in _STATUSES:
            self._see_status(_STATUSES[kind], value)
        if kind == "groundings" and value not in self.base.designs(name):
            raise InputError(
                f"{name} has no function design {shown(value)}", remedy=did_you_mean(value, self.base.designs(name))
            )
        getattr(self, kind)[name] = value

    def _see_status(self, prop: str, value: str) -> None:
        """Refuse a status that is nearly one of the rules': nothing would follow from it.

        Raises:
            InputError: with the statuses that are known.
        """
        words = {
            term.text
            for rule in self.base.rules
            for atom in rule.atoms
            if atom.predicate == TOMASYS + prop
            for term in atom.arguments
            if isinstance(term, Lit) and term.datatype == XSD + "string"
        }
        if prop == "o_status":
            words.add(UNGROUNDED)
        if value not in words and not calls(value) and nearest(value.upper(), words) is not None:
            raise InputError(
                f"{shown(value)} is no {prop} that a rule speaks of", remedy=did_you_mean(value.upper(), sorted(words))
            )

    def state(self, loop: Loop) -> KnowledgeState:
        """The state. Where no objectives are given, they are those of the groundings, else those of the search task.

        Raises:
            KnowledgeError: the ontologies have no function that an objective could ask for.
        """
        if not self.base.functions:
            raise KnowledgeError(
                "there is no function, so there is nothing to decide",
                file=", ".join(map(str, self.base.files)),
                remedy="give an ontology that uses TOMASys as suave.owl does",
            )
        asked = dict(self.objectives)
        if not asked:
            default = self.groundings or [name for name in (*LASTING, SEARCH) if name in self.base.functions]
            asked = dict.fromkeys(default)
        return KnowledgeState.of(
            [loop.objective(name, self.groundings.get(name), status) for name, status in asked.items()],
            groundings=self.groundings,
            components=self.components,
            measurements=self.measurements,
        )


def state_from(
    base: Ontology,
    loop: Loop,
    file: Path | None = None,
    *,
    measured: Iterable[str] = (),
    components: Iterable[str] = (),
    groundings: Iterable[str] = (),
    objectives: Iterable[str] = (),
) -> KnowledgeState:
    """A state from a file and from NAME=VALUE words, which win over the file.

    Args:
        base: has the names.
        loop: decides on the status of objectives.
        file: YAML with any of the mappings objectives, groundings, components, measurements.
        measured: such as water_visibility=1.8.
        components: such as c_thruster_1=FALSE.
        groundings: such as f_generate_search_path=fd_spiral_high.
        objectives: a function, or function=status.

    Raises:
        InputError: the file cannot be read, or a name or value is unknown, with its place.
    """
    parts = StateParts(base)
    if file is not None:
        _read(parts, read_yaml(file))
    given: Sequence[tuple[str, str, Iterable[str]]] = (
        ("measurements", "--set", measured),
        ("components", "--component", components),
        ("groundings", "--ground", groundings),
        ("objectives", "--objective", objectives),
    )
    for kind, option, words in given:
        for word in words:
            name, equals, value = word.partition("=")
            if not equals and kind != "objectives":
                raise InputError(f"{shown(word)} has no value", place=option, remedy=f"{option} NAME=VALUE")
            try:
                parts.add(kind, name.strip(), value.strip() if equals else None)
            except InputError as error:
                raise InputError(error.problem, place=option, remedy=error.remedy) from None
    return parts.state(loop)


def _read(parts: StateParts, document: YamlDocument) -> None:
    for key, content in document.data.items():
        if key not in _KEYS:
            raise document.error(f"{shown(key)} is no part of a state", (key,), did_you_mean(key, _KEYS))
        if isinstance(content, list) and key == "objectives":
            entries: list[tuple[Any, Any, KeyPath]] = [(name, None, (key, at)) for at, name in enumerate(content)]
        elif isinstance(content, Mapping):
            entries = [(name, value, (key, name)) for name, value in content.items()]
        else:
            raise document.error(f"{shown(content)} is not a mapping", (key,), "write `name: value` lines under it")
        for name, value, key_path in entries:
            try:
                parts.add(key, str(name), value)
            except InputError as error:
                raise document.error(error.problem, key_path, error.remedy) from None


def state_dict(state: KnowledgeState) -> dict[str, Any]:
    """A state as the content of such a file; numbers are text, so that they stay exact."""
    return {
        "objectives": {each.function: each.status for each in state.objectives},
        "groundings": dict(state.groundings),
        "components": dict(state.components),
        "measurements": {name: format(value, "f") for name, value in state.measurements},
    }
