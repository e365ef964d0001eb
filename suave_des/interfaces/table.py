"""Managers that are decision tables: `table:FILE.csv`, and the shipped ones.

Metacontrol's loop with a table in place of the knowledge base. Form of the files:
docs/guides/managers.md.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from decimal import Decimal
from functools import cache, lru_cache
from itertools import chain, product
from operator import attrgetter
from pathlib import Path
from typing import ClassVar, TypeVar

import yaml

from suave_des.domain import (
    BATTERY_LEVEL,
    FOLLOW_PIPELINE,
    GENERATE_SEARCH_PATH,
    MAINTAIN_MOTION,
    SURFACE,
    THRUSTER_NAMES,
    WATER_VISIBILITY,
)
from suave_des.errors import InputError, did_you_mean, line_error, shown
from suave_des.kb.decision_table import SHIPPED, DecisionTable, read_table
from suave_des.kb.reports import Reports, component_reports
from suave_des.kb.scale import Scale
from suave_des.knowledge.state import (
    NONE_LEFT,
    STAYS,
    UNGROUNDED,
    KnowledgeState,
    ObjectiveState,
)
from suave_des.managing.base import AdaptationProcess, ManagingSubsystem, System
from suave_des.managing.metacontrol import LoopSettings, Metacontrol
from suave_des.monitor.diagnostics import FAILED, HULL, LEAK, RECOVERED, Diagnostic, Kind
from suave_des.resources import find
from suave_des.scenario.loader import LoadedScenario
from suave_des.scenario.models import MetacontrolRevision
from suave_des.scenario_knowledge import REPORTED_STATUSES, measured_attributes

_Value = TypeVar("_Value")
_AT_ONCE = MetacontrolRevision(
    task_bridge_period_s=0.0,
    objectives_at_launch=(),
    waits_for_first_measurement=False,
    always_improve=(),
    improve_when_exceeded=False,
    ignores_diagnostics_without_objective=False,
)


class TableManager(Metacontrol):
    """table:FILE.csv: decides as the rows of a table say."""

    needs_knowledge: ClassVar[bool] = False
    name: ClassVar[str]
    """The manager's name: table:FILE.csv, or that of a shipped table."""

    @classmethod
    def _file(cls) -> str:
        return cls.name.removeprefix("table:")

    @classmethod
    def input_files(cls, settings: Mapping[str, object]) -> Collection[str]:
        """The table, unless it is shipped."""
        return () if cls.name == cls._file() else (cls._file(),)

    @classmethod
    def check(cls, loaded: LoadedScenario) -> None:
        """Check that the table decides every state that missions can come to."""
        file = cls._file()
        path = find(file, SHIPPED) if cls.name == file else loaded.manager_file(cls.name, file)
        table = opened(path, loaded.manager_settings(cls.name))
        _check_names(table, loaded)
        for function in loaded.scenario.needed_functions():
            if cls.name == file and function not in table.designs:
                problem = f"no row decides {function}: {file} is not made for such missions"
                raise InputError(problem, file=path, remedy="compare other managers in them")
            for state in _states(table, function, loaded):
                table.rule(function, state)

    def __init__(self, system: System) -> None:
        file = self._file()
        path = find(file, SHIPPED) if self.name == file else system.file(file)
        self._table = opened(path, system.settings)
        self._is_event_driven = self._table.settings.trigger == "event"
        self._subscribes_to = (
            (Kind.COMPONENT_STATUS, Kind.QA_STATUS)
            if self._is_event_driven
            else (Kind.COMPONENT_STATUS,)
        )
        self._is_deciding = self._is_due = False
        super().__init__(system)

    def loop_settings(self) -> LoopSettings:
        """Return what the loop works with: the table."""
        scenario = self.system.scenario
        settings = self._table.settings
        revision = scenario.revision.metacontrol if settings.as_metacontrol else _AT_ONCE
        period_s = settings.period_s or scenario.managers.metacontrol.reasoning_period_s
        is_given = "latency_s" in settings.model_fields_set
        if self._is_event_driven:
            revision = revision.model_copy(update={"executes_plans_of_removed_objectives": False})
        return LoopSettings(
            self._table,
            revision,
            None if self._is_event_driven else period_s,
            settings.latency_s if is_given else scenario.latencies.inference_s,
            settings.forgets_recovered,
        )

    def first_cycle_s(self, period_s: float) -> float:
        """Draw when the first decision is made."""
        timer = "metacontrol" if self._table.settings.as_metacontrol else "table"
        return self.system.first_tick_s(timer, period_s)

    # Decisions at events; the loop makes the others.

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        """Update a component's status."""
        super().diagnostic(diagnostic)
        self._decide()

    def _add_objectives(self, functions: tuple[str, ...]) -> None:
        super()._add_objectives(functions)
        self._decide()

    def _decide(self) -> None:
        """Decide, if it is at events: now, or when the decision under way is executed."""
        if self._is_event_driven:
            self._is_due = True
            if not self._is_deciding:
                self._is_deciding = True
                self.system.env.process(self._deciding())

    def _deciding(self) -> AdaptationProcess:
        while self._is_due:
            self._is_due = False
            if (adaptation := self.adapt()) is not None:
                yield from adaptation
        self._is_deciding = False


@cache
def table_manager(file: str) -> type[ManagingSubsystem]:
    """Make the class of the manager `table:FILE.csv`."""
    return _named("TableManager", f"table:{file}")


