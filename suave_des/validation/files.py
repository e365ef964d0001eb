"""Write a validation to disk: tables as CSV, everything as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict

from suave_des.estimates import Interval
from suave_des.validation.shares import Proportion
from suave_des.validation.validation import ManagerComparison, SampleComparison, Validation

TABLES = {
    "cells": "validation.csv",
    "pairs": "validation_pairs.csv",
    "shares": "validation_shares.csv",
    "positions": "validation_positions.csv",
    "targets": "validation_targets.csv",
}
"""Names of the tables in the JSON file, and their files."""
JSON_FILE, DISTRIBUTIONS_FIGURE, DETECTIONS_FIGURE = "validation.json", "distributions.png", "detections.png"
FILES = (*TABLES.values(), JSON_FILE, DISTRIBUTIONS_FIGURE, DETECTIONS_FIGURE)
"""All files of a validation."""

_SIGNIFICANT_DIGITS = 8

Record = dict[str, object]
"""A row of a table by column; missing values are none."""


def texts(validation: Validation, provenance: Mapping[str, object]) -> dict[str, str]:
    """Write each text file, by its name.

    Args:
        validation: what was found.
        provenance: from what; goes into the JSON file.
    """
    import pandas

    tables = {name: [_rounded(row) for row in rows] for name, rows in _tables(validation).items()}
    met = [target.met for target in validation.targets]
    summary = {"met": met.count(True), "not_met": met.count(False), "not_judged": met.count(None)}
    content = {"provenance": dict(provenance), "targets_summary": summary, **tables}
    files = {
        file: pandas.DataFrame(tables[name]).to_csv(index=False, lineterminator="\n") if tables[name] else ""
        for name, file in TABLES.items()
    }
    return {**files, JSON_FILE: json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"}


def _tables(validation: Validation) -> dict[str, list[Record]]:
    return {
        "cells": [_sample(each) for each in validation.samples],
        "pairs": [_pair(each) for each in validation.pairs],
        "shares": [
            {
                "manager": each.share.manager,
                "name": each.share.name,
                **_proportion("published", each.published),
                **_proportion("simulated", each.simulated),
                **_ends("target", each.share.target, "low", "high"),
            }
            for each in validation.shares
        ],
        "positions": [
            {
                "manager": each.manager,
                "detection_x_m": each.detection_x_m,
                **_proportion("published", each.published),
                **_proportion("simulated", each.simulated),
            }
            for each in validation.places
        ],
        "targets": [{**asdict(target), "met": target.met} for target in validation.targets],
    }


def _sample(compared: SampleComparison) -> Record:
    published, simulated = compared.published, compared.simulated
    return {
        "manager": compared.manager,
        "metric": compared.metric,
        "published_n": published.n,
        "published_mean": published.mean,
        **_ends("published_mean", published.mean_interval),
        "published_std": published.std,
        **_ends("published_std", published.std_interval),
        "published_median": published.median,
        "simulated_n": simulated.n,
        "simulated_mean": simulated.mean,
        **_ends("simulated_mean", simulated.mean_interval),
        "simulated_std": simulated.std,
        "simulated_median": simulated.median,
        "difference_of_means": compared.difference,
        **_ends("difference_of_means", compared.difference_interval),
        "std_ratio": compared.std_ratio,
        **_ends("std_ratio", compared.std_ratio_interval),
        "ks_distance": compared.kolmogorov_smirnov.statistic,
        "ks_p": compared.kolmogorov_smirnov.p,
        "ad_statistic": None if compared.anderson_darling is None else compared.anderson_darling.statistic,
        "ad_p": None if compared.anderson_darling is None else compared.anderson_darling.p,
    }


def _pair(pair: ManagerComparison) -> Record:
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


def _proportion(side: str, found: Proportion) -> Record:
    share = {f"{side}_count": found.count, f"{side}_n": found.n, f"{side}_share": found.share}
    return {**share, **_ends(f"{side}_share", found.interval)}


def _ends(name: str, interval: Interval | None, low: str = "ci95_low", high: str = "ci95_high") -> Record:
    ends = interval or (None, None)
    return {f"{name}_{low}": ends[0], f"{name}_{high}": ends[1]}


def _rounded(record: Record) -> Record:
    """Round to eight digits, which hides the last ones, in which machines differ; p values of 1e-12 keep theirs."""
    return {
        column: (float(f"{value:.{_SIGNIFICANT_DIGITS}g}") if math.isfinite(value) else None)
        if isinstance(value, float)
        else value
        for column, value in record.items()
    }
