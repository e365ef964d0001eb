"""How much each rule is worth: metacontrol with every rule of the ontologies, and with one of them
switched off.

The same runs are made with each set of rules, so that differences are the rule's own. A rule that
concludes nothing in these missions, such as those of the quality attributes energy and safety,
gives no difference at all.

    python analysis/rule_worth.py [--out DIR] [--runs N] [--workers N]
"""

from __future__ import annotations

import pandas
import studies
from matplotlib.figure import Figure

from suave_des import KnowledgeBase

SCENARIO = "seams2023"


def rules() -> list[str]:
    """Return the names of the rules in the scenario's ontologies."""
    return [rule.name for rule in KnowledgeBase.load(scenario=SCENARIO).base.rules if rule.enabled]


def study(runs: int, workers: int, chosen: list[str] | None = None) -> pandas.DataFrame:
    """Switch off one rule after the other; a row for each rule and metric: without it less with
    all.
    """
    with_all = studies.missions(SCENARIO, ["metacontrol"], runs, workers)
    rows = []
    for rule in rules() if chosen is None else chosen:
        without = studies.missions(SCENARIO, ["metacontrol"], runs, workers, disabled_rules=[rule])
        found = {
            "found_with_all": with_all["pipeline_found"].mean(),
            "found_without": without["pipeline_found"].mean(),
        }
        for metric in studies.METRICS:
            ours, theirs = studies.by_run(without, metric), studies.by_run(with_all, metric)
            means = {"with_all": theirs.mean(), "without": ours.mean()}
            rows.append(
                {"rule": rule, "metric": metric, **means, **found, **studies.paired(ours, theirs)}
            )
    return pandas.DataFrame(rows)


def ranked(rows: pandas.DataFrame) -> list[str]:
    """Return the rules by how much their absence changes the distance, the one that changes most
    first.
    """
    distances = (
        rows[rows["metric"] == "distance_inspected_m"].set_index("rule")["mean_difference"].abs()
    )
    return list(distances.sort_values(ascending=False, kind="stable").index)


def draw(figure: Figure, rows: pandas.DataFrame) -> None:
    """Draw a panel for each metric: the difference that each rule's absence makes."""
    order = ranked(rows)[::-1]
    for panel, metric, own in studies.metric_panels(figure, rows, sharey=True):
        in_order = own.set_index("rule").loc[order]
        studies.draw_intervals(panel, in_order, range(len(order)), across=True)
        panel.axvline(0.0, color="0.5", lw=0.8)
        panel.set_yticks(range(len(order)), order)
        panel.set_xlabel(f"without the rule - with all:\n{studies.METRICS[metric]}")


def conclude(rows: pandas.DataFrame) -> str:
    """Say which rules missions depend on."""
    table = rows.set_index(["rule", "metric"])
    order = ranked(rows)
    counting = [
        rule for rule in order if (table.loc[rule, "with_all"] != table.loc[rule, "without"]).any()
    ]
    sentences = []
    for rule in counting:
        time, distance = (
            table.loc[(rule, metric)] for metric in ("search_time_s", "distance_inspected_m")
        )
        sentences.append(
            f"- Without {rule}: search time {studies.shown(time)}, distance {studies.shown(distance, 'm', 1)}, and"
            f" {time['found_without']:.0%} in place of {time['found_with_all']:.0%} find the pipeline."
        )
    idle = ", ".join(rule for rule in order if rule not in counting)
    return "\n".join([*sentences, f"- Without one of {idle}, the missions are the same."])


def main() -> None:
    """Run metacontrol with each rule switched off, write the table and the figure."""
    chosen = studies.options(__file__, __doc__ or "", runs=60)
    rows = study(chosen.runs, chosen.workers)
    studies.write(chosen, "rule_worth", rows, draw, conclude, height=3.4)


if __name__ == "__main__":
    main()
