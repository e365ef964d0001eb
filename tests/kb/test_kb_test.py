"""kb test: tests of rules pass and fail as they should, say why, and refuse what makes no sense."""

import itertools
import textwrap
from decimal import Decimal
from functools import partial
from pathlib import Path
from subprocess import CompletedProcess
from types import SimpleNamespace
from xml.etree import ElementTree

import pytest

from suave_des.kb.rule_tests import TestFile, mission_states, run_test, shipped_tests
from suave_des.kb.scale import Scale, is_in, measurements_in, parse_region
from tests.helpers.command import command_here
from tests.helpers.owl_text import individual, iri

SPARE = """\
spare: hasQAvalue(?fg, ?q) ^ isQAtype(?q, water_visibility) ^ hasValue(?q, ?v) ^ lessThan(?v, 3.5)
       -> fd_realisability(fd_spiral_high, false)
"""


@pytest.fixture(scope="module")
def run(knowledge):
    return partial(run_test, knowledge)


@pytest.fixture
def suite(tmp_path, knowledge):
    """Reads tests from YAML that is given as text."""

    def read(text):
        path = tmp_path / "mine.yaml"
        path.write_text("tests:\n" + textwrap.dedent(text), encoding="utf-8")
        return list(TestFile.read(path).tests(knowledge))

    return read


def test_the_shipped_rules_pass_the_shipped_tests(command):
    status, out, _ = command("test")
    assert status == 0
    assert "passed" in out.splitlines()[-1]
    assert len(shipped_tests()) == 2


def test_a_fact_that_does_not_follow_is_a_failure_with_its_reason(suite, run):
    (test,) = suite("""
        - name: too clear
          given: {groundings: {f_generate_search_path: fd_spiral_high}, measurements: {water_visibility: 3.4}}
          follows: ["fg_status(fg_spiral_high, IN_ERROR_NFR)"]
        """)
    (failure,) = run(test).failures
    assert failure[0] == "fg_status(fg_spiral_high, IN_ERROR_NFR) does not follow"
    assert (
        "QAWaterVisibility: lessThan(?measured, ?expected) does not hold: found 3.4" in failure[2]
    )


def test_a_fact_that_must_not_follow_is_a_failure_with_its_derivation(suite, run):
    (test,) = suite("""
        - name: never
          given: {components: {c_thruster_1: FALSE}}
          follows_not: ["fd_realisability(fd_all_thrusters, false)"]
        """)
    (failure,) = run(test).failures
    assert failure[0] == "fd_realisability(fd_all_thrusters, false) follows"
    assert "by rule compError" in failure[2]


def test_a_region_stands_for_all_kinds_of_values_in_it(suite, run):
    (test,) = suite("""
        - name: partly in error
          given: {groundings: {f_generate_search_path: fd_spiral_medium}, measurements: {water_visibility: ">= 1.25"}}
          follows: ["fg_status(fg_spiral_medium, IN_ERROR_NFR)"]
        """)
    values = [str(each.state.measurements[0][1]) for each in test.situations]
    assert values == ["1.25", "1.75", "2.25", "2.75", "3.25", "3.75"]
    (failure,) = run(test).failures
    assert failure[1].startswith("  in the state (water_visibility 2.25): ")


TWO_STATUSES = """
          given:
            groundings: {f_generate_search_path: fd_spiral_high}
            measurements: {water_visibility: 1}
            facts: ["fg_status(fg_spiral_high, IN_ERROR_FR)"]
"""
GIVEN_FACTS = {
    "an individual that only the test has": (
        """
          given: {facts: [Binding(b1), "binding_component(b1, c_thruster_1)", "c_status(c_thruster_1, false)"]}
          follows: ["b_status(b1, false)"]
""",
        True,
    ),
    "a contradiction": (TWO_STATUSES + "          contradiction: true\n", True),
    "a contradiction that the test does not expect": (
        TWO_STATUSES + '          follows: ["fg_status(fg_spiral_high, IN_ERROR_FR)"]\n',
        False,
    ),
}


@pytest.mark.parametrize("name", GIVEN_FACTS)
def test_given_facts_count_as_the_states(suite, run, name):
    text, passes = GIVEN_FACTS[name]
    (test,) = suite(f"        - name: given{text}")
    assert run(test).passed is passes


@pytest.fixture(scope="module")
def spare(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, CompletedProcess[str]]:
    """A folder with tests of a rule of their own, in which they have been run; one test fails."""
    folder = tmp_path_factory.mktemp("spare")
    (folder / "spare.swrl").write_text(SPARE, encoding="utf-8")
    (folder / "spare.yaml").write_text(
        textwrap.dedent("""
            rules: [spare.swrl]
            tests:
            - name: not high below 3.5 m
              given: {groundings: {f_generate_search_path: fd_spiral_medium}, measurements: {water_visibility: "< 3.5"}}
              follows: ["fd_realisability(fd_spiral_high, false)"]
            - name: wrong <&>
              given: {measurements: {water_visibility: 2}}
              follows: ["fd_realisability(fd_spiral_high, false)"]
            """),
        encoding="utf-8",
    )
    words = ("kb", "test", "spare.yaml", "--junit-xml", "out.xml")
    return folder, command_here(*words, cwd=folder)


def test_rules_that_a_file_of_tests_names_are_tested(spare):
    _, ended = spare
    assert "1 failed, 1 passed" in ended.stdout


