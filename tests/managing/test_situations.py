"""Situations: where news lead, and for which measured values all is as it should be."""

from decimal import Decimal
from math import inf, nextafter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from suave_des.knowledge.deliberation import Conclusion
from suave_des.knowledge.regions import Regions
from suave_des.knowledge.state import Decision, Inference, KnowledgeState, Plan
from suave_des.managing import situations
from suave_des.managing.situations import NO_VALUE, Situation, Situations, cancelled, executed, reported, requested

HIGH, LOW = "fd_high", "fd_low"


def asking(design: str | None = None, *, of: str = "f") -> Conclusion:
    """A conclusion that asks for a design; for nothing if there is none."""
    decisions = () if design is None else (Decision(of, design, "updatable"),)
    return Conclusion(Inference(KnowledgeState(), frozenset(), frozenset()), Plan(decisions), frozenset())


def nothing_known(*attributes: str) -> Situation:
    return Situations(attributes, None).first()


def grounded(*attributes: str) -> Situation:
    return nothing_known(*attributes).after(requested, ("f",)).after(executed, (("f", HIGH),), ())


def test_the_same_news_lead_to_the_same_situation() -> None:
    first = nothing_known()
    assert first.after(requested, ("f", "g")) is first.after(requested, ("f", "g"))
    assert first.after(requested, ("f",)).after(requested, ("g",)) is first.after(requested, ("g", "f"))
    assert not first.objectives


def test_a_function_is_needed_until_its_task_is_over() -> None:
    needed = grounded().after(requested, ("f", "g"))
    assert needed.objectives == {"f": None, "g": "UNGROUNDED"} and needed.groundings == {"f": HIGH}
    over = needed.after(cancelled, ("f", "h"))
    assert over.objectives == {"g": "UNGROUNDED"} and over.groundings == {}


def test_a_recovery_is_news_until_something_was_executed() -> None:
    both = grounded().after(reported, "c_1", "RECOVERED").after(reported, "c_2", "RECOVERED")
    assert both.recovered == ("c_1", "c_2") and not both.is_met_by(asking())
    failed_again = both.after(reported, "c_2", "FALSE")
    assert failed_again.after(executed, (), ("c_1", "c_2")).components == {"c_2": "FALSE"}
    assert both.after(executed, (), ("c_1",)).recovered == ("c_2",)


@pytest.mark.parametrize(("design", "met"), [(HIGH, True), (LOW, False), (None, True)])
def test_a_conclusion_is_met_when_its_designs_are_grounded(design: str | None, met: bool) -> None:
    assert grounded().is_met_by(asking(design)) is met


def test_an_objective_that_is_ungrounded_again_is_not_met() -> None:
    assert not grounded().after(cancelled, ("f",)).after(requested, ("f",)).is_met_by(asking(HIGH))


def test_where_no_design_is_left_nothing_is_asked_for() -> None:
    assert grounded().is_met_by(Conclusion(asking().inference, Plan((Decision("f", None, "none"),)), frozenset()))


def rest(*concluded: tuple[tuple[float, float], Conclusion]) -> tuple[float, ...] | None:
    """Bounds of the rest in the first of some regions."""
    situation = grounded("v")
    for bound, conclusion in concluded:
        situation.remember((bound,), conclusion)
    found = situation.rest((concluded[0][0],))
    return None if found is None else found["v"]


def test_a_rest_goes_on_in_all_regions_in_which_nothing_is_asked_for() -> None:
    assert rest(((1.0, 2.0), asking(HIGH))) == (1.0, 2.0)
    assert rest(((1.0, 2.0), asking(LOW)), ((2.0, 3.0), asking(HIGH))) is None
    assert rest(((2.0, 3.0), asking(HIGH)), ((1.0, 2.0), asking(LOW)), ((3.0, inf), asking())) == (2.0, 3.0, 3.0, inf)
    assert rest(((2.0, 2.0), asking()), ((2.0, 3.0), asking())) == (nextafter(2.0, -inf), 3.0)
    assert rest(((1.0, 2.0), asking()), ((2.0, 2.0), asking()), ((2.0, 3.0), asking())) == (1.0, 3.0)
    assert rest((NO_VALUE, asking()), ((2.0, 3.0), asking())) == (2.0, 3.0)


def test_what_is_learnt_later_widens_a_rest() -> None:
    situation = grounded("v")
    assert situation.rest(((1.0, 2.0),)) is None
    situation.remember(((1.0, 2.0),), asking())
    assert situation.rest(((1.0, 2.0),)) == {"v": (1.0, 2.0)}
    situation.remember(((2.0, 2.0),), asking())
    assert situation.rest(((1.0, 2.0),)) == {"v": (1.0, nextafter(2.0, inf))}


def test_of_several_values_a_rest_has_the_region_alone() -> None:
    situation = grounded("v", "w")
    for region in (((1.0, 2.0), (5.0, 6.0)), ((2.0, 3.0), (5.0, 6.0))):
        situation.remember(region, asking())
    assert situation.rest(((1.0, 2.0), (5.0, 6.0))) == {"v": (1.0, 2.0), "w": (5.0, 6.0)}


@given(
    thresholds=st.lists(st.integers(-3, 3), unique=True, max_size=4),
    concluded=st.lists(st.tuples(st.floats(-4, 4) | st.integers(-3, 3).map(float), st.booleans()), min_size=1),
    value=st.floats(-5, 5) | st.integers(-3, 3).map(float),
)
def test_values_between_the_bounds_are_those_of_the_regions_in_which_nothing_is_asked_for(
    thresholds: list[int], concluded: list[tuple[float, bool]], value: float
) -> None:
    regions = Regions(tuple(map(Decimal, sorted(thresholds))), ())
    situation = grounded("v")
    met = {}
    for where, is_met in concluded:
        bound = regions.around(where)
        met[bound] = is_met
        situation.remember((bound,), asking(HIGH if is_met else LOW))
    found = situation.rest((regions.around(concluded[0][0]),))
    if found is None:
        assert not met[regions.around(concluded[0][0])]
        return
    edges = found["v"]
    inside = any(low < value < high for low, high in zip(edges[::2], edges[1::2], strict=True))
    assert inside == met.get(regions.around(value), False)
    assert list(edges) == sorted(edges)


def test_when_too_much_is_remembered_all_is_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(situations, "REMEMBERED", 4)
    first = nothing_known()
    needed = first.after(requested, ("f",))
    needed.remember(((1.0, 2.0),), asking())
    assert needed.conclusion(((1.0, 2.0),)) is not None
    for count in range(4):
        needed.remember(((float(count), float(count)),), asking())
    assert needed.conclusion(((1.0, 2.0),)) is None
    assert first.after(requested, ("f",)).objectives == needed.objectives
