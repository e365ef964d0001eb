"""The cached reasoner's answers are Pellet's: on several ontologies, around every threshold, and
from a file.
"""

import random
from decimal import Decimal
from functools import lru_cache
from pathlib import Path
from tempfile import mkdtemp

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from suave_des.errors import KnowledgeError
from suave_des.knowledge import reasoner as module
from suave_des.knowledge.ontology import Ontology, Terms
from suave_des.knowledge.rdf import RDF
from suave_des.knowledge.reasoner import Reasoner, Regions, cache_digest, regions_of
from suave_des.knowledge.state import Inference, KnowledgeState, ObjectiveState, exact
from suave_des.resources import shipped_folder
from tests.helpers.knowledge_states import MOTION, SEARCH, searching
from tests.helpers.owl_text import SWRL, TOMASYS, XSD, individual

MORE_DESIGNS = "".join(
    individual(
        f"qa_extra_{n}", "QAvalue", ("isQAtype", ":water_visibility"), ("hasValue", f"{n}.{n}")
    )
    + individual(
        f"fd_extra_{n}",
        "FunctionDesign",
        ("solvesF", f":{SEARCH}"),
        ("hasQAestimation", f":qa_extra_{n}"),
    )
    for n in range(5)
)
MORE_ATTRIBUTES = individual(
    "temperature", "QualityAttributeType", ("qa_comparison_operator", ">")
) + "".join(
    individual(f"qa_{name}", "QAvalue", ("isQAtype", f":{name}"), ("hasValue", value))
    + individual(
        f"fd_{name}",
        "FunctionDesign",
        ("solvesF", f":{SEARCH}"),
        ("hasQAestimation", f":qa_{name}"),
    )
    for name, value in (("battery_level", "0.25"), ("temperature", "40.0"))
)
BATTERY = (
    "Battery: hasQAvalue(?fg, ?q) ^ isQAtype(?q, battery_level) ^ hasValue(?q, ?v) ^ lessThanOrEqual(?v, 0.25)"
    ' -> fg_status(?fg, "IN_ERROR_NFR")\n'
)
CHAIN = """
Low: isQAtype(?q, water_visibility) ^ hasValue(?q, ?v) ^ lessThan(?v, 1.5) -> Role(?q)
Exact: Role(?q) ^ hasValue(?q, 1.25) -> Binding(?q)
Both: Role(?q) ^ isQAtype(?p, battery_level) ^ hasValue(?p, ?w) ^ greaterThanOrEqual(?w, 0.5) -> ComponentClass(?p)
Then: ComponentClass(?p) ^ Objective(?o) -> o_updatable(?o, true)
"""
RELATIVE = """
Below: isQAtype(?q, water_visibility) ^ hasValue(?q, ?v) ^ isQAtype(?p, battery_level) ^ hasValue(?p, ?w)
    ^ lessThan(?v, ?w) -> Role(?p)
Level: isQAtype(?q, water_visibility) ^ hasValue(?q, ?v) ^ isQAtype(?p, battery_level) ^ hasValue(?p, ?w)
    ^ equal(?v, ?w) -> Binding(?p)
"""
ARITHMETIC = """
Sum: isQAtype(?q, water_visibility) ^ hasValue(?q, ?v) ^ isQAtype(?p, battery_level) ^ hasValue(?p, ?w)
    ^ add(?s, ?v, ?w) ^ greaterThan(?s, 2.0) -> Role(?p)
"""
ONTOLOGIES = {
    "shipped": ("", ""),
    "more designs": (MORE_DESIGNS, ""),
    "more attributes": (MORE_ATTRIBUTES, BATTERY),
    "chained rules": ("", CHAIN),
    "relative order": ("", RELATIVE),
    "arithmetic": ("", ARITHMETIC),
}


@lru_cache
def loaded(name: str) -> tuple[Ontology, Reasoner, Reasoner]:
    extra, rules = ONTOLOGIES[name]
    folder = Path(mkdtemp())
    text = (shipped_folder("ontology") / "suave.owl").read_text(encoding="utf-8")
    (folder / "suave.owl").write_text(
        text.replace("</rdf:RDF>", extra + "</rdf:RDF>"), encoding="utf-8"
    )
    (folder / "mine.swrl").write_text(rules, encoding="utf-8")
    kb = Ontology.load([folder / "suave.owl"], rules=[folder / "mine.swrl"])
    return kb, Reasoner(kb, "pellet"), Reasoner(kb, folder=folder)


def outcome(reasoner: Reasoner, state: KnowledgeState) -> Inference | str:
    try:
        return reasoner.analyze(state)
    except KnowledgeError as error:
        return str(error)


