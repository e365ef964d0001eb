"""What a change of ontologies or rules is worth: the same missions with each of two knowledge bases."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from suave_des.campaign.campaign import run_campaign
from suave_des.campaign.progress import OnProgress
from suave_des.errors import InputError
from suave_des.report.statistics import mean_interval
from suave_des.scenario.loader import Replacements

if TYPE_CHECKING:
    import pandas

    from suave_des.estimates import Interval

#: What is compared, with words for it.
METRICS: Final = {"search_time_s": "search time, s", "distance_inspected_m": "distance, m"}
_MANAGER: Final = "metacontrol"


@dataclass(frozen=True)
class PairedDifference:
    """One metric of the same missions under two knowledge bases.

    Attributes:
        metric: column of runs.csv.
        one, other: means.
        difference: mean of other - one, run by run.
        interval: its 95% interval (BCa bootstrap); None where no mission differs, or there is one.
        changed: number of missions in which the metric differs.
    """

    metric: str
    one: float
    other: float
    difference: float
    interval: Interval | None
    changed: int


@dataclass(frozen=True)
class MissionDifference:
    """Missions under two knowledge bases, with common random numbers.

    Attributes:
        missions: number of pairs.
        changed: run numbers of the missions in which any column of runs.csv differs.
        metrics: what differs on average.
        extremes: (run, metric, value with one, value with the other): the largest change each way of each metric.
    """

    missions: int
    changed: tuple[int, ...]
    metrics: tuple[PairedDifference, ...]
    extremes: tuple[tuple[int, str, float, float], ...]

    def lines(self) -> Iterator[str]:
        """Which missions change most, as `kb diff` prints it below its table."""
        for run, metric, before, after in self.extremes:
            name, _, unit = METRICS[metric].partition(", ")
            yield f"  run {run}: {name} {before:.1f} {unit} -> {after:.1f} {unit}"


@dataclass(frozen=True)
class MissionsToCompare:
    """Which missions to run.

    Attributes:
        scenario: name or path.
        runs: number of missions with each knowledge base.
        seed: of everything that is random.
        workers: processes.
    """

    scenario: str
    runs: int
    seed: int = 1
    workers: int = 1


def compare_missions(
    missions: MissionsToCompare, one: Replacements, other: Replacements, on_progress: OnProgress | None = None
) -> MissionDifference:
    """Run the same missions with two knowledge bases, and compare them pair by pair.

    Args:
        missions: which.
        one, other: ontologies, rules and values of the scenario, as load_scenario takes them.
        on_progress: called when missions are done.

    Raises:
        InputError: something cannot be used, or missions fail.
    """
    frames = []
    for replacements in (one, other):
        result = run_campaign(
            missions.scenario,
            [_MANAGER],
            missions.runs,
            missions.seed,
            missions.workers,
            on_progress=on_progress,
            ontologies=replacements.get("ontologies", ()),
            rules=replacements.get("rules", ()),
            disabled_rules=replacements.get("disabled_rules", ()),
            values=replacements.get("values", {}),
        )
        frames.append(result.frame().set_index("run"))
    before, after = frames
    runs = before.index.intersection(after.index)
    if len(runs) < missions.runs:
        raise InputError(
            f"{missions.runs - len(runs)} of {missions.runs} missions fail",
            remedy="suave-des campaign with the same files says why",
        )
    return _compared(before.loc[runs], after.loc[runs])


def _compared(before: pandas.DataFrame, after: pandas.DataFrame) -> MissionDifference:
    differs = (before.ne(after) & ~(before.isna() & after.isna())).any(axis=1)
    metrics = []
    extremes: dict[tuple[int, str], tuple[int, str, float, float]] = {}
    for name in METRICS:
        x, y = before[name].to_numpy(float), after[name].to_numpy(float)
        change = y - x
        estimated = mean_interval(change)
        metrics.append(
            PairedDifference(
                name,
                float(x.mean()),
                float(y.mean()),
                estimated.value,
                estimated.interval,
                int(np.count_nonzero(change)),
            )
        )
        for place in (int(change.argmin()), int(change.argmax())):
            if change[place]:
                run = int(before.index[place])
                extremes[run, name] = (run, name, float(x[place]), float(y[place]))
    return MissionDifference(
        len(before), tuple(int(run) for run in before.index[differs]), tuple(metrics), tuple(extremes.values())
    )
