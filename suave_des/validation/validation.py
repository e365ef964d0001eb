"""Compare simulated missions with published ones: samples, pairs of managers, clusters, and targets for all of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from suave_des.estimates import Estimate, Interval, estimate
from suave_des.report.compared_metrics import KNOWN
from suave_des.report.statistics import SIGNIFICANCE, Sample, difference_interval
from suave_des.streams import Streams
from suave_des.validation.conditions import (
    CONDITION,
    ConditionComparison,
    ConditionSummary,
    balanced,
    compare_conditions,
    summarise,
)
from suave_des.validation.shares import (
    ConditionLimits,
    DetectionPlace,
    Share,
    ShareComparison,
    compare_places,
    compare_shares,
    found_shares,
)
from suave_des.validation.statistics import (
    OneSidedTests,
    SampleTest,
    agreement,
    anderson_darling,
    conclude,
    kolmogorov_smirnov,
    ratio_interval,
    superiority,
)

if TYPE_CHECKING:
    import pandas

COMPARED = ("search_time_s", "distance_inspected_m", "mean_reaction_time_s")
"""Metrics that are compared where both sides have values."""
_LEAST_AGREEMENT = 0.5

_Generators = Callable[[str], np.random.Generator]
"""Makes the random generator of each use of chance, by a name of its own: no result depends on the others."""


@dataclass(frozen=True, slots=True)
class SampleComparison:
    """A metric of one manager, published and simulated.

    Attributes:
        manager: managing subsystem.
        metric: one of COMPARED.
        published: estimates from the published sample, with 95% intervals.
        simulated: estimates from the simulated sample.
        difference: simulated - published mean, in the metric's unit.
        difference_interval: its 95% interval by Welch's t; none for a sample of one.
        std_ratio: simulated / published standard deviation; none where either is missing or the latter is zero.
        std_ratio_interval: its 95% bootstrap interval; none likewise.
        kolmogorov_smirnov: two-sample test.
        anderson_darling: two-sample test, with permutation p; none for a sample of one.
    """

    manager: str
    metric: str
    published: Estimate
    simulated: Estimate
    difference: float
    difference_interval: Interval | None
    std_ratio: float | None
    std_ratio_interval: Interval | None
    kolmogorov_smirnov: SampleTest
    anderson_darling: SampleTest | None


@dataclass(frozen=True, slots=True)
class ManagerComparison:
    """Two managers compared by one metric, published and simulated.

    Attributes:
        first: the one manager.
        second: the other.
        metric: one of COMPARED.
        published_superiority: probability that a published mission of the first is better than one of the second.
        simulated_superiority: the same of simulated missions.
        published: tests of the published runs, which lead to a conclusion.
        sizes: published missions of the two.
        agreement: share of random subsamples of the simulation, of these sizes, that lead to the same conclusion; none
            if the simulation has fewer missions.
    """

    first: str
    second: str
    metric: str
    published_superiority: float
    simulated_superiority: float
    published: OneSidedTests
    sizes: tuple[int, int]
    agreement: float | None

    @property
    def better(self) -> str | None:
        """The manager that the published runs show to be better; none if they show neither."""
        return {1: self.first, -1: self.second, 0: None}[self.published.sign]


@dataclass(frozen=True, slots=True)
class Target:
    """A requirement on the simulation.

    Attributes:
        kind: mean, std, ks, conclusion, share, condition_median or condition_std.
        subject: the manager, the pair as "first, second", or "all" managers.
        what: metric, or name of the share.
        value: what the simulation has; none if there are too few missions for it.
        low: least value that is good enough; none: no limit.
        high: greatest value that is good enough; none: no limit.
    """

    kind: str
    subject: str
    what: str
    value: float | None
    low: float | None
    high: float | None

    @property
    def met(self) -> bool | None:
        """Whether the value is good enough; none if there is none to judge."""
        if self.value is None:
            return None
        return (self.low is None or self.value >= self.low) and (self.high is None or self.value <= self.high)


@dataclass(frozen=True)
class Validation:
    """The result of a comparison.

    Attributes:
        managers: compared, in the order given.
        samples: every metric and manager.
        pairs: every metric and pair of managers.
        shares: clusters and other regions.
        places: places of detection.
        targets: requirements, and whether they are met.
        conditions: every metric, manager and condition, where conditions are known; else empty.
        condition_summaries: of those, by metric and manager.
        not_found_s: search time that counts for missions that never found the pipeline; none if there are none.
    """

    managers: tuple[str, ...]
    samples: tuple[SampleComparison, ...]
    pairs: tuple[ManagerComparison, ...]
    shares: tuple[ShareComparison, ...]
    places: tuple[DetectionPlace, ...]
    targets: tuple[Target, ...]
    conditions: tuple[ConditionComparison, ...] = ()
    condition_summaries: tuple[ConditionSummary, ...] = ()
    not_found_s: float | None = None

    @property
    def all_met(self) -> bool:
        """Whether every target is met; one that cannot be judged is not."""
        return all(target.met for target in self.targets)


def validate(
    published: pandas.DataFrame,
    simulated: pandas.DataFrame,
    managers: Sequence[str],
    *,
    shares: Sequence[Share] = (),
    limits: Mapping[str, ConditionLimits] = MappingProxyType({}),
    seed: int = 1,
) -> Validation:
    """Compare simulated missions with published ones; the result depends on nothing but the arguments.

    Where both have a column `condition`, a manager's missions are compared condition by condition, too, and simulated
    ones are left out as needed for the conditions to have the same proportions on both sides.

    Example:
        real = read_runs("my_real_runs.csv")
        found = validate(real.frame, read_runs("results/runs.csv").frame, tuple(real.managers))
        print([target for target in found.targets if not target.met])

    Args:
        published: a row for each mission, with the columns of report.runs.COLUMNS.
        simulated: the same, in any number; further columns do not matter.
        managers: those to compare; each must have missions on both sides.
        shares: regions to count.
        limits: targets by metric for what is compared condition by condition.
        seed: of bootstrap, permutations and subsamples.

    Raises:
        InputError: a condition has real missions of a manager, and no simulated one.
    """
    streams = Streams(seed, 0)

    def generators(name: str) -> np.random.Generator:
        return np.random.default_rng(streams.stream(f"validation/{name}").getrandbits(128))

    if CONDITION in published and CONDITION in simulated:
        simulated = balanced(published, simulated, managers)
    sides = published, simulated = tuple(side[side["manager"].isin(managers)] for side in (published, simulated))
    not_found_s = common_limit(*sides)
    sides = published, simulated = tuple(with_limit(side, not_found_s) for side in sides)
    cells = [(metric, manager) for metric in COMPARED for manager in managers if _has_values(sides, manager, metric)]
    samples = tuple(_compare_samples(manager, metric, sides, generators) for metric, manager in cells)
    pairs = tuple(
        _compare_managers(pair, metric, sides, generators)
        for metric in COMPARED
        for pair in combinations([manager for each, manager in cells if each == metric], 2)
    )
    counted = compare_shares(shares, published, simulated, managers)
    conditions = compare_conditions(published, simulated, managers, COMPARED)
    summaries = tuple(summarise(conditions))
    targets = (
        *_sample_targets(samples),
        *_pair_targets(pairs),
        *_share_targets(counted),
        *_condition_targets(summaries, limits),
    )
    places = compare_places(published, simulated, managers)
    counted += found_shares(published, simulated, managers)
    return Validation(tuple(managers), samples, pairs, counted, places, targets, conditions, summaries, not_found_s)


def common_limit(*sides: pandas.DataFrame) -> float | None:
    """Return one search time for all missions that are known not to have found the pipeline; none if there are none.

    Programs write different numbers for them, such as 250 and 251 s with a limit of 250 s, which a test of
    distributions would take for a difference. It is the median of those numbers on the last side that has some, but
    at least as great as every search time with success.
    """
    not_found = [side.loc[~_found(side), "search_time_s"] for side in sides]
    numbers = next((each for each in reversed(not_found) if len(each)), None)
    if numbers is None:
        return None
    return max(float(numbers.median()), *(float(side.loc[_found(side), "search_time_s"].max()) for side in sides))


def with_limit(runs: pandas.DataFrame, limit_s: float | None) -> pandas.DataFrame:
    """Return missions with the same search time for all that are known not to have found the pipeline."""
    if limit_s is None:
        return runs
    return runs.assign(search_time_s=runs["search_time_s"].where(_found(runs), limit_s))


def _found(runs: pandas.DataFrame) -> pandas.Series[bool]:
    """Whether missions found the pipeline, or may have."""
    return runs["pipeline_found"].astype("boolean").fillna(True).astype(bool)


def _has_values(sides: Sequence[pandas.DataFrame], manager: str, metric: str) -> bool:
    return all(len(sample(side, manager, metric)) for side in sides)


def sample(runs: pandas.DataFrame, manager: str, metric: str) -> Sample:
    """Return a manager's values of a metric, shape (n,); missions without one are left out."""
    return runs.loc[runs["manager"] == manager, metric].dropna().to_numpy(dtype=float)