def near(kb: Ontology) -> st.SearchStrategy[Decimal]:
    """Just below, on and just above each number of the knowledge base, and anything else."""
    thresholds = st.sampled_from(regions_of(kb).thresholds)
    steps = st.sampled_from(
        [Decimal(0), *(sign * Decimal(10) ** -power for sign in (1, -1) for power in (1, 6, 25))]
    )
    return st.builds(lambda a, b: a + b, thresholds, steps) | st.decimals(0, 50, places=3)


@st.composite
def states(draw: st.DrawFn, kb: Ontology) -> KnowledgeState:
    grounded = {
        SEARCH: draw(st.sampled_from(kb.designs(SEARCH))),
        MOTION: draw(st.sampled_from(kb.designs(MOTION))),
    }
    functions = draw(st.lists(st.sampled_from([SEARCH, MOTION]), unique=True))
    measured = draw(st.lists(st.sampled_from(sorted(kb.model.attributes)), unique=True, max_size=3))
    return KnowledgeState.of(
        [ObjectiveState(name) for name in functions],
        groundings={name: grounded[name] for name in functions if draw(st.booleans())},
        components=draw(
            st.dictionaries(st.just("c_thruster_1"), st.sampled_from(["FALSE", "RECOVERED"]))
        ),
        measurements={name: draw(near(kb)) for name in measured},
    )