def _named(kind: str, name: str) -> type[ManagingSubsystem]:
    own = {
        "name": name,
        "depends_on": Metacontrol.depends_on,  # only the class that defines it is asked
        "subscribes_to": property(attrgetter("_subscribes_to")),
        "__doc__": f"{name}: decides as the rows of a table say.",
    }
    return type(kind, (TableManager,), own)


Rosa = _named("Rosa", "rosa")
Planta = _named("Planta", "planta")


def opened(path: Path, settings: Mapping[str, object]) -> DecisionTable:
    """Read a table, once for all missions as long as it is the same.

    Raises:
        InputError: as read_table.
    """
    found = path.stat()
    return _opened(path, found.st_mtime_ns, found.st_size, yaml.safe_dump(dict(settings)))


@lru_cache(maxsize=8)
def _opened(path: Path, mtime_ns: int, size: int, settings: str) -> DecisionTable:
    return read_table(path, yaml.safe_load(settings))


def _check_names(table: DecisionTable, loaded: LoadedScenario) -> None:
    """Check that a scenario has what a table names."""
    modes = loaded.modes

    def check(word: str, known: Iterable[str], line: int, problem: str) -> None:
        if word not in known:
            raise line_error(table.path, line, problem, did_you_mean(word, known))

    for function, designs in table.designs.items():
        for design, line in designs.items():
            check(function, modes.functions, line, f"there is no function {shown(function)}")
            choices = [*modes.modes(function), STAYS, NONE_LEFT]
            check(design, choices, line, f"{function} has no mode {shown(design)}")
    for component, statuses in table.components.items():
        for status, line in statuses.items():
            there_is_none = f"there is no component {shown(component)}"
            check(component, REPORTED_STATUSES, line, there_is_none)
            reported = REPORTED_STATUSES[component]
            check(status, reported, line, f"{component} never reports {shown(status)}")
    known = sorted({*loaded.scenario.signals, WATER_VISIBILITY, BATTERY_LEVEL})
    columns = product(loaded.scenario.needed_functions(), ("_now", "_then"))
    for name in table.attributes:
        if name not in known:
            problem = f"nothing measures {shown(name)}, nor does it end in _now or _then"
            remedy = did_you_mean(name, [*known, *map("".join, columns)], "columns")
            raise InputError(problem, file=table.path, remedy=remedy)


def _states(
    table: DecisionTable, function: str, loaded: LoadedScenario
) -> Iterator[KnowledgeState]:
    """Yield the states of missions on which the decision on a function can depend."""
    values = [_values(scale, name, loaded) for name, scale in table.attributes.items()]
    for task in _tasks(loaded):
        if function not in task:
            continue
        needed = list(filter(task.__contains__, table.related(function)))
        designs = [(None, *table.designs.get(name, ())) for name in needed]
        objectives = [ObjectiveState(name, UNGROUNDED) for name in needed]
        reported = _reports(table, loaded) if table.counts_reports else [()]
        for measured, reports, now in product(product(*values), reported, product(*designs)):
            yield KnowledgeState.of(
                objectives,
                groundings=_given(needed, now),
                components=dict(reports),
                measurements=_given(table.attributes, measured),
            )


def _given(names: Iterable[str], values: Iterable[_Value | None]) -> dict[str, _Value]:
    """Return the values by name that are not None."""
    pairs = zip(names, values, strict=True)
    return {name: value for name, value in pairs if value is not None}


def _tasks(loaded: LoadedScenario) -> list[tuple[str, ...]]:
    """Functions that missions need together: at launch, in each task, and after a leak."""
    scenario = loaded.scenario
    own = scenario.mission.functions
    launch = scenario.revision.metacontrol.objectives_at_launch
    after = [(SURFACE,)] if scenario.leak is not None else []
    tasks = (
        (MAINTAIN_MOTION, GENERATE_SEARCH_PATH, *own.search_pipeline),
        (MAINTAIN_MOTION, FOLLOW_PIPELINE, *own.inspect_pipeline),
        launch,
    )
    return [*((*own.mission_wide, *each) for each in tasks), *after]


def _values(scale: Scale, attribute: str, loaded: LoadedScenario) -> list[Decimal | None]:
    """A value at each place of an attribute that is measured, and None."""
    is_measured = attribute in measured_attributes(loaded.scenario)
    return [scale.value(place) for place in range(len(scale) if is_measured else 1)]


def _reports(table: DecisionTable, loaded: LoadedScenario) -> Iterator[Reports]:
    """Yield what components can report: once a thruster has failed, recovering makes each
    report.
    """
    events = loaded.scenario.thruster_events
    failing = [THRUSTER_NAMES[each.thruster - 1] for each in events if each.event == "failure"]
    groups = _groups(table.settings.interchangeable)
    every = component_reports(groups, (FAILED, RECOVERED), len(THRUSTER_NAMES) if events else 0)
    for reports in every:
        failed = [name for name, status in reports if status == FAILED]
        if all(len({*failed} & {*group}) <= len({*failing} & {*group}) for group in groups):
            yield reports
            if loaded.scenario.leak is not None:
                yield *reports, (HULL, LEAK)


def _groups(interchangeable: Iterable[Iterable[str]]) -> list[tuple[str, ...]]:
    """Return the thrusters in groups of interchangeable ones; any other is one by itself."""
    groups = [tuple(filter(THRUSTER_NAMES.__contains__, each)) for each in interchangeable]
    grouped = set(chain.from_iterable(groups))
    return [*groups, *((name,) for name in THRUSTER_NAMES if name not in grouped)]
