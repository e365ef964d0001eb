"""What a simulation must reach to count as faithful, and whether it does."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from suave_des.validation.comparison import Cell, Pair
from suave_des.validation.shares import ShareComparison
from suave_des.validation.statistics import SIGNIFICANCE

_LEAST_AGREEMENT = 0.5


@dataclass(frozen=True, slots=True)
class Target:
    """One demand on the simulation.

    Attributes:
        kind: mean, std, ks, conclusion or share.
        subject: the manager, or the pair as "first, second".
        what: metric, or name of the share.
        value: what the simulation has; none if it cannot be had from so few missions.
        low: least value that will do; none: no limit.
        high: greatest value that will do; none: no limit.
    """

    kind: str
    subject: str
    what: str
    value: float | None
    low: float | None
    high: float | None

    @property
    def met(self) -> bool | None:
        """Whether the value will do; none if there is none to judge."""
        if self.value is None:
            return None
        return (self.low is None or self.value >= self.low) and (self.high is None or self.value <= self.high)


def targets(cells: Sequence[Cell], pairs: Sequence[Pair], shares: Sequence[ShareComparison]) -> tuple[Target, ...]:
    """All demands: on each cell, on each pair, and on those shares that have a target.

    The mean must lie in the 95% t interval of the published one, the standard deviation in its 95% chi-square interval,
    the Kolmogorov-Smirnov p must not be below 0.05, and at least half the subsamples as large as the published samples
    must lead to the published conclusion.
    """
    return (*_of_cells(cells), *_of_pairs(pairs), *_of_shares(shares))


def _of_cells(cells: Sequence[Cell]) -> Iterator[Target]:
    for cell in cells:
        for kind, value, interval in (
            ("mean", cell.simulated.mean, cell.published.mean_interval),
            ("std", cell.simulated.std, cell.published.std_interval),
        ):
            low, high = interval or (None, None)
            yield Target(kind, cell.manager, cell.metric, None if interval is None else value, low, high)
        yield Target("ks", cell.manager, cell.metric, cell.kolmogorov_smirnov.p, SIGNIFICANCE, None)


def _of_pairs(pairs: Sequence[Pair]) -> Iterator[Target]:
    for pair in pairs:
        subject = f"{pair.first}, {pair.second}"
        yield Target("conclusion", subject, pair.metric, pair.agreement, _LEAST_AGREEMENT, None)


def _of_shares(shares: Sequence[ShareComparison]) -> Iterator[Target]:
    for each in shares:
        if each.share.target is not None:
            yield Target("share", each.share.manager, each.share.name, each.simulated.share, *each.share.target)
