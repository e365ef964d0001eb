r"""All managers in the experiment of 2025, beside the means of the published runs.

    suave-des campaign planta_exp1_campaign --managers none,random,metacontrol,bt,rosa,planta \
        --runs 1667 --out managers_exp1
    python analysis/managers/exp1.py managers_exp1

Means are over the six conditions, with half their 95% intervals: normal, of independent missions
within each condition. Published means are of 30 runs, five in each condition.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pandas

from suave_des import find

_CONDITION = "start.y_m"
_METRICS = {"search_time_s": "search time, s", "distance_inspected_m": "distance, m"}


def table(runs: pandas.DataFrame, published: pandas.DataFrame) -> str:
    """Tabulate missions of a campaign beside published ones, in Markdown."""
    rows = []
    for manager, missions in runs.groupby("manager", sort=False):
        theirs = published[published["manager"] == manager]
        cells = [str(manager), f"{len(missions):,}"]
        for metric in _METRICS:
            groups = missions.groupby(_CONDITION)[metric]
            half = 1.96 * (groups.var() / groups.count()).sum() ** 0.5 / len(groups)
            cells.append(f"{groups.mean().mean():.2f} ± {half:.2f}")
            cells.append(f"{theirs[metric].mean():.1f}" if len(theirs) else "not here")
        rows.append(cells)
    headings = [each for name in _METRICS.values() for each in (name, "published")]
    lines = [["manager", "missions", *headings], ["---", *["---:"] * (len(headings) + 1)], *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


if __name__ == "__main__":
    missions = pandas.read_csv(Path(sys.argv[1]) / "runs.csv")
    print(table(missions, pandas.read_csv(find("planta_exp1_runs", "scenarios/published"))))
