"""Write a validation to disk: tables as CSV, everything as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict

from suave_des.estimates import Estimate, interval_columns
from suave_des.validation.conditions import ConditionComparison
from suave_des.validation.shares import DetectionPlace, ShareComparison
from suave_des.validation.validation import ManagerComparison, SampleComparison, Validation

TABLES = {
    "cells": "validation.csv",
    "pairs": "validation_pairs.csv",
    "shares": "validation_shares.csv",
    "positions": "validation_positions.csv",
    "conditions": "validation_conditions.csv",
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
    """Write each text file, by its name; the JSON file says from what the validation comes (provenance)."""
    import pandas

    tables = {name: [_rounded(row) for row in rows] for name, rows in _tables(validation).items()}
    met = [target.met for target in validation.targets]
    summary = {"met": met.count(True), "not_met": met.count(False), "not_judged": met.count(None)}
    content = {
        "provenance": dict(provenance),
        "targets_summary": summary,
        "not_found_counts_as_s": validation.not_found_s,
        **tables,
    }
    files = {
        file: pandas.DataFrame(tables[name]).to_csv(index=False, lineterminator="\n") if tables[name] else ""
        for name, file in TABLES.items()
        if tables[name] or name != "conditions"
    }
    return {**files, JSON_FILE: json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"}


def _tables(validation: Validation) -> dict[str, list[Record]]:
    return {
        "cells": [_sample(each) for each in validation.samples],
        "pairs": [_pair(each) for each in validation.pairs],
        "shares": [
            {"manager": each.share.manager, "name": each.share.name}
            | _proportions(each)
            | dict(zip(("target_low", "target_high"), each.share.target or (None, None), strict=True))
            for each in validation.shares
        ],
        "positions": [
            {"manager": each.manager, "detection_x_m": each.detection_x_m} | _proportions(each)
            for each in validation.places
        ],
        "conditions": [_condition(each) for each in validation.conditions],
        "targets": [asdict(target) | {"met": target.met} for target in validation.targets],
    }


def _sample(compared: SampleComparison) -> Record:
    simulated = _estimate("simulated", compared.simulated)
    del simulated["simulated_std_ci95_low"], simulated["simulated_std_ci95_high"]  # so narrow that nothing needs them
    ks, ad = compared.kolmogorov_smirnov, compared.anderson_darling
    return {
        "manager": compared.manager,
        "metric": compared.metric,
        **_estimate("published", compared.published),
        **simulated,
        "difference_of_means": compared.difference,
        **interval_columns("difference_of_means", compared.difference_interval),
        "std_ratio": compared.std_ratio,
        **interval_columns("std_ratio", compared.std_ratio_interval),
        "ks_distance": ks.statistic,
        "ks_p": ks.p,
        "ad_statistic": ad and ad.statistic,
        "ad_p": ad and ad.p,
    }


def _condition(compared: ConditionComparison) -> Record:
    row: Record = {name: getattr(compared, name) for name in ("manager", "metric", "condition")}
    for side, found in (("real", compared.real), ("simulated", compared.simulated)):
        row |= {f"{side}_{name}": getattr(found, name) for name in ("n", "mean", "std", "median")}
    return {**row, "difference_of_medians": compared.difference}


def _estimate(side: str, found: Estimate) -> Record:
    return {
        f"{side}_n": found.n,
        f"{side}_mean": found.mean,
        **interval_columns(f"{side}_mean", found.mean_interval),
        f"{side}_std": found.std,
        **interval_columns(f"{side}_std", found.std_interval),
        f"{side}_median": found.median,
    }


def _pair(pair: ManagerComparison) -> Record:
    row = {f"published_{name}": value for name, value in asdict(pair.published).items()}
    return {
        **{name: getattr(pair, name) for name in ("first", "second", "metric")},
        **{name: getattr(pair, name) for name in ("published_superiority", "simulated_superiority")},
        **row,
        "published_better": pair.better or "neither",
        "first_n": pair.sizes[0],
        "second_n": pair.sizes[1],
        "agreement": pair.agreement,
    }


def _proportions(compared: ShareComparison | DetectionPlace) -> Record:
    row: Record = {}
    for side, found in (("published", compared.published), ("simulated", compared.simulated)):
        row |= {f"{side}_count": found.count, f"{side}_n": found.n, f"{side}_share": found.share}
        row |= interval_columns(f"{side}_share", found.interval)
    return row


def _rounded(record: Record) -> Record:
    """Round to eight digits, which hides the last ones, in which machines differ; p values of 1e-12 keep theirs."""
    return {
        column: (float(f"{value:.{_SIGNIFICANT_DIGITS}g}") if math.isfinite(value) else None)
        if isinstance(value, float)
        else value
        for column, value in record.items()
    }