def moved(draw: random.Random, kb: Ontology, state: KnowledgeState) -> KnowledgeState:
    """The state with its values moved about inside their gaps, if each value in a gap has it to
    itself.
    """
    regions = regions_of(kb)
    bounds = [Decimal(-10), *regions.thresholds, Decimal(100)]
    gaps = [region for _, value in state.measurements if (region := regions.region(value)) % 2 == 0]
    are_apart = len(set(gaps)) == len(gaps)
    fresh: dict[Decimal, Decimal] = {}
    for _, value in state.measurements:
        region = regions.region(value)
        low, high = bounds[region // 2], bounds[min(region // 2 + 1, len(bounds) - 1)]
        is_moved = region % 2 == 0 and are_apart
        fresh[value] = low + (high - low) * draw.randrange(1, 1000) / 1000 if is_moved else value
    return KnowledgeState.of(
        state.objectives,
        groundings=dict(state.groundings),
        components=dict(state.components),
        measurements={name: fresh[value] for name, value in state.measurements},
    )


@pytest.mark.parametrize("name", ONTOLOGIES)
@settings(max_examples=25)
@given(data=st.data(), seed=st.integers(0, 2**32))
def test_cached_pellet_agrees_with_pellet_around_thresholds(name, data, seed):
    kb, pellet, cached = loaded(name)
    state = data.draw(states(kb))
    assert outcome(cached, state) == outcome(pellet, state)
    twin = moved(random.Random(seed), kb, state)
    if cached.regions is not None and cached.regions.is_sound:
        assert cached.regions.key(twin) == cached.regions.key(state)
    found, wanted = outcome(cached, twin), outcome(pellet, twin)
    assert found == wanted
    if isinstance(found, Inference) and isinstance(wanted, Inference):
        assert (found.state, found.asserted) == (twin, wanted.asserted)


@pytest.mark.parametrize(
    ("visibility", "battery"),
    [("1.25", "0.5"), pytest.param("1.249999", "1.3", marks=pytest.mark.slow)],
)
@pytest.mark.parametrize("name", [name for name in ONTOLOGIES if name != "shipped"])
def test_stock_owlready2_agrees(name, visibility, battery):
    kb, pellet, cached = loaded(name)
    draw = random.Random(name)
    stock = Reasoner(kb, "owlready2")
    state = searching(draw.choice(kb.designs(SEARCH)), visibility)
    state = KnowledgeState.of(
        state.objectives,
        groundings=dict(state.groundings),
        measurements={"water_visibility": visibility, "battery_level": battery},
    )
    assert outcome(stock, state) == outcome(pellet, state) == outcome(cached, state)


@given(
    data=st.data(),
    numbers=st.lists(
        st.decimals(-4, 4, places=1) | st.sampled_from([Decimal("0.1000000000000000001")])
    ),
)
def test_all_floats_between_the_bounds_of_a_value_are_in_its_region(data, numbers):
    regions = Regions(tuple(sorted(set(numbers))), ())
    value = data.draw(st.floats(-5, 5) | st.sampled_from([0.1, *map(float, numbers)]))
    above, below = regions.around(value)
    assert above < value < below or (above == below == value and value in map(float, numbers))
    if above < below:
        other = data.draw(
            st.floats(max(above, -9.0), min(below, 9.0), exclude_min=True, exclude_max=True)
        )
        assert regions.region(exact(other)) == regions.region(exact(value))


def test_rules_that_only_compare_need_regions_only():
    for name in ("shipped", "more designs", "more attributes", "chained rules", "relative order"):
        assert loaded(name)[2].regions.reasons == ()
    assert loaded("shipped")[2].regions.thresholds == tuple(
        map(Decimal, ["0.25", "0.5", "0.75", "1", "1.25", "2.25", "3.25"])
    )


@pytest.mark.parametrize(
    ("rules", "reason"),
    [
        (ARITHMETIC, "rule Sum computes with add"),
        ("A: hasValue(?q, ?v) -> fd_efficacy(?q, ?v)", "rule A copies the value ?v to its head"),
        ("A: hasValue(?q, ?v) ^ lessThan(?v, 1e0) -> Role(?q)", "rule A has a binary number"),
        ("A: hasValue(?q, ?v) ^ xsd:integer(?v) -> Role(?q)", "rule A asks for a datatype"),
    ],
)
def test_why_exact_values_count(rules, reason, tmp_path):
    (tmp_path / "mine.swrl").write_text(rules, encoding="utf-8")
    kb = Ontology.load(rules=[tmp_path / "mine.swrl"])
    regions = regions_of(kb)
    assert reason in " ".join(regions.reasons)
    one, other = searching("fd_spiral_low", "2.0"), searching("fd_spiral_low", "2.1")
    assert regions.key(one) != regions.key(other)
    (tmp_path / "mine.swrl").write_text(f"disabled {rules.strip()}", encoding="utf-8")
    assert regions_of(Ontology.load(rules=[tmp_path / "mine.swrl"])).is_sound


@pytest.fixture
def no_pellet(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("Pellet was asked")

    monkeypatch.setattr("suave_des.knowledge.pellet.in_process.InProcessPellet.__init__", refuse)


STATES = [
    searching(f"fd_spiral_{name}", value)
    for name in ("low", "high")
    for value in ("1.0", "1.25", "2.0", "4")
]


@pytest.fixture
def filled(kb: Ontology, tmp_path: Path) -> Path:
    cached = Reasoner(kb, folder=tmp_path)
    for state in STATES:
        cached.analyze(state)
    (file,) = (tmp_path / "inferences").iterdir()
    return file


def test_a_filled_memory_asks_nobody(kb, pellet, filled, no_pellet):
    cached = Reasoner(kb, folder=filled.parent.parent)
    for state in [*STATES, searching("fd_spiral_high", "2.1234")]:
        assert cached.analyze(state) == pellet.analyze(state)
    with pytest.raises(AssertionError, match="asked"):
        cached.analyze(searching("fd_spiral_medium", "1.0"))


def test_the_cache_depends_on_the_code_of_every_package_for_knowledge(kb, monkeypatch):
    before = cache_digest(kb)
    monkeypatch.setattr(module, "hash_of_code", module.hash_of_code.__wrapped__)
    assert cache_digest(kb) == before
    read = Path.read_bytes
    for changed in ("ontology.py", "pellet/in_process.py", "rules/parser.py"):

        def altered(path, changed=changed):
            return read(path) + b"#" * path.as_posix().endswith(changed)

        monkeypatch.setattr(Path, "read_bytes", altered)
        assert cache_digest(kb) != before


def test_a_folder_that_cannot_be_written_is_no_obstacle(kb, tmp_path):
    (tmp_path / "file").write_text("not a folder", encoding="utf-8")
    cached = Reasoner(kb, folder=tmp_path / "file")
    assert cached.analyze(STATES[0]).grounding_status(SEARCH) == "IN_ERROR_NFR"


def test_a_contradiction_is_told_for_each_state_with_its_own_values(kb, tmp_path):
    cached = Reasoner(kb, folder=tmp_path)
    for _ in range(2):
        with pytest.raises(KnowledgeError, match="o_status"):
            cached.analyze(searching("fd_spiral_high", "1.0", status="UNGROUNDED"))
    assert not (tmp_path / "inferences").exists()


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 0, 2), (2, 0, 1)])
def test_a_value_on_a_threshold_is_not_one_beside_it(order, tmp_path):
    # fd_spiral_high expects 3.25 m; the rule QAWaterVisibility says less than that is an error, so
    # 3.25 itself is none.
    (tmp_path / "equal.swrl").write_text(
        "Level: isQAtype(?q, water_visibility) ^ hasValue(?q, ?v) ^ equal(?v, 3.25) -> Binding(?q)\n"
    )
    cached = Reasoner(Ontology.load(rules=[tmp_path / "equal.swrl"]), folder=tmp_path)
    cases = [("3.2499", "IN_ERROR_NFR"), ("3.25", None), ("3.2501", None)]
    for value, status in (cases[place] for place in order):
        inference = cached.analyze(searching("fd_spiral_high", value))
        assert inference.grounding_status(SEARCH) == status, value
        assert ("Binding(obs_water_visibility)" in map(str, inference.facts)) == (
            value == "3.25"
        ), value


