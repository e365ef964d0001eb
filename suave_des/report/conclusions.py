"""The conclusions of a comparison, in sentences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from suave_des.estimates import interval_text
from suave_des.report.compared_metrics import FOUND, ComparedMetric
from suave_des.report.statistics import FISHER, MANN_WHITNEY, MCNEMAR, WILCOXON

if TYPE_CHECKING:
    from suave_des.report.compare import Difference


def conclusion(found: Difference, metric: ComparedMetric) -> str:
    """Write the conclusion from one difference."""
    if found.difference is None or found.tested is None or found.p_holm is None:
        return f"{found.first} and {found.second} cannot be compared in {metric.title}: one of them has no value."
    evidence = f"{_interval(found, metric)}{_basis(found)}, {p_text(found.p_holm)}"
    if not found.is_significant:
        return f"No difference in {metric.title} is shown between {found.first} and {found.second} ({evidence})."
    claim = difference_claim(found, metric)
    ranks = _direction_of_ranks(found)
    if ranks * found.difference.value < 0.0:
        greater = found.first if ranks > 0 else found.second
        return (
            f"{claim} on average, yet {greater} has the greater value in most comparisons of single runs ({evidence}):"
            " the distributions differ in shape, so look at them."
        )
    return f"{claim} ({evidence})."


def difference_claim(found: Difference, metric: ComparedMetric) -> str:
    """Write which manager has more or less, the better one first."""
    assert found.difference is not None
    value = found.difference.value
    first, second = found.first, found.second
    if value * (metric.better or 1) < 0.0:
        first, second, value = second, first, -value
    phrase = metric.more if value > 0.0 else metric.less
    if not phrase:
        more = "greater" if value > 0.0 else "less"
        phrase = f"has a {metric.title} {{}} {more} than"
    return f"{first} {phrase.format(metric.amount(abs(value)))} {second}"


def overall_conclusion(
    metric: ComparedMetric,
    differences: Sequence[Difference],
    means: Mapping[tuple[str, str], float],
    groups: Sequence[str],
) -> str:
    """Write the conclusion for the first metric: which manager is best, by how much, and whether it is significant."""
    known = {name: means[name, metric.name] for name in groups if (name, metric.name) in means}
    own = [each for each in differences if each.metric == metric.name and each.difference is not None]
    if len(groups) < 2:
        return f"There is only {groups[0]}, so there is nothing to compare it with."
    if not own or len(known) < 2:
        return f"No two of them have a {metric.title} that could be compared."
    if not metric.better:
        return " ".join(each.conclusion or conclusion(each, metric) for each in own[:1])
    best = max(known, key=lambda name: metric.better * known[name])
    against = [each for each in own if best in (each.first, each.second)]
    shown = [each for each in against if each.is_significant]
    open_ones = [_other(each, best) for each in against if not each.is_significant]
    if not shown:
        rest = _listed(open_ones)
        return f"No difference in {metric.title} is shown between {best}, which has the best mean, and {rest}."
    parts = []
    for each in shown:
        assert each.difference is not None
        _, _, words = (metric.less if metric.better < 0 else metric.more).partition("{}")
        amount = metric.amount(abs(each.difference.value))
        parts.append(f"{amount}{words} {_other(each, best)} ({_interval(each, metric)}{_basis(each)})")
    sentence = f"{best} {metric.most}: {_listed(parts)}"
    largest = p_text(max(each.p_holm or 0.0 for each in shown))
    if len(shown) > 1:
        largest = f"all {largest}" if "<" in largest else f"largest {largest}"
    sentence += f"; {largest} after Holm's correction"
    if open_ones:
        sentence += f"; no difference is shown to {_listed(open_ones)}"
    return f"{sentence}."


def _other(found: Difference, name: str) -> str:
    return found.second if found.first == name else found.first


def _listed(parts: Sequence[str]) -> str:
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"


def _interval(found: Difference, metric: ComparedMetric) -> str:
    """Write the interval of a difference's size, in the direction in which the sentence speaks."""
    assert found.difference is not None
    if found.difference.interval is None:
        return "no interval"
    low, high = found.difference.interval
    if found.difference.value < 0.0 and found.is_significant:
        low, high = -high, -low
    scale, decimals = (100.0, 1) if metric.name == FOUND else (1.0, metric.decimals)
    return f"95% interval {interval_text((scale * low, scale * high), f'.{decimals}f')}"


def _basis(found: Difference) -> str:
    names = {WILCOXON: "Wilcoxon", MANN_WHITNEY: "Mann-Whitney", FISHER: "Fisher", MCNEMAR: "McNemar"}
    assert found.tested is not None
    pairing = f"{found.n[0]} pairs" if found.pairing.is_paired else "not paired"
    return f"; {pairing}, {names[found.tested.name]}"


def p_text(p: float) -> str:
    """Write a p-value for a sentence."""
    if p < 0.001:
        return "p < 0.001"
    return f"p = {p:.3f}" if p < 0.1 else f"p = {p:.2f}"


def _direction_of_ranks(found: Difference) -> float:
    """Return the sign of the effect: 1 if the first has the greater values."""
    assert found.tested is not None
    effect = found.tested.effect
    if effect is None:
        return 0.0
    return effect - 0.5 if found.tested.name == MANN_WHITNEY else effect
