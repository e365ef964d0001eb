"""The policy: the decision in every state, over places of measured values, component reports and
groundings.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from suave_des.errors import number_of
from suave_des.kb.reports import Reports
from suave_des.kb.situations import INCONSISTENT, Decide, Outcome, Situation
from suave_des.kb.space import PolicySpace, States, add_decisions, measured_attributes
from suave_des.kb.states import ManagingSettings
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.reasoner import regions_of
from suave_des.knowledge.state import NONE_LEFT, KnowledgeState
from suave_des.tables import Table

if TYPE_CHECKING:  # an inference alone needs no pandas, the larger part of its start
    import pandas

FLIP_FLOP = "flip-flop"
_EXAMPLES = 5
#: Functions that have an objective, and (function, design) of those that are grounded.
_TaskState = tuple[tuple[str, ...], tuple[tuple[str, str], ...]]


@dataclass(frozen=True, eq=False)
class Policy:
    """The whole decision table.

    Attributes:
        space: what it tells apart.
        cases: a row for each kind of state: the place of each attribute's value on the space's
            scale; the `components` that report; how many `states` it stands for; of each function
            the grounding `_now` and what happens to it `_then`, empty where the function has no
            objective; inferred `statuses`; `marks`, which are any of "inconsistent", "none left"
            and "flip-flop"; the `problem` of an inconsistent state; functions whose mode is
            requested `again` although it stays; and as objects one such `state`, its `reports` in
            words and the functions that are `flipping`.
        functions: that have an objective in a state.
        without_effect: measured attributes that no rule and no design refers to.
        no_proof: why rules may do more than compare; if there are any reasons, the ranges are
            samples only.
        max_failed: maximum number of components that report a status.
    """

    space: PolicySpace
    cases: pandas.DataFrame = field(repr=False)
    functions: tuple[str, ...]
    without_effect: tuple[str, ...]
    no_proof: tuple[str, ...]
    max_failed: int

    @property
    def states(self) -> int:
        """Number of states covered; interchangeable components count one by one, each range
        once.
        """
        return int(self.cases["states"].sum())

    def marked(self, mark: str) -> pandas.DataFrame:
        """Cases with a mark."""
        return self.cases[self.cases["marks"].str.contains(mark, regex=False)]

    def csv(self) -> str:
        """Every case, as a CSV file."""
        texts = self.cases.drop(columns=["state", "reports", "flipping"])
        for name in self.space.attributes:
            texts[name] = texts[name].map(self.space.scale.text)
        return texts.to_csv(index=False)

    def lines(self) -> Iterator[str]:
        """What it covers, and what is wrong with it."""
        kinds = len(self.cases)
        counts = f"{number_of(self.states, 'state')} in {kinds} equivalence class{'' if kinds == 1 else 'es'}"
        yield f"{counts}, with at most {number_of(self.max_failed, 'component')} reporting"
        for group in self.space.alike:
            if len(group) > 1:
                yield f"interchangeable (only their number matters): {', '.join(group)}"
        yield from (f"without any effect: measured {name}" for name in self.without_effect)
        yield from (
            f"{reason}: each range was tried with one value only" for reason in self.no_proof
        )
        for mark in (INCONSISTENT, NONE_LEFT, FLIP_FLOP):
            cases = self.marked(mark)
            yield f"{mark}: {number_of(int(cases['states'].sum()), 'state')}"
            if mark != NONE_LEFT:
                yield from _examples(cases)


def _examples(cases: pandas.DataFrame) -> Iterator[str]:
    """A state of some cases each, with what contradicts what in it."""
    for each in cases[:_EXAMPLES].to_dict("records"):
        yield f"  {each['state']}" + (f": {each['problem']}" if each["problem"] else "")
    if len(cases) > _EXAMPLES:
        yield f"  and {len(cases) - _EXAMPLES} more kinds: see --csv"


def make_policy(
    base: Ontology,
    settings: ManagingSettings,
    states: States,
    max_failed: int,
    decided: Decide,
    decide: Decide,
) -> Policy:
    """Tabulate what is decided in states.

    Args:
        states: of at most `max_failed` components that report.
        decided: what is decided in each of them, as decide_all says.
        decide: concludes anew, for contradictions, which are told with the values of the state.
    """
    every = list(states)
    outcomes = list(map(decided, map(Situation, every)))
    cases = states.frame(every)
    add_decisions(cases, states, outcomes)
    # states that differ in their task only follow one another
    flipping: list[tuple[str, ...]] = []
    for first in range(0, len(every), len(states.tasks)):
        group = slice(first, first + len(states.tasks))
        flipping += _flipping(every[group], outcomes[group])
    cases["marks"] = list(map(_marks, outcomes, flipping))
    cases["problem"] = [
        decide(Situation(state)).contradiction if outcome.reasoning is None else ""
        for state, outcome in zip(every, outcomes, strict=True)
    ]
    cases["again"] = ["; ".join(_again(outcome)) for outcome in outcomes]
    words = {reports: _in_words(reports, states.space) for reports in states.reports}
    cases["state"] = every
    cases["reports"] = [words[state.components] for state in every]
    cases["flipping"] = flipping
    ineffective = (
        name for name in measured_attributes(base, settings) if name not in states.space.attributes
    )
    return Policy(
        states.space,
        cases,
        states.functions,
        tuple(ineffective),
        regions_of(base).reasons,
        max_failed,
    )


def _again(outcome: Outcome) -> Iterator[str]:
    """Functions that are decided on, and keep their design: its mode is requested again."""
    if outcome.reasoning is not None:
        groundings = outcome.reasoning.inference.state.groundings
        for decision in outcome.reasoning.plan.decisions:
            if (decision.function, decision.design) in groundings:
                yield decision.function


def _marks(outcome: Outcome, flipping: Sequence[str]) -> str:
    if outcome.reasoning is None:
        return INCONSISTENT
    return "; ".join(
        [NONE_LEFT] * bool(outcome.reasoning.plan.without_design) + [FLIP_FLOP] * bool(flipping)
    )


def _flipping(
    states: Sequence[KnowledgeState], outcomes: Sequence[Outcome]
) -> Iterator[tuple[str, ...]]:
    """Functions of each state whose decisions lead through other groundings back to its own, all
    else being equal.
    """
    after = {}
    for state, outcome in zip(states, outcomes, strict=True):
        asked = tuple(each.function for each in state.objectives)
        designs = dict(state.groundings)
        for function, design in outcome.changes.items():
            if design != NONE_LEFT:
                designs[function] = design
        after[asked, state.groundings] = asked, tuple(sorted(designs.items()))
    for start in after:
        ways = [dict(groundings) for _, groundings in _round_trip(after, start)]
        yield tuple(name for name in start[0] if len({each.get(name) for each in ways}) > 1)


def _round_trip(after: dict[_TaskState, _TaskState], start: _TaskState) -> list[_TaskState]:
    """The tasks that follow one another from one until it comes again; none where it does not."""
    way = [start]
    while (following := after[way[-1]]) in after and following not in way:
        way.append(following)
    return way if following == start else []


def _in_words(reports: Reports, space: PolicySpace) -> str:
    """What components report: counted where they are interchangeable, else named."""
    counted = Counter[str]()
    named = set[str]()
    for component, status in reports:
        kind = space.alike_to(component)
        if len(kind) == 1:
            words = f"{component} {status}"
            named.add(words)
        elif len(space.alike) == 1:
            words = status
        else:
            words = f"{status} of {kind[0]} and alike"
        counted[words] += 1
    parts = (words if words in named else f"{number} {words}" for words, number in counted.items())
    return " + ".join(parts) or "no report"


def function_table(policy: Policy, function: str) -> tuple[Table, int, str]:
    """Tabulate what happens to one function's grounding, without the dimensions on which it does
    not depend.

    The last measured attribute goes across, all else down.

    Returns:
        the table; the number of its columns that say what the case is; the attribute that goes
        across, or "".
    """
    cases, kept = _needed(policy, function)
    attributes = [name for name in policy.space.attributes if name in kept]
    down = kept[: len(kept) - len(attributes)]
    found = _outcomes(cases, kept, len(down))
    ranges = [_ranges(number, policy, found.values()) for number in range(len(attributes))]
    merged = _merged(found, len(down) - down.count("reports"), ranges)
    rows = [
        [*now, *map(", ".join, zip(*reports, strict=True)), *at, *then]
        for (now, at, then), reports in merged.items()
    ]
    names = {f"{function}_now": "now", "reports": "components"}
    headings = [names.get(name, name.removesuffix("_now")) for name in down] + attributes[:-1]
    if attributes:
        across = attributes[-1]
        outcomes = [words for _, words in ranges[-1]]
        title = f"{function}, by measured {', '.join(attributes)}"
    else:
        across = ""
        outcomes = ["then"]
        title = function
    columns = [*headings, *outcomes]
    return Table(columns, rows, title, "l" * len(columns)), len(headings), across


def _merged(
    found: Mapping[tuple[str, ...], _Outcomes],
    designs: int,
    ranges: Sequence[Sequence[tuple[int, str]]],
) -> dict[Any, list[tuple[str, ...]]]:
    """What components report, if that matters, in each different row: designs, of which there are
    so many, words for places, and outcomes.
    """
    *over, across = ranges or [[]]
    merged: dict[Any, list[tuple[str, ...]]] = {}
    for names, row in found.items():
        for at in itertools.product(*over):
            places = [first for first, _ in at]
            cells = [row[*places, last] for last, _ in across] or [row[()]]
            label = names[:designs], tuple(words for _, words in at), tuple(cells)
            merged.setdefault(label, []).append(names[designs:])
    return merged


def _needed(policy: Policy, function: str) -> tuple[Any, list[str]]:
    """The cases in which a function has an objective, with their outcome, and the dimensions on
    which that depends: designs, its own first, reports, and measured attributes.
    """
    own = f"{function}_now"
    groundings = list(dict.fromkeys((own, *(f"{name}_now" for name in policy.functions))))
    cases: Any = policy.cases[policy.cases[own] != ""].copy()
    flips = [f" ({FLIP_FLOP})" if function in flipping else "" for flipping in cases["flipping"]]
    cases["outcome"] = cases[f"{function}_then"] + flips
    cases[groundings] = cases[groundings].replace("", "no objective")
    kept = [*groundings, "reports", *policy.space.attributes]
    for dimension in kept[1:]:
        fewer = [each for each in kept if each != dimension]
        outcomes = cases[[*fewer, "outcome"]].drop_duplicates()
        if not outcomes.duplicated(fewer).any():
            kept = fewer
            cases = outcomes
    return cases, kept


#: An outcome for each place of the measured attributes.
_Outcomes = dict[tuple[int, ...], str]


def _outcomes(cases: Any, kept: list[str], down: int) -> dict[tuple[str, ...], _Outcomes]:
    """What happens by the dimensions that go down, and below them by the places of measured values."""
    found: dict[tuple[str, ...], _Outcomes] = {}
    for at, outcomes in cases.groupby(kept, sort=False)["outcome"]:
        different = outcomes.unique()
        text = " or ".join(different)
        if len(different) > 1:
            text += ", by the order of the values"
        found.setdefault(at[:down], {})[at[down:]] = text
    return found


def _ranges(number: int, policy: Policy, rows: Iterable[_Outcomes]) -> list[tuple[int, str]]:
    """The first place of each range of an attribute in which all outcomes are equal, with words."""
    scale = policy.space.scale
    return [(first, scale.text(first, last)) for first, last in _spans(number, len(scale), rows)]


def _spans(number: int, places: int, rows: Iterable[_Outcomes]) -> list[tuple[int, int]]:
    """First and last place of each range of an attribute, given by its number, in which all
    outcomes are equal.
    """
    by_place: list[dict[Hashable, str]] = [{} for _ in range(places)]
    for row_number, row in enumerate(rows):
        for at, outcome in row.items():
            by_place[at[number]][row_number, at[:number], at[number + 1 :]] = outcome
    spans: list[tuple[int, int]] = []
    for place, outcomes in enumerate(by_place):
        # nothing is joined to "not measured"
        if len(spans) > 1 and by_place[spans[-1][0]] == outcomes:
            spans[-1] = spans[-1][0], place
        else:
            spans.append((place, place))
    return spans
