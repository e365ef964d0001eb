"""Validation of simulated missions against published ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from suave_des.streams import Streams
from suave_des.validation.comparison import Cell, Pair, compare_cells, compare_pairs
from suave_des.validation.shares import Position, Share, ShareComparison, compare_positions, compare_shares
from suave_des.validation.targets import Target, targets

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True)
class Validation:
    """What a comparison found.

    Attributes:
        managers: compared, in the order given.
        cells: every metric and manager.
        pairs: every metric and pair of managers.
        shares: clusters and other regions.
        positions: places of detection.
        targets: demands, and whether they are met.
    """

    managers: tuple[str, ...]
    cells: tuple[Cell, ...]
    pairs: tuple[Pair, ...]
    shares: tuple[ShareComparison, ...]
    positions: tuple[Position, ...]
    targets: tuple[Target, ...]

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
    seed: int = 1,
) -> Validation:
    """Compare simulated missions with published ones.

    The result depends on nothing but the arguments; missions may come in any number on each side.

    Args:
        published: a row a mission, with the columns of runs.COLUMNS.
        simulated: the same; further columns do no harm.
        managers: those to compare; each must have missions on both sides.
        shares: regions to count.
        seed: of bootstrap, permutations and subsamples.
    """
    streams = Streams(seed, 0)

    def generator(name: str) -> np.random.Generator:
        return np.random.default_rng(streams.stream(f"validation/{name}").getrandbits(128))

    cells = compare_cells(published, simulated, managers, generator)
    pairs = compare_pairs(published, simulated, managers, generator)
    counted = compare_shares(shares, published, simulated, managers)
    positions = compare_positions(published, simulated, managers)
    return Validation(tuple(managers), cells, pairs, counted, positions, targets(cells, pairs, counted))