def test_a_failed_test_of_rules_is_the_exit_status(spare):
    _, ended = spare
    assert ended.returncode == 1


def test_results_are_written_as_junit_xml(spare):
    folder, _ = spare
    root = ElementTree.parse(folder / "out.xml").getroot()
    assert [(suite.get("tests"), suite.get("failures")) for suite in root] == [("2", "1")]
    assert [case.get("name") for case in root.iter("testcase")] == [
        "not high below 3.5 m",
        "wrong <&>",
    ]


def test_a_test_whose_state_cannot_be_decided_fails_alone(suave_copy, command, tmp_path):
    """Planning compares required values with an operator, which this quality attribute does not
    have.
    """
    required = f'<rdf:Description rdf:about="{iri("o_maintain_motion")}"><tomasys:hasNFR rdf:resource="{iri("nfr")}"/>'
    depth = individual("depth", "QualityAttributeType")
    nfr = individual("nfr", "QAvalue", ("isQAtype", ":depth"), ("hasValue", "1.0"))
    ontology = suave_copy(f"{depth}{nfr}{required}</rdf:Description>")
    tests = tmp_path / "mine.yaml"
    tests.write_text(
        "tests:\n"
        "- {name: undecided, given: {objectives: [f_maintain_motion]}, decides: {f_maintain_motion: none left}}\n"
        "- {name: decided, given: {objectives: [f_follow_pipeline]}, follows: [Objective(o_follow_pipeline)]}\n",
        encoding="utf-8",
    )
    status, out, _ = command("test", tests, "--ontology", ontology)
    assert status == 1
    assert "1 failed, 1 passed" in out
    assert (
        f"FAILED {tests}:2: undecided: the state cannot be decided: " in out
        and "qa_comparison_operator" in out
    )


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("follows: [fg_status(fg_spiral_high, IN)]", "in quotes in a YAML list"),
        (
            'follows: ["fg_stats(fg_spiral_high, IN)"]',
            "no property 'fg_stats' (did you mean fg_status?)",
        ),
        ('follows: ["fg_status(fg_spiral_hig, IN)"]', "did you mean fg_spiral_high?"),
        ('follows: ["fg_status(?fg, IN)"]', "has a variable"),
        (
            'follows_not: ["fg_status(fg_spiral_low, IN_EROR_NFR)"]',
            "is not among the values of fg_status: it never matches (did you mean IN_ERROR_NFR?)",
        ),
        (
            'follows_not: ["fd_realisability(fd_spiral_low, False)"]',
            "is not a boolean, the range of fd_realisability",
        ),
        ("decides: {f_generate_search_path: fd_spiral_hihg}", "did you mean 'fd_spiral_high'?"),
        ("decides: {f_search: stays}", "there is no function 'f_search'"),
        (
            'given: {measurements: {water_visibility: "1 << 2"}}\n  contradiction: true',
            "'1 << 2' is not a region",
        ),
        (
            'given: {measurements: {water_visibility: "2 <= . < 1"}}\n  contradiction: true',
            "no number is in the region",
        ),
        ("given: {mission: nowhere, at_s: 3}\n  contradiction: true", "nowhere: no such folder"),
        (
            "given: {mission: nowhere}\n  contradiction: true",
            "mission and at_s must be given together",
        ),
    ],
)
def test_what_a_knowledge_base_does_not_have_fails_the_test_with_a_remedy(suite, run, text, said):
    """So the others run: the same tests may be tried on other files."""
    wrong, right = suite(
        f"- name: x\n  {text}\n- name: y\n  decides: {{f_generate_search_path: fd_spiral_high}}\n"
    )
    (failure,) = run(wrong).failures
    assert said in failure[0]
    assert run(right).passed


def test_regions_are_read_as_policies_write_them():
    scale = Scale((Decimal(1), Decimal(2)))
    for first, last in itertools.combinations_with_replacement(range(1, len(scale)), 2):
        region = parse_region(scale.text(first, last))
        inside = [
            at for at in range(len(scale)) if region is not None and is_in(region, scale.value(at))
        ]
        assert inside == (
            [] if scale.text(first, last) in ("1", "2", "any") else list(range(first, last + 1))
        )
    assert is_in(parse_region("not measured"), None)


def test_ends_of_a_region_divide_the_kinds_of_values(knowledge):
    found = [
        words
        for _, words in measurements_in(
            knowledge.base, {"water_visibility": parse_region("3 < . < 3.5")}
        )
    ]
    assert found == [
        f"water_visibility {each}" for each in ("3 < . < 3.25", "3.25", "3.25 < . < 3.5")
    ]


def test_of_each_kind_of_state_of_a_mission_the_first_one_is_told_in_their_order(knowledge):
    def record(t_s, visibility_m):
        state = knowledge.state(measurements={"water_visibility": visibility_m})
        return SimpleNamespace(t_s=t_s, state=state)

    values = [(1.0, 2.0), (2.0, 2.1), (3.0, 3.0), (4.0, 2.2), (5.0, 2.25), (6.0, 2.6)]
    mission = SimpleNamespace(records=[record(*each) for each in values])
    times_s = [t_s for t_s, _ in mission_states(mission, knowledge.base)]
    assert times_s == [1.0, 3.0, 5.0]  # below 2.25, between that and 3.25, and equal to it
