"""What a validation leaves on disk: tables as CSV, everything as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

from suave_des.validation.comparison import Cell, Pair
from suave_des.validation.shares import Counted, Position, ShareComparison
from suave_des.validation.statistics import Interval
from suave_des.validation.targets import Target
from suave_des.validation.validation import Validation

CELLS_FILE, PAIRS_FILE = "validation.csv", "validation_pairs.csv"
SHARES_FILE, POSITIONS_FILE = "validation_shares.csv", "validation_positions.csv"
TARGETS_FILE, JSON_FILE = "validation_targets.csv", "validation.json"
DISTRIBUTIONS_FIGURE, DETECTIONS_FIGURE = "distributions.png", "detections.png"
FILES = (
    CELLS_FILE,
    PAIRS_FILE,
    SHARES_FILE,
    POSITIONS_FILE,
    TARGETS_FILE,
    JSON_FILE,
    DISTRIBUTIONS_FIGURE,
    DETECTIONS_FIGURE,
)
"""All files of a validation."""

_SIGNIFICANT_DIGITS = 8

Record = dict[str, Any]
"""A row of a table: plain values by column, numbers rounded, none for what cannot be had."""


def records(validation: Validation) -> dict[str, list[Record]]:
    """Every table of the validation, by its name in validation.json."""
    return {
        "cells": [_rounded(_cell(cell)) for cell in validation.cells],
        "pairs": [_rounded(_pair(pair)) for pair in validation.pairs],
        "shares": [_rounded(_share(share)) for share in validation.shares],
        "positions": [_rounded(_position(position)) for position in validation.positions],
        "targets": [_rounded(_target(target)) for target in validation.targets],
    }


def texts(validation: Validation, provenance: Mapping[str, Any]) -> dict[str, str]:
    """Content of each text file, by its name.

    Args:
        validation: what was found.
        provenance: from what; goes into the JSON file.
    """
    tables = records(validation)
    met = [target.met for target in validation.targets]
    summary = {"met": met.count(True), "not_met": met.count(False), "not_judged": met.count(None)}
    content = {"provenance": dict(provenance), "targets_summary": summary, **tables}
    return {
        CELLS_FILE: _csv(tables["cells"]),
        PAIRS_FILE: _csv(tables["pairs"]),
        SHARES_FILE: _csv(tables["shares"]),
        POSITIONS_FILE: _csv(tables["positions"]),
        TARGETS_FILE: _csv(tables["targets"]),
        JSON_FILE: json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n",
    }


def _csv(rows: Sequence[Record]) -> str:
    import pandas

    return pandas.DataFrame(rows).to_csv(index=False, lineterminator="\n") if rows else ""


def _rounded(record: Record) -> Record:
    return {column: _cell_value(value) for column, value in record.items()}


def _cell_value(value: Any) -> Any:
    if not isinstance(value, float):
        return value
    # Eight digits hide the last ones, in which machines differ; p values of 1e-12 keep theirs.
    return float(f"{value:.{_SIGNIFICANT_DIGITS}g}") if math.isfinite(value) else None


def _interval(name: str, interval: Interval | None) -> Record:
    low, high = interval or (None, None)
    return {f"{name}_ci95_low": low, f"{name}_ci95_high": high}


def _cell(cell: Cell) -> Record:
    return {
        "manager": cell.manager,
        "metric": cell.metric,
        "published_n": cell.published.n,
        "published_mean": cell.published.mean,
        **_interval("published_mean", cell.published.mean_interval),
        "published_std": cell.published.std,
        **_interval("published_std", cell.published.std_interval),
        "published_median": cell.published.median,
        "simulated_n": cell.simulated.n,
        "simulated_mean": cell.simulated.mean,
        **_interval("simulated_mean", cell.simulated.mean_interval),
        "simulated_std": cell.simulated.std,
        "simulated_median": cell.simulated.median,
        "difference_of_means": cell.difference,
        **_interval("difference_of_means", cell.difference_interval),
        "std_ratio": cell.std_ratio,
        **_interval("std_ratio", cell.std_ratio_interval),
        "ks_distance": cell.kolmogorov_smirnov.distance,
        "ks_p": cell.kolmogorov_smirnov.p,
        "ad_statistic": cell.anderson_darling.statistic,
        "ad_p": cell.anderson_darling.p,
    }


def _pair(pair: Pair) -> Record:
    return {
        "first": pair.first,
        "second": pair.second,
        "metric": pair.metric,
        "published_superiority": pair.published_superiority,
        "simulated_superiority": pair.simulated_superiority,
        "published_first_better_p": pair.published.first_better_p,
        "published_second_better_p": pair.published.second_better_p,
        "published_better": pair.better or "neither",
        "first_n": pair.sizes[0],
        "second_n": pair.sizes[1],
        "agreement": pair.agreement,
    }


def _counted(side: str, counted: Counted) -> Record:
    return {
        f"{side}_count": counted.count,
        f"{side}_n": counted.n,
        f"{side}_share": counted.share,
        **_interval(f"{side}_share", counted.interval),
    }


def _share(compared: ShareComparison) -> Record:
    low, high = compared.share.target or (None, None)
    return {
        "manager": compared.share.manager,
        "name": compared.share.name,
        **_counted("published", compared.published),
        **_counted("simulated", compared.simulated),
        "target_low": low,
        "target_high": high,
    }


def _position(position: Position) -> Record:
    return {
        "manager": position.manager,
        "detection_x_m": position.detection_x_m,
        **_counted("published", position.published),
        **_counted("simulated", position.simulated),
    }


def _target(target: Target) -> Record:
    return {
        "kind": target.kind,
        "subject": target.subject,
        "what": target.what,
        "value": target.value,
        "low": target.low,
        "high": target.high,
        "met": target.met,
    }
