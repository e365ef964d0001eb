"""Results of a mission: its metrics, and, if it was recorded, its events, trajectory and states of
knowledge.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas

    from suave_des.knowledge.state import KnowledgeState


@dataclass(frozen=True, slots=True)
class Event:
    """An event of a mission's record."""

    t_s: float
    source: str
    event: str
    detail: str


@dataclass(frozen=True, slots=True)
class MissionMetrics:
    """One row of runs.csv.

    Attributes:
        run: number of the run, from 1; runs with the same number use common random numbers under
            all managers.
        initial_x_m: where the vehicle was put, world frame; likewise initial_y_m.
        mission_duration_s: mission time at the end.
        search_time_s: as the revision counts it; the time limit (rev 1.5: the duration) if not
            found.
        distance_inspected_m: as published last by the follow function.
        mean_reaction_time_s: mean of the completed reactions, none if there was none.
        adaptations: mode changes of functions in use.
        detection_time_s: exact mission time of the first sight, none if there was none.
        detection_x_m: x of the pipeline point seen first, none if there was none; likewise
            detection_y_m.
    """

    scenario: str
    manager: str
    run: int
    seed: int
    initial_x_m: float
    initial_y_m: float
    mission_duration_s: float
    pipeline_found: bool
    search_time_s: float
    distance_inspected_m: float
    mean_reaction_time_s: float | None
    adaptations: int
    detection_time_s: float | None
    detection_x_m: float | None
    detection_y_m: float | None


@dataclass(frozen=True, slots=True)
class TrajectoryPoint:
    """Where the vehicle was at a mission time, and under which mode; visibility as measured, none
    before that.

    What else was measured, such as battery_level, is in `further` by its column; of each point the
    same.
    """

    t_s: float
    x_m: float
    y_m: float
    z_m: float
    roll_rad: float
    pitch_rad: float
    yaw_rad: float
    mode: str
    visibility_m: float | None
    further: Mapping[str, float | None] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class KnowledgeRecord:
    """A KnowledgeState that was reasoned about at a mission time, and again until that of the next
    record.
    """

    t_s: float
    state: KnowledgeState


@dataclass(frozen=True)
class MissionResult:
    """A mission's metrics, with the record of how it went if that was asked for.

    Example:
        simulator = Simulator(load_scenario("seams2023"))
        result = simulator.run("metacontrol", run=1, seed=8, record=True)
        print(result.metrics.search_time_s, len(result.events))
    """

    metrics: MissionMetrics
    events: tuple[Event, ...] = ()
    trajectory: Sequence[TrajectoryPoint] = ()
    knowledge: tuple[KnowledgeRecord, ...] = ()
    drawn: dict[str, float] = field(default_factory=dict)
    """Values drawn for the scenario's distributions in this run, by key path."""
    further: dict[str, float | int | None] = field(default_factory=dict)
    """Further metrics and the satisfaction of requirements, if the scenario asks for them, by
    column.
    """
    remarks: tuple[str, ...] = ()
    """What the manager's author should know, such as a mode that was refused, or a name that
    nothing measures.
    """

    def __repr__(self) -> str:
        """Return the metrics as a table, and how much is recorded."""
        metrics = self.metrics
        title = f"{metrics.scenario}, {metrics.manager}, run {metrics.run}, seed {metrics.seed}"
        rows = (
            (each.name, getattr(metrics, each.name))
            for each in fields(metrics)
            if each.name not in _IN_TITLE
        )
        lines = [
            f"  {name:<22} {f'{value:.6g}' if isinstance(value, float) else value}"
            for name, value in rows
        ]
        parts = {
            "events": self.events,
            "points": self.trajectory,
            "states of knowledge": self.knowledge,
        }
        recorded = ", ".join(f"{len(part)} {what}" for what, part in parts.items() if part)
        return "\n".join([title, *lines, f"  recorded: {recorded or 'nothing'}"])

    def events_frame(self) -> pandas.DataFrame:
        """Return the events as a data frame with the columns of events.csv."""
        return _frame(Event, self.events)

    def trajectory_frame(self) -> pandas.DataFrame:
        """Return the trajectory as a data frame with the columns of trajectory.csv."""
        frame = _frame(TrajectoryPoint, self.trajectory)
        further = [dict(each) for each in frame.pop("further")]
        return frame.assign(
            **{name: [each[name] for each in further] for name in (further[0] if further else {})}
        )


_IN_TITLE = ("scenario", "manager", "run", "seed")


def _frame(
    kind: type[Event] | type[TrajectoryPoint], entries: Sequence[Event] | Sequence[TrajectoryPoint]
) -> pandas.DataFrame:
    import pandas

    names = [each.name for each in fields(kind)]
    return pandas.DataFrame(
        [[getattr(entry, name) for name in names] for entry in entries], columns=names
    )