def _compare_samples(
    manager: str, metric: str, sides: Sequence[pandas.DataFrame], generators: _Generators
) -> SampleComparison:
    published, simulated = (sample(side, manager, metric) for side in sides)
    theirs, ours = estimate(published.tolist()), estimate(simulated.tolist())
    assert theirs.mean is not None and ours.mean is not None
    rng = generators(f"bootstrap/{manager}/{metric}")
    return SampleComparison(
        manager,
        metric,
        theirs,
        ours,
        ours.mean - theirs.mean,
        difference_interval(simulated, published).interval,
        ours.std / theirs.std if ours.std is not None and theirs.std else None,
        ratio_interval(published, simulated, rng),
        kolmogorov_smirnov(published, simulated),
        anderson_darling(published, simulated, generators(f"permutations/{manager}/{metric}")),
    )


def _compare_managers(
    pair: tuple[str, str], metric: str, sides: Sequence[pandas.DataFrame], generators: _Generators
) -> ManagerComparison:
    lower = KNOWN[metric].better < 0  # as the exemplar's own one-sided tests have it
    theirs, ours = ((sample(side, pair[0], metric), sample(side, pair[1], metric)) for side in sides)
    tests = conclude(*theirs, lower_is_better=lower)
    sizes = len(theirs[0]), len(theirs[1])
    rng = generators(f"subsamples/{pair[0]}/{pair[1]}/{metric}")
    return ManagerComparison(
        *pair,
        metric,
        superiority(*theirs, lower_is_better=lower),
        superiority(*ours, lower_is_better=lower),
        tests,
        sizes,
        agreement(tests.sign, ours, sizes, rng, lower_is_better=lower),
    )


