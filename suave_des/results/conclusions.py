"""What follows from estimates and tests, as sentences.

Means, ranks and pairs are three questions: how far apart the means are, whether one manager tends
to have greater values, and in how many pairs it has. Each has its own test and its own sentence,
and what one of them shows is not said of another.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from suave_des.errors import number_of
from suave_des.estimates import Estimate, percent
from suave_des.records.metrics import Metric
from suave_des.results.statistics import (
    FISHER,
    MANN_WHITNEY,
    MCNEMAR,
    SIGNIFICANCE,
    WILCOXON,
)
from suave_des.tables import TableRow

_SHORT = {WILCOXON: "Wilcoxon", MANN_WHITNEY: "Mann-Whitney", FISHER: "Fisher", MCNEMAR: "McNemar"}
_MOST_SENTENCES = 3
"""Of a metric of which neither more nor less is better, in the conclusion from all differences."""
_OPEN = "the interval, which is for this difference alone, excludes 0"


def conclusion(found: TableRow, metric: Metric) -> str:
    """Write what one difference shows: a sentence each for means, ranks and pairs."""
    group = found["group"]
    other = found["other"]
    if not found["test"]:
        why = "one of them has no value"
        return f"{group} and {other} cannot be compared in {metric.title}: {why}."
    if _is_equal(found):
        pairs = number_of(found["n"], "pair")
        return f"{group} and {other} have the same {metric.title} in all {pairs}."
    if _is_of_shares(found):
        return _sentence_of_means(found, metric)
    questions = (_sentence_of_means, _sentence_of_ranks, _sentence_of_pairs)
    sentences = [sentence(found, metric) for sentence in questions]
    direction = _direction_of_ranks(found) * found["difference"].value
    if _has_mean_shown(found) and _has_ranks_shown(found) and direction < 0.0:
        sentences.append("Means and ranks disagree: the distributions differ in shape.")
    return " ".join(sentences)


def difference_claim(first: str, second: str, value: float, metric: Metric) -> str:
    """Write which of two managers has more or less, the better one first; the value is first -
    second.
    """
    if value > 0.0:
        greater = first
        less = second
    else:
        greater = second
        less = first
    size = metric.amount(abs(value))
    if metric.better < 0:
        return f"{less} {metric.less.format(size)} {greater}"
    if metric.more:
        return f"{greater} {metric.more.format(size)} {less}"
    return f"{greater} has {size} more {metric.title} than {less}"


# One difference


def _sentence_of_means(found: TableRow, metric: Metric) -> str:
    group = found["group"]
    other = found["other"]
    apart = found["difference"]
    if math.isnan(apart.value):
        return f"The mean {_without_mean(metric)} of {group} and {other} cannot be compared, as no time limit is known."
    test = f"{_sizes(found)}, {_mean_test(found)}, {_p_text(_mean_p(found), found)}"
    if _has_mean_shown(found):
        claim = difference_claim(group, other, apart.value, metric)
        on_average = "" if _is_of_shares(found) else " on average"
        return f"{claim}{on_average} ({_interval(found, metric)}; {test})."
    signed = f"{group} - {other}: {metric.amount(apart.value)}, {_interval_text(apart, metric)}"
    what = f"the {metric.title}" if _is_of_shares(found) else f"the mean {_without_mean(metric)}"
    if _mean_p(found) < SIGNIFICANCE:
        return (
            f"The test shows a difference of {what} between {group} and {other}, but its interval contains 0"
            f" ({signed}; {test})."
        )
    if _is_open(found):
        return (
            f"No difference of {what} is shown between {group} and {other} by the test, though {_OPEN}"
            f" ({signed}; {test})."
        )
    return f"No difference of {what} is shown between {group} and {other} ({signed}; {test})."


def _sentence_of_ranks(found: TableRow, metric: Metric) -> str:
    group = found["group"]
    other = found["other"]
    test = f"{_SHORT[found['test']]}, {_p_text(found['p_holm'], found)}"
    if not _has_ranks_shown(found):
        return f"By ranks, no difference is shown ({test})."
    if _direction_of_ranks(found) > 0.0:
        greater = group
        less = other
    else:
        greater = other
        less = group
    if metric.better < 0:
        return f"By ranks, {less} {less_words(metric)} {greater} ({test})."
    return f"By ranks, {greater} {greater_words(metric)} {less} ({test})."


def _sentence_of_pairs(found: TableRow, metric: Metric) -> str:
    """Write in how many pairs, or comparisons of each mission with each, one has the better
    value.
    """
    first_wins, second_wins = _wins(found, metric)
    equal = 1.0 - first_wins - second_wins
    if found["paired"]:
        n = found["n"]
        of = number_of(n, "pair")
        first, second, rest = (f"{round(share * n)}" for share in (first_wins, second_wins, equal))
        is_any_equal = rest != "0"
        are = "is" if rest == "1" else "are"
    else:
        of = "all comparisons of one with the other"
        first, second, rest = map(percent, (first_wins, second_wins, equal))
        is_any_equal = equal > 1e-9
        are = "are"
    value = f"the {_better_word(metric)} {metric.title}"
    text = f"Of {of}, {found['group']} has {value} in {first}, {found['other']} in {second}"
    return f"{text}; {rest} {are} equal." if is_any_equal else f"{text}."


def _wins(found: TableRow, metric: Metric) -> tuple[float, float]:
    """Return in which shares of pairs or comparisons the first, and the second, has the better
    value.
    """
    if metric.better < 0:
        return found["share_less"], found["share_greater"]
    return found["share_greater"], found["share_less"]


def _better_word(metric: Metric) -> str:
    return "lower" if metric.better < 0 else "greater"


def less_words(metric: Metric) -> str:
    """Return what one with lower values does, such as "finds the pipeline sooner than"."""
    return _words(metric.less) or f"has less {metric.title} than"


def greater_words(metric: Metric) -> str:
    """Return what one with greater values does, such as "finds the pipeline later than"."""
    return _words(metric.more) or f"has more {metric.title} than"


def _words(phrase: str) -> str:
    return phrase.replace(" in {} ", " in ").replace("{} ", "")


def _without_mean(metric: Metric) -> str:
    return metric.title.removeprefix("mean ")


# What a difference shows


def _is_of_shares(found: TableRow) -> bool:
    """Return whether shares of missions are compared, of which there are neither ranks nor pairs
    with more or less.
    """
    return found["test"] in (FISHER, MCNEMAR)


def _is_equal(found: TableRow) -> bool:
    """Return whether the two have the same value in each pair."""
    apart = found["difference"]
    return bool(
        found["paired"] and found["n"] > 1 and apart.value == 0.0 and not apart.has_interval
    )


def _mean_p(found: TableRow) -> float:
    """Return the adjusted p of the difference of means, or of shares; nan if it is not known."""
    p = found["p_holm"] if _is_of_shares(found) else found.get("mean_p_holm")
    return math.nan if p is None else float(p)


def _has_mean_shown(found: TableRow) -> bool:
    """Return whether a difference of the means, or of shares, may be claimed."""
    return _mean_p(found) < SIGNIFICANCE and not found["difference"].contains(0.0)


def _has_ranks_shown(found: TableRow) -> bool:
    """Return whether a difference by ranks may be claimed."""
    return bool(found["p_holm"] < SIGNIFICANCE) and _direction_of_ranks(found) != 0.0


def _is_open(found: TableRow) -> bool:
    """Return whether the interval of the mean shows a difference, and the corrected test does
    not.
    """
    apart = found["difference"]
    return apart.has_interval and not apart.contains(0.0) and not _has_mean_shown(found)


def _direction_of_ranks(found: TableRow) -> float:
    """Return the sign of the effect: above 0 if the first has the greater values, 0 if there is
    none.
    """
    if found["effect"] is None:
        return 0.0
    no_effect = 0.5 if found["test"] == MANN_WHITNEY else 0.0
    return float(found["effect"]) - no_effect


# Parts of sentences


def _interval(found: TableRow, metric: Metric) -> str:
    """Write the interval of a difference's size, in the direction in which a claim speaks."""
    apart = found["difference"]
    return _interval_text(-apart if apart.value < 0.0 else apart, metric)


