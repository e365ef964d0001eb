"""The points of a sweep: which values its parameters take together.

They follow from the campaign's seed and the number of the point, so that any worker finds the same.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any

from suave_des.streams import Streams

METHODS = ("latin_hypercube", "sobol")
SOBOL_DIMENSIONS = 21_201
"""Dimensions for which scipy has direction numbers of Sobol's sequence."""


@dataclass(frozen=True)
class Sample:
    """A sampled design: points that fill a box evenly.

    Attributes:
        method: one of METHODS.
        points: how many; for sobol a power of 2, as its balance needs.
        ranges: smallest and greatest value by key path.
    """

    method: str
    points: int
    ranges: Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class Sweep:
    """Every combination of a grid's values, the rows of a zip, and the points of a sampled design.

    Points are counted from 0; what is named last changes fastest.

    Attributes:
        grid: values by key path; each is combined with each.
        zipped: values by key path, equally many of each: the first go together, the second, and so on.
        sample: a sampled design, or none.
        seed: the campaign's, for the sampled design.
    """

    grid: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    zipped: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    sample: Sample | None = None
    seed: int = 0

    @property
    def parameters(self) -> tuple[str, ...]:
        """Key paths of the parameters that are swept, as given."""
        return (*self.grid, *self.zipped, *(self.sample.ranges if self.sample else ()))

    @property
    def points(self) -> int:
        """Number of points; 1 if nothing is swept."""
        return math.prod(self._sizes())

    def values(self, point: int) -> dict[str, Any]:
        """Return the value of each parameter at a point."""
        places = []
        for size in reversed(self._sizes()):
            point, place = divmod(point, size)
            places.append(place)
        *grid, row, sampled = reversed(places)
        values = {path: self.grid[path][place] for path, place in zip(self.grid, grid, strict=True)}
        values |= {path: column[row] for path, column in self.zipped.items()}
        if self.sample is not None:
            values |= dict(zip(self.sample.ranges, self._sampled[sampled], strict=True))
        return values

    def each_value(self) -> Iterator[int]:
        """Yield points that have, between them, each value of the grid and each row of the zip."""
        sizes = self._sizes()
        for place, size in enumerate(sizes):
            stride = math.prod(sizes[place + 1 :])
            yield from range(0, size * stride, stride)

    def plain(self) -> dict[str, Any]:
        """Return it as plain data, without parts that are not used."""
        plain = {"grid": dict(self.grid), "zip": dict(self.zipped), "sample": self.sample and asdict(self.sample)}
        return {form: content for form, content in plain.items() if content}

    def _sizes(self) -> tuple[int, ...]:
        rows = len(next(iter(self.zipped.values()))) if self.zipped else 1
        return (*map(len, self.grid.values()), rows, self.sample.points if self.sample else 1)

    @cached_property
    def _sampled(self) -> list[list[float]]:
        import numpy as np
        from scipy.stats import qmc  # takes half a second to import

        assert self.sample is not None
        engines = {"latin_hypercube": qmc.LatinHypercube, "sobol": qmc.Sobol}
        bits = np.random.PCG64(Streams(self.seed, 0).stream("sweep").getrandbits(64))
        engine = engines[self.sample.method](d=len(self.sample.ranges), rng=np.random.Generator(bits))
        low, high = np.array(list(self.sample.ranges.values())).T
        rows: list[list[float]] = (low + engine.random(self.sample.points) * (high - low)).tolist()
        return rows


def cell_of(value: Any) -> str | int | float | bool | None:
    """Return a parameter's value as in runs.csv: lists and mappings as JSON."""
    return value if value is None or isinstance(value, str | int | float | bool) else json.dumps(value)
