"""The conclusions of a comparison, in sentences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from suave_des.errors import number_of
from suave_des.estimates import interval_text
from suave_des.report.compared_metrics import FOUND, ComparedMetric
from suave_des.report.statistics import FISHER, MANN_WHITNEY, MCNEMAR, WILCOXON

if TYPE_CHECKING:
    from suave_des.report.compare import Difference


_MOST_SENTENCES = 3
"""Of a metric of which neither more nor less is better, in the conclusion from all differences."""


def conclusion(found: Difference, metric: ComparedMetric) -> str:
    """Write the conclusion from one difference.

    The test is one of ranks, the difference one of means: what only one of them shows is not said of the other.
    """
    if found.difference is None or found.tested is None or found.p_holm is None:
        return f"{found.first} and {found.second} cannot be compared in {metric.title}: one of them has no value."
    test = f"{_basis(found)}, {p_text(found.p_holm)}"
    if not found.is_significant:
        text = f"No difference in {metric.title} is shown between {found.first} and {found.second}"
        if found.difference.interval is not None and not _contains_0(found):
            text += " by the test, though the interval of the mean, which is not corrected, does not contain 0"
        return f"{text} ({_mean_of(found, metric)}{_interval(found, metric)}{test})."
    ranks = _direction_of_ranks(found)
    if ranks and _contains_0(found):
        return (
            f"By ranks, {_rank_claim(found, metric, ranks)} ({test.removeprefix('; ')}), but no"
            f" difference of the means is shown ({_mean_of(found, metric)}{_interval(found, metric)})."
        )
    claim = difference_claim(found, metric)
    evidence = f"{_interval(found, metric)}{test}"
    if ranks * found.difference.value < 0.0:
        greater = found.first if ranks > 0 else found.second
        return (
            f"{claim} on average, yet {greater} has the greater value in most comparisons of single runs ({evidence}):"
            " the distributions differ in shape, so look at them."
        )
    return f"{claim} ({evidence})."


def _rank_claim(found: Difference, metric: ComparedMetric, ranks: float) -> str:
    """Write which manager mostly has more or less in single runs, the better one first."""
    greater, less = (found.first, found.second) if ranks > 0.0 else (found.second, found.first)
    if metric.better < 0:
        return f"{less} {metric.less.format('mostly')} {greater}"
    if metric.better > 0:
        return f"{greater} {metric.more.format('mostly')} {less}"
    return f"{greater} mostly exceeds {less} in {metric.title}"


def _mean_of(found: Difference, metric: ComparedMetric) -> str:
    """Write the difference with its sign, and with what it is the difference of."""
    assert found.difference is not None
    return f"{found.first} - {found.second}: {metric.amount(found.difference.value)}, "


def _contains_0(found: Difference) -> bool:
    """Whether the interval of the difference contains 0; there is none where all runs differ by the same."""
    assert found.difference is not None
    interval = found.difference.interval
    return interval is not None and interval[0] <= 0.0 <= interval[1]


def _is_claimed(found: Difference) -> bool:
    """Whether a difference of the means may be claimed."""
    return found.is_significant and not (_contains_0(found) and _direction_of_ranks(found))


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
        return " ".join(each.conclusion or conclusion(each, metric) for each in own[:_MOST_SENTENCES])
    best = max(known, key=lambda name: metric.better * known[name])
    against = [each for each in own if best in (each.first, each.second)]
    shown = [each for each in against if _is_claimed(each) and _favours(each, best, metric)]
    open_ones = [_other(each, best) for each in against if not each.is_significant]
    others = [conclusion(each, metric) for each in against if each.is_significant and each not in shown]
    sentences = []
    if shown:
        sentences.append(_claims(best, metric, shown, open_ones))
    elif open_ones:
        has_best = "has" if list(known.values()).count(known[best]) == 1 else "has, with others,"
        is_shown = f"No difference in {metric.title} is shown between {best}, which {has_best} the best mean,"
        sentences.append(f"{is_shown} and {_listed(open_ones)}.")
    return " ".join([*sentences, *others])


def _favours(found: Difference, name: str, metric: ComparedMetric) -> bool:
    """Whether a group is the better one in the runs that are compared, which need not be all that have a mean."""
    assert found.difference is not None
    sign = 1.0 if found.first == name else -1.0
    return sign * metric.better * found.difference.value > 0.0


def _claims(best: str, metric: ComparedMetric, shown: Sequence[Difference], open_ones: Sequence[str]) -> str:
    """Write by how much the best is better than those from which it differs, and from which it does not."""
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
    if found.difference.value < 0.0 and _is_claimed(found):
        low, high = -high, -low
    scale, decimals = (100.0, 1) if metric.name == FOUND else (1.0, metric.decimals)
    return f"95% interval {interval_text((scale * low, scale * high), f'.{decimals}f')}"


def _basis(found: Difference) -> str:
    names = {WILCOXON: "Wilcoxon", MANN_WHITNEY: "Mann-Whitney", FISHER: "Fisher", MCNEMAR: "McNemar"}
    assert found.tested is not None
    pairing = number_of(found.n[0], "pair") if found.pairing.is_paired else "not paired"
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