def _interval_text(apart: Estimate, metric: Metric) -> str:
    text = apart.text(f".{metric.decimals}f", metric.scale)
    return f"95% interval {text}" if text else "no interval"


def _sizes(found: TableRow) -> str:
    return number_of(found["n"], "pair") if found["paired"] else "not paired"


def _mean_test(found: TableRow) -> str:
    return _SHORT[found["test"]] if _is_of_shares(found) else str(found["mean_test"])


def _p_text(p: float, found: TableRow) -> str:
    return p_text(p, is_adjusted=found.get("tests", 1) > 1)


def p_text(p: float, *, is_adjusted: bool = False) -> str:
    """Write a p-value for a sentence; `is_adjusted`: for all tests together."""
    name = "adjusted p" if is_adjusted else "p"
    if math.isnan(p):
        return "p not known"
    if p < 0.001:
        return f"{name} < 0.001"
    return f"{name} = {p:.3f}" if p < 0.1 else f"{name} = {p:.2f}"


# All differences


def overall_conclusion(
    metric: Metric,
    differences: Sequence[TableRow],
    means: Mapping[str, float],
    groups: Sequence[str],
) -> str:
    """Write the conclusion for the first metric: which manager is best on average, by how much, and
    what ranks and pairs show of it.

    It is about the groups named, of which `means` has those that are known; differences are of all
    metrics and groups.
    """
    if len(groups) < 2:
        return f"There is only {groups[0]}, so there is nothing to compare it with."
    own = [each for each in differences if _is_about(each, metric, groups)]
    if not own:
        return f"No two of them have a {metric.title} that could be compared."
    if len(own) == 1 or not metric.better or len(means) < 2:
        return " ".join(each["conclusion"] for each in own[:_MOST_SENTENCES])
    return " ".join(_about_best(metric, own, means, len(groups) - 1))