def measuring(visibility: str, battery: str) -> KnowledgeState:
    return KnowledgeState.of(
        [], measurements={"water_visibility": visibility, "battery_level": battery}
    )


def test_two_values_between_the_same_numbers_are_told_apart_by_their_order(kb, tmp_path):
    """Rules may compare them with one another; values that no rule can tell apart are one case."""
    one, other, moved = (measuring(*each) for each in (("2", "1.5"), ("1.5", "2"), ("2", "0.4")))
    regions, cached = regions_of(kb), Reasoner(kb, folder=tmp_path)
    assert regions.key(one) != regions.key(other)
    assert cached.distinguished((2.0, 1.5)) != cached.distinguished((1.5, 2.0))
    assert regions.key(moved) == regions.key(measuring("1.3", "0.3"))
    assert cached.distinguished((2.0, 0.4)) == cached.distinguished((1.3, 0.3))


def test_what_is_inferred_in_one_order_of_two_values_is_not_returned_for_the_other():
    _, pellet, cached = loaded("relative order")
    below, above = measuring("0.8", "0.9"), measuring("0.9", "0.8")
    found = [cached.analyze(each).facts for each in (below, above)]
    assert found == [pellet.analyze(each).facts for each in (below, above)]
    assert [{str(each) for each in facts} for facts in found] == [
        {"Role(obs_battery_level)"},
        set(),
    ]


def test_what_is_cached_of_some_terms_is_not_returned_where_others_are_asked(tmp_path):
    (tmp_path / "two.swrl").write_text(
        "one: isQAtype(?q, water_visibility) ^ hasValue(?q, 2.0) -> Role(?q)\n"
        "two: isQAtype(?q, water_visibility) ^ hasValue(?q, 2.0) -> Binding(?q)\n"
    )
    kb, state = Ontology.load(rules=[tmp_path / "two.swrl"]), searching("fd_spiral_low", "2.0")
    asked = [Terms((), (TOMASYS + name,)) for name in ("Role", "Binding")]
    found = [Reasoner(kb, "cached", None, terms, tmp_path).analyze(state).facts for terms in asked]
    assert [list(map(str, facts)) for facts in found] == [
        ["Role(obs_water_visibility)"],
        ["Binding(obs_water_visibility)"],
    ]
    every = Reasoner(kb, "cached", None, None, tmp_path).analyze(state).facts
    assert every == Reasoner(kb, "pellet").analyze(state).facts == found[0] | found[1]


EXPRESSION = f"""
<rdf:Description rdf:about="urn:swrl:var#q"><rdf:type rdf:resource="{SWRL}Variable"/></rdf:Description>
<swrl:Imp xmlns:swrl="{SWRL}" xmlns:rdf="{RDF}"><rdfs:label>deep</rdfs:label>
<swrl:body><swrl:AtomList><rdf:rest rdf:resource="{RDF}nil"/><rdf:first><swrl:ClassAtom><swrl:classPredicate>
<owl:Restriction><owl:onProperty rdf:resource="{TOMASYS}hasValue"/>
<owl:hasValue rdf:datatype="{XSD}decimal">2.5</owl:hasValue></owl:Restriction></swrl:classPredicate>
<swrl:argument1 rdf:resource="urn:swrl:var#q"/></swrl:ClassAtom></rdf:first></swrl:AtomList></swrl:body>
<swrl:head><swrl:AtomList><rdf:rest rdf:resource="{RDF}nil"/><rdf:first><swrl:ClassAtom>
<swrl:classPredicate rdf:resource="{TOMASYS}Role"/><swrl:argument1 rdf:resource="urn:swrl:var#q"/></swrl:ClassAtom>
</rdf:first></swrl:AtomList></swrl:head></swrl:Imp>
"""


def test_a_rule_on_a_class_expression_needs_exact_values(suave_copy, tmp_path):
    kb = Ontology.load([suave_copy(EXPRESSION)])
    assert regions_of(kb).reasons == ("rule deep asks for a datatype or a class expression",)
    cached, pellet = Reasoner(kb, folder=tmp_path), Reasoner(kb, "pellet")
    for value in ("2.4", "2.5", "2.6"):
        state = searching("fd_spiral_low", value)
        assert cached.analyze(state) == pellet.analyze(state)
        assert ("Role(obs_water_visibility)" in map(str, pellet.analyze(state).facts)) == (
            value == "2.5"
        )