def _sample_targets(samples: Sequence[SampleComparison]) -> Iterator[Target]:
    """The mean in the 95% t interval of the published one, the std in its chi-square interval, and the KS p."""
    for each in samples:
        for kind, value, interval in (
            ("mean", each.simulated.mean, each.published.mean_interval),
            ("std", each.simulated.std, each.published.std_interval),
        ):
            low, high = interval or (None, None)
            yield Target(kind, each.manager, each.metric, None if interval is None else value, low, high)
        yield Target("ks", each.manager, each.metric, each.kolmogorov_smirnov.p, SIGNIFICANCE, None)


def _pair_targets(pairs: Sequence[ManagerComparison]) -> Iterator[Target]:
    """At least half the subsamples as large as the published samples lead to the published conclusion."""
    for pair in pairs:
        subject = f"{pair.first}, {pair.second}"
        yield Target("conclusion", subject, pair.metric, pair.agreement, _LEAST_AGREEMENT, None)


def _share_targets(shares: Sequence[ShareComparison]) -> Iterator[Target]:
    for each in shares:
        if each.share.target is not None:
            yield Target("share", each.share.manager, each.share.name, each.simulated.share, *each.share.target)


def _condition_targets(
    summaries: Sequence[ConditionSummary], limits: Mapping[str, ConditionLimits]
) -> Iterator[Target]:
    for each in summaries:
        limit = limits.get(each.metric)
        if each.manager == "all" and limit is not None:
            for kind, value, high in (
                ("condition_median", each.difference, limit.median_difference),
                ("condition_std", each.std_ratio, limit.std_ratio),
            ):
                if high is not None:
                    yield Target(kind, each.manager, each.metric, value, None, high)