def _about_best(
    metric: Metric, own: Sequence[TableRow], means: Mapping[str, float], others: int
) -> Iterator[str]:
    """Yield what means, ranks and pairs show of the best mean; of shares, means only."""
    best = max(means, key=lambda name: metric.better * means[name])
    against = [each for each in own if best in (each["group"], each["other"])]
    yield from _means_of_best(best, metric, against, means, others)
    ranked = [each for each in against if not _is_of_shares(each) and not _is_equal(each)]
    if ranked:
        yield _ranks_of_best(best, metric, ranked)
        yield _pairs_of_best(best, metric, ranked)


def _is_about(found: TableRow, metric: Metric, groups: Sequence[str]) -> bool:
    """Return whether a difference is tested, in this metric, and of two of these groups."""
    is_of_groups = {found["group"], found["other"]} <= set(groups)
    return bool(found["test"]) and found["metric"] == metric.name and is_of_groups


def _means_of_best(
    best: str, metric: Metric, against: Sequence[TableRow], means: Mapping[str, float], others: int
) -> list[str]:
    """Write how far the best mean is from the others, and whether that is shown.

    It is the best only if it is shown to be better than all others, of which there are so many.
    """
    better: list[TableRow] = []
    worse: list[TableRow] = []
    alike: list[TableRow] = []
    for each in against:
        if not _has_mean_shown(each):
            alike.append(each)
        elif _favours(each, best, metric):
            better.append(each)
        else:
            worse.append(each)
    sentences = [_sentence_of_means(each, metric) for each in worse]
    if better:
        is_best_of_all = len(better) == others
        return [_claim_of_best(best, metric, better, alike, is_best_of_all), *sentences]
    if alike:
        return [_claim_of_none(best, metric, alike, means), *sentences]
    return sentences


def _claim_of_best(
    best: str,
    metric: Metric,
    better: Sequence[TableRow],
    alike: Sequence[TableRow],
    is_best_of_all: bool,
) -> str:
    """Write by how much the best mean is better than those from which it differs."""
    amounts = _and(_amounts(best, metric, better))
    tests = " and ".join(dict.fromkeys(_mean_test(each) for each in better))
    test = f"{tests}, {_largest([_mean_p(each) for each in better], better[0])}"
    if not is_best_of_all:
        rest = _and([_not_shown(each, best) for each in alike]) if alike else ""
        no_others = f"; no difference of the means is shown to {rest}" if rest else ""
        verb = (metric.less if metric.better < 0 else metric.more).partition(" {}")[0]
        return f"On average, {best} {verb} {amounts}; {test}{no_others}."
    if _is_of_shares(better[0]):
        return f"{best} {metric.most}: {amounts}; {test}."
    return f"{best} {metric.most} on average: {amounts}; {test}."


