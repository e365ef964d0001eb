"""The conclusions of a comparison, in sentences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from suave_des.errors import number_of
from suave_des.records.metrics import Metric
from suave_des.results.comparison import Difference
from suave_des.results.statistics import FISHER, MANN_WHITNEY, MCNEMAR, WILCOXON

_MOST_SENTENCES = 3
"""Of a metric of which neither more nor less is better, in the conclusion from all differences."""
_SHORT = {WILCOXON: "Wilcoxon", MANN_WHITNEY: "Mann-Whitney", FISHER: "Fisher", MCNEMAR: "McNemar"}
_OPEN = "the interval of the mean, which is not corrected for the number of tests, does not contain 0"


def conclusion(found: Difference, metric: Metric) -> str:
    """Write the conclusion from one difference.

    The test is one of ranks, the difference one of means: what only one of them shows is not said of the other.
    """
    if not found.test:
        return f"{found.group} and {found.other} cannot be compared in {metric.title}: one of them has no value."
    test = f"{_basis(found)}, {p_text(found.p_holm)}"
    interval = _interval(found, metric)
    mean = f"{found.group} - {found.other}: {metric.amount(found.difference.value)}, {interval}"
    if found.is_equal:
        return f"{found.group} and {found.other} have the same {metric.title} in all {number_of(found.n, 'pair')}."
    if not found.is_significant:
        text = f"No difference in {metric.title} is shown between {found.group} and {found.other}"
        if _is_open(found):
            text += f" by the test, though {_OPEN}"
        return f"{text} ({mean}{test})."
    ranks = _direction_of_ranks(found)
    if ranks and found.difference.contains(0.0):
        claim = _rank_claim(found, metric, ranks)
        return f"By ranks, {claim} ({test.removeprefix('; ')}), but no difference of the means is shown ({mean})."
    claim = difference_claim(found, metric)
    if ranks * found.difference.value < 0.0:
        greater = found.group if ranks > 0 else found.other
        return (
            f"{claim} on average, yet {greater} has the greater value in most comparisons of single runs"
            f" ({interval}{test}): the distributions differ in shape, so look at them."
        )
    return f"{claim} ({interval}{test})."


def _rank_claim(found: Difference, metric: Metric, ranks: float) -> str:
    """Write which manager mostly has more or less in single runs, the better one first."""
    greater, less = (found.group, found.other) if ranks > 0.0 else (found.other, found.group)
    if metric.better < 0:
        return f"{less} {metric.less.format('mostly')} {greater}"
    if metric.better > 0:
        return f"{greater} {metric.more.format('mostly')} {less}"
    return f"{greater} mostly exceeds {less} in {metric.title}"


def _is_open(found: Difference) -> bool:
    """Whether the interval of the mean shows a difference, and the corrected test does not."""
    return not found.is_significant and found.difference.has_interval and not found.difference.contains(0.0)


def _is_claimed(found: Difference) -> bool:
    """Whether a difference of the means may be claimed."""
    return found.is_significant and not (found.difference.contains(0.0) and _direction_of_ranks(found))


def difference_claim(found: Difference, metric: Metric) -> str:
    """Write which manager has more or less, the better one first."""
    value, first, second = found.difference.value, found.group, found.other
    if value * (metric.better or 1) < 0.0:
        first, second, value = second, first, -value
    phrase = metric.more if value > 0.0 else metric.less
    if not phrase:
        phrase = f"has {{}} {'more' if value > 0.0 else 'less'} {metric.title} than"
    return f"{first} {phrase.format(metric.amount(abs(value)))} {second}"


def overall_conclusion(
    metric: Metric, differences: Sequence[Difference], means: Mapping[str, float], groups: Sequence[str]
) -> str:
    """Write the conclusion for the first metric: which manager is best, by how much, and whether it is significant.

    Args:
        metric: the first one.
        differences: of all metrics and groups, with their conclusions.
        means: of this metric, by group, where they are known.
        groups: names of those that it is about.
    """
    among = set(groups)
    own = [
        each for each in differences if each.metric == metric.name and each.test and {each.group, each.other} <= among
    ]
    if len(groups) < 2:
        return f"There is only {groups[0]}, so there is nothing to compare it with."
    if not own or len(means) < 2:
        return f"No two of them have a {metric.title} that could be compared."
    if not metric.better:
        return " ".join(each.conclusion for each in own[:_MOST_SENTENCES])
    best = max(means, key=lambda name: metric.better * means[name])
    against = [each for each in own if best in (each.group, each.other)]
    shown = [each for each in against if _is_claimed(each) and _favours(each, best, metric)]
    open_ones = [_not_shown(each, best) for each in against if not each.is_significant]
    tests = sum(1 for each in differences if each.test)
    sentences = []
    if shown:
        sentences.append(_claims(best, metric, shown, open_ones, tests))
    elif open_ones:
        has_best = "has" if list(means.values()).count(means[best]) == 1 else "has, with others,"
        is_shown = f"No difference in {metric.title} is shown between {best}, which {has_best} the best mean,"
        sentences.append(f"{is_shown} and {_and(open_ones)}.")
        if any(map(_is_open, against)):
            sentences[-1] = (
                f"{sentences[-1].removesuffix('.')}, after Holm's correction over {number_of(tests, 'test')}."
            )
    others = [each.conclusion for each in against if each.is_significant and each not in shown]
    return " ".join([*sentences, *others])


def _favours(found: Difference, name: str, metric: Metric) -> bool:
    """Whether a group is the better one in the runs that are compared, which need not be all that have a mean."""
    return (1.0 if found.group == name else -1.0) * metric.better * found.difference.value > 0.0


def _not_shown(found: Difference, best: str) -> str:
    """Name the other one, and what speaks for a difference, or that there is none at all."""
    if found.is_equal:
        return f"{_other(found, best)} (equal in all {number_of(found.n, 'pair')})"
    return f"{_other(found, best)} ({_OPEN})" if _is_open(found) else _other(found, best)


def _claims(best: str, metric: Metric, shown: Sequence[Difference], open_ones: Sequence[str], tests: int) -> str:
    """Write by how much the best is better than those from which it differs, and from which it does not."""
    _, _, words = (metric.less if metric.better < 0 else metric.more).partition("{}")
    parts = [
        f"{metric.amount(abs(each.difference.value))}{words} {_other(each, best)}"
        f" ({_interval(each, metric)}{_basis(each)})"
        for each in shown
    ]
    largest = p_text(max(each.p_holm for each in shown))
    if len(shown) > 1:
        largest = f"all {largest}" if "<" in largest else f"largest {largest}"
    over = f" after Holm's correction over {tests} tests" if tests > 1 else ""
    sentence = f"{best} {metric.most}: {_and(parts)}; {largest}{over}"
    return f"{sentence}; no difference is shown to {_and(open_ones)}." if open_ones else f"{sentence}."


def _other(found: Difference, name: str) -> str:
    return found.other if found.group == name else found.group


def _and(parts: Sequence[str]) -> str:
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"


def _interval(found: Difference, metric: Metric) -> str:
    """Write the interval of a difference's size, in the direction in which the sentence speaks."""
    if not found.difference.has_interval:
        return "no interval"
    is_turned = found.difference.value < 0.0 and _is_claimed(found)
    shown = -found.difference if is_turned else found.difference
    return f"95% interval {shown.text(f'.{metric.decimals}f', metric.scale)}"


def _basis(found: Difference) -> str:
    return f"; {number_of(found.n, 'pair') if found.paired else 'not paired'}, {_SHORT[found.test]}"


def p_text(p: float) -> str:
    """Write a p-value for a sentence."""
    if p < 0.001:
        return "p < 0.001"
    return f"p = {p:.3f}" if p < 0.1 else f"p = {p:.2f}"


def _direction_of_ranks(found: Difference) -> float:
    """Return the sign of the effect: above 0 if the first has the greater values, 0 if there is none."""
    effect = found.effect.value - 0.5 if found.test == MANN_WHITNEY else found.effect.value
    return effect if effect == effect else 0.0
