"""The figures of the paper's table.

Source: G. Rezende Silva, J. Päßler, J. Zwanepol, E. Alberts, S. L. Tapia Tarifa, I. Gerostathopoulos, E. B. Johnsen,
C. Hernández Corbato, "SUAVE: An Exemplar for Self-Adaptive Underwater Vehicles", SEAMS 2023 (arXiv:2303.09220): means
and sample standard deviations of 20 runs for each manager. The runs themselves are in analysis/data/seams2023_runs.csv.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from suave_des.estimates import Estimate, estimate_of

MANAGERS = ("none", "random", "metacontrol")
METRICS = ("search_time_s", "distance_inspected_m")

_RUNS = 20
_TABLE = {
    ("none", "search_time_s"): (187.85, 42.40),
    ("none", "distance_inspected_m"): (31.40, 13.00),
    ("random", "search_time_s"): (180.15, 82.05),
    ("random", "distance_inspected_m"): (3.88, 3.19),
    ("metacontrol", "search_time_s"): (106.95, 39.46),
    ("metacontrol", "distance_inspected_m"): (51.15, 12.01),
}

Figures = Mapping[tuple[str, str], Estimate]
"""What is known of a metric, by (manager, metric)."""


def published() -> Figures:
    """The table's figures by (manager, metric); medians are not in it."""
    return MappingProxyType({cell: estimate_of(_RUNS, mean, std) for cell, (mean, std) in _TABLE.items()})