def _claim_of_none(
    best: str, metric: Metric, alike: Sequence[TableRow], means: Mapping[str, float]
) -> str:
    """Write that the best mean is not shown to differ from others."""
    if list(means.values()).count(means[best]) > 1:
        has = "has, with others, the best mean"
    elif all(_favours(each, best, metric) for each in alike):
        has = "has the best mean"
    else:
        has = "has the best mean of all its runs"
    others = _and([_not_shown(each, best) for each in alike])
    return f"No difference of the mean {_without_mean(metric)} is shown between {best}, which {has}, and {others}."


def _ranks_of_best(best: str, metric: Metric, against: Sequence[TableRow]) -> str:
    """Write from which others the one with the best mean differs by ranks, and how."""
    less: list[TableRow] = []
    greater: list[TableRow] = []
    alike: list[TableRow] = []
    for each in against:
        if not _has_ranks_shown(each):
            alike.append(each)
        elif (_direction_of_ranks(each) > 0.0) == (each["group"] == best):
            greater.append(each)
        else:
            less.append(each)
    clauses = []
    if less:
        clauses.append(f"{best} {less_words(metric)} {_others(less, best)} ({_ps_of_ranks(less)})")
    if greater:
        words = greater_words(metric)
        clauses.append(f"{best} {words} {_others(greater, best)} ({_ps_of_ranks(greater)})")
    if alike:
        clauses.append(f"no difference is shown between {best} and {_others(alike, best)}")
    return f"By ranks, {'; '.join(clauses)}."


def _pairs_of_best(best: str, metric: Metric, against: Sequence[TableRow]) -> str:
    """Write in how many pairs the one with the best mean has the better value."""
    opposite = "higher" if metric.better < 0 else "smaller"
    parts = []
    for each in against:
        first_wins, second_wins = _wins(each, metric)
        if each["group"] == best:
            wins = first_wins
            losses = second_wins
        else:
            wins = second_wins
            losses = first_wins
        other = _other(each, best)
        if each["paired"]:
            n = each["n"]
            of = f"{round(wins * n)} of {number_of(n, 'pair')}"
            lost = f"{round(losses * n)}"
        else:
            of = f"{percent(wins)} of all comparisons"
            lost = percent(losses)
        parts.append(f"in {of} with {other} ({opposite} in {lost})")
    return f"{best} has the {_better_word(metric)} {metric.title} {_and(parts)}."


def _favours(found: TableRow, name: str, metric: Metric) -> bool:
    """Return whether a group is the better one in the runs that are compared, which need not be all
    that have a mean.
    """
    value = found["difference"].value
    advantage = value if found["group"] == name else -value
    return bool(metric.better * advantage > 0.0)


def _not_shown(found: TableRow, best: str) -> str:
    """Name the other one, and what speaks for a difference, or that there is none at all."""
    if _is_equal(found):
        return f"{_other(found, best)} (equal in all {number_of(found['n'], 'pair')})"
    if math.isnan(found["difference"].value):
        return f"{_other(found, best)} (means not known)"
    return f"{_other(found, best)} ({_OPEN})" if _is_open(found) else _other(found, best)


def _amounts(best: str, metric: Metric, better: Sequence[TableRow]) -> list[str]:
    """Write by how much the best is better than each."""
    _, _, words = (metric.less if metric.better < 0 else metric.more).partition("{}")
    return [
        f"{metric.amount(abs(each['difference'].value))}{words} {_other(each, best)} ({_interval(each, metric)})"
        for each in better
    ]


def _ps_of_ranks(rows: Sequence[TableRow]) -> str:
    tests = " and ".join(dict.fromkeys(_SHORT[each["test"]] for each in rows))
    return f"{tests}, {_largest([float(each['p_holm']) for each in rows], rows[0])}"


def _largest(ps: Sequence[float], found: TableRow) -> str:
    text = _p_text(max(ps), found)
    if len(ps) == 1:
        return text
    return f"all {text}" if "<" in text else f"largest {text}"


def _other(found: TableRow, name: str) -> str:
    return str(found["other"] if found["group"] == name else found["group"])


def _others(rows: Sequence[TableRow], name: str) -> str:
    return _and([_other(each, name) for each in rows])


def _and(parts: Sequence[str]) -> str:
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"
