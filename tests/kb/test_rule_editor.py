"""Rules of OWL files are suave_copy in place: the rest of the file stays as it was, byte for
byte.
"""

import re
import stat
from pathlib import Path

import pytest
from rdflib import Graph, URIRef
from rdflib.namespace import RDF

from suave_des.errors import InputError, KnowledgeError
from suave_des.kb.rule_editor import add_rules, remove_rule, set_enabled
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rdf import SWRL, SWRLB
from suave_des.knowledge.reasoner import Reasoner
from suave_des.knowledge.state import KnowledgeState, ObjectiveState
from suave_des.resources import shipped_folder
from tests.helpers.exemplar_files import write_exemplar_files

SEARCH = "f_generate_search_path"
BATTERY = (
    "Battery: hasQAvalue(?fg, ?q) ^ isQAtype(?q, water_visibility) ^ hasValue(?q, ?v) ^ lessThan(?v, 9.5)"
    " ^ FunctionGrounding(?fg) -> fd_error_log(fd_spiral_low, o_generate_search_path) ^ Role(?q)"
)


@pytest.fixture
def owl(tmp_path: Path) -> Path:
    path = tmp_path / "suave.owl"
    path.write_bytes((shipped_folder("ontology") / "suave.owl").read_bytes())
    return path


def said(path: Path) -> set[tuple[str, str, bool]]:
    return {(rule.name, rule.text, rule.enabled) for rule in Ontology.load([path]).rules}


def as_protege_writes(path: Path) -> None:
    """With a DOCTYPE of entities, CRLF line ends and tabs."""
    text = path.read_text(encoding="utf-8")
    entities = '<!DOCTYPE rdf:RDF [\n    <!ENTITY swrl "http://www.w3.org/2003/11/swrl#" >\n]>\n'
    head, _, rest = text.partition("?>\n")
    rest = rest.replace(
        'rdf:resource="http://www.w3.org/2003/11/swrl#', 'rdf:resource="&swrl;'
    ).replace("    ", "\t")
    path.write_bytes(f"{head}?>\n{entities}{rest}".replace("\n", "\r\n").encode())


def as_rdflib_writes(path: Path) -> None:
    """Flat: lists and atoms are elements of their own, referred to by rdf:nodeID."""
    graph = Graph()
    graph.parse(path, format="xml")
    graph.serialize(path, format="xml", encoding="utf-8")


STYLES = {"shipped": lambda path: None, "Protégé": as_protege_writes, "rdflib": as_rdflib_writes}


@pytest.fixture(scope="module")
def styles(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The shipped suave.owl in each style."""
    path = tmp_path_factory.mktemp("styles") / "suave.owl"
    written = {}
    for style, write in STYLES.items():
        path.write_bytes((shipped_folder("ontology") / "suave.owl").read_bytes())
        write(path)
        written[style] = path.read_bytes()
    return written


@pytest.fixture(params=STYLES)
def styled(request: pytest.FixtureRequest, tmp_path: Path, styles: dict[str, bytes]) -> Path:
    path = tmp_path / "suave.owl"
    path.write_bytes(styles[request.param])
    return path


def test_an_added_rule_is_one_of_the_ontologys(styled):
    before = said(styled)
    add_rules(styled, BATTERY)
    assert said(styled) - before == {("Battery", BATTERY.partition(": ")[2], True)}


def test_adding_a_rule_is_nothing_but_an_insertion(styled):
    original = styled.read_bytes()
    add_rules(styled, BATTERY)
    added = styled.read_bytes()
    pairs = enumerate(zip(original, added, strict=False))
    at = next(place for place, (one, other) in pairs if one != other)
    rest = original[at:]
    assert original[:at] + added[at : len(added) - len(rest)] + rest == added


def test_switching_a_rule_changes_nothing_but_its_mark(styled):
    add_rules(styled, BATTERY)
    (rule,) = (each for each in said(styled) if each[0] == "Battery")
    others = said(styled) - {rule}
    for enabled in (False, True):
        assert set_enabled(styled, "Battery", enabled=enabled)
        assert said(styled) == {*others, (*rule[:2], enabled)}


def test_switching_off_a_rule_that_is_off_changes_nothing(owl):
    add_rules(owl, f"disabled {BATTERY}")
    before = owl.read_bytes()
    assert not set_enabled(owl, "Battery", enabled=False)
    assert owl.read_bytes() == before


def test_removing_an_added_rule_that_was_switched_leaves_the_file_as_it_was(styled):
    original = styled.read_bytes()
    add_rules(styled, BATTERY)
    for enabled in (False, True):
        set_enabled(styled, "Battery", enabled=enabled)
    remove_rule(styled, "Battery")
    assert styled.read_bytes() == original


def test_the_previous_version_is_kept(owl):
    original = owl.read_bytes()
    add_rules(owl, BATTERY)
    assert (owl.parent / "suave.owl.bak").read_bytes() == original


def test_each_previous_version_is_kept_beside_a_file_that_has_its_name(owl):
    original, own = owl.read_bytes(), owl.parent / "suave.owl.bak"
    own.write_text("mine")
    add_rules(owl, BATTERY)
    added = owl.read_bytes()
    remove_rule(owl, "Battery")
    kept = [path.read_bytes() for path in sorted(owl.parent.glob("suave.owl.bak?"))]
    assert (own.read_text(), kept) == ("mine", [original, added])


ONE, TWO = (
    f"{name}: Objective(?o) ^ hasValue({of}, ?v) ^ greaterThan(?v, {number}) -> Role(?o)"
    for name, of, number in (("One", "?q", 1), ("Two", "?x", 2))
)


def test_what_a_rule_that_stays_uses_is_left_by_one_that_goes(styled):
    add_rules(styled, ONE)
    one = styled.read_bytes()
    add_rules(styled, TWO)
    remove_rule(styled, "Two")
    assert styled.read_bytes() == one


def test_each_rule_declares_what_it_uses_so_that_others_can_go(styled):
    add_rules(styled, ONE)
    add_rules(styled, TWO)
    remove_rule(styled, "One")
    graph = Graph().parse(styled, format="xml")
    for iri, kind in (
        ("urn:swrl:var#o", "Variable"),
        ("urn:swrl:var#v", "Variable"),
        (SWRLB + "greaterThan", "Builtin"),
    ):
        assert (URIRef(iri), RDF.type, URIRef(SWRL + kind)) in graph
    assert b"urn:swrl:var#q" not in styled.read_bytes()


def test_rules_may_go_in_the_order_in_which_they_came(styled):
    original = styled.read_bytes()
    add_rules(styled, ONE)
    add_rules(styled, TWO)
    remove_rule(styled, "One")
    remove_rule(styled, "Two")
    assert styled.read_bytes() == original


def test_all_rules_of_a_file_are_added(owl, tmp_path):
    before, rules = said(owl), tmp_path / "mine.swrl"
    rules.write_text(f"{BATTERY}\n\ndisabled Second: Objective(?o) -> Role(?o)\n", encoding="utf-8")
    assert [rule.name for rule in add_rules(owl, str(rules))] == ["Battery", "Second"]
    added = {(name, enabled) for name, _, enabled in said(owl) - before}
    assert added == {("Battery", True), ("Second", False)}


def test_no_rule_of_a_file_is_added_if_one_is_there_already(owl, tmp_path):
    before, rules = owl.read_bytes(), tmp_path / "mine.swrl"
    rules.write_text("Third: Objective(?o) -> Role(?o)\nQAWaterVisibility: Role(?o) -> Role(?o)\n")
    with pytest.raises(KnowledgeError):
        add_rules(owl, str(rules))
    assert owl.read_bytes() == before


def test_of_what_is_added_nothing_stays_in_a_file_whose_rules_are_marked_but_whose_terms_are_declared_elsewhere(
    tmp_path,
):
    """As in the exemplar's mros.owl: neither the mark of its rules nor greaterThan is declared in
    it.
    """
    path = write_exemplar_files(shipped_folder("ontology"), tmp_path)["mros"]
    original = path.read_bytes()
    add_rules(path, "Mine: hasValue(?mine, ?v) ^ greaterThan(?v, 1) -> QAvalue(?mine)")
    remove_rule(path, "Mine")
    assert path.read_bytes() == original


def test_only_the_mark_is_written_when_there_is_none(owl):
    text = owl.read_text(encoding="utf-8")
    mark = next(
        line for line in text.splitlines(keepends=True) if "<swrla:isRuleEnabled rdf" in line
    )
    owl.write_text(text.replace(mark, ""), encoding="utf-8")
    set_enabled(owl, "QAWaterVisibility", enabled=False)
    assert {name for name, _, enabled in said(owl) if not enabled} == {"QAWaterVisibility"}
    written = re.sub(
        r"<swrla:isRuleEnabled xmlns[^>]*>false</swrla:isRuleEnabled>",
        "",
        owl.read_text(encoding="utf-8"),
    )
    assert written == text.replace(mark, "")


def test_an_added_rule_infers_what_it_does_as_text(owl, tmp_path):
    (tmp_path / "mine.swrl").write_text(BATTERY, encoding="utf-8")
    state = KnowledgeState.of(
        [ObjectiveState(SEARCH)],
        groundings={SEARCH: "fd_spiral_high"},
        measurements={"water_visibility": 4},
    )
    as_text = Reasoner(Ontology.load([owl], rules=[tmp_path / "mine.swrl"]), "pellet").analyze(
        state
    )
    add_rules(owl, BATTERY)
    assert Reasoner(Ontology.load([owl]), "pellet").analyze(state).facts == as_text.facts
    assert as_text.values("fd_spiral_low", "fd_error_log") == ("o_generate_search_path",)
    set_enabled(owl, "Battery", enabled=False)
    for backend in ("pellet", "cached"):
        assert not Reasoner(Ontology.load([owl]), backend).analyze(state).facts


def test_rules_without_a_prefix_for_swrl_declare_it(tmp_path):
    path = tmp_path / "tiny.owl"
    path.write_text(
        '<r:RDF xmlns:r="http://www.w3.org/1999/02/22-rdf-syntax-ns#" xmlns:o="http://www.w3.org/2002/07/owl#"'
        ' xmlns:swrl="http://x.org/"><o:Ontology r:about="http://x.org/tiny"/>'
        '<o:Class r:about="http://x.org/#Kläng"/></r:RDF>',
        encoding="utf-8",
    )
    original = set(Graph().parse(path, format="xml"))
    add_rules(path, 'disabled "my rule": Kläng(?ö) -> Kläng(?ö)')
    assert said(path) == {("my rule", "Kläng(?ö) -> Kläng(?ö)", False)}
    set_enabled(path, "my rule", enabled=True)
    assert said(path) == {("my rule", "Kläng(?ö) -> Kläng(?ö)", True)}
    remove_rule(path, "my rule")
    assert set(Graph().parse(path, format="xml")) == original


@pytest.mark.parametrize(
    "edit",
    [
        lambda path: add_rules(path, "A: Objective(?o -> Role(?o)"),
        lambda path: add_rules(path, "A: Objective(?o) -> Role(?p)"),
        lambda path: add_rules(path, "QAWaterVisibility: Objective(?o) -> Role(?o)"),
        lambda path: add_rules(path, ""),
        lambda path: remove_rule(path, "QAWaterVisibilty"),
        lambda path: set_enabled(path, "S1a", enabled=False),
    ],
    ids=[
        "syntax",
        "meaning",
        "its name is there",
        "no rule",
        "no rule to remove",
        "none to switch",
    ],
)
def test_an_edit_that_cannot_be_made_leaves_the_file_alone(owl, edit):
    original = owl.read_bytes()
    with pytest.raises(KnowledgeError):
        edit(owl)
    assert owl.read_bytes() == original
    assert [entry.name for entry in owl.parent.iterdir()] == ["suave.owl"]


@pytest.mark.parametrize(
    "spoil",
    [
        lambda path: path.write_text("<html/>", encoding="utf-8"),
        lambda path: path.write_bytes(path.read_text(encoding="utf-8").encode("utf-16")),
        lambda path: path.unlink(),
        lambda path: path.write_text("@prefix : <http://x.org/#> . :a :b :c .", encoding="utf-8"),
    ],
    ids=["page", "utf-16", "missing", "another format"],
)
def test_files_that_cannot_be_edited(owl, spoil):
    spoil(owl)
    original = owl.read_bytes() if owl.exists() else None
    for edit in (
        lambda: add_rules(owl, BATTERY),
        lambda: remove_rule(owl, "QAWaterVisibility"),
        lambda: set_enabled(owl, "QAWaterVisibility", enabled=False),
    ):
        with pytest.raises(InputError) as caught:
            edit()
        assert "\n" not in str(caught.value)
    assert (owl.read_bytes() if owl.exists() else None) == original


def test_an_edited_file_keeps_its_permissions(owl):
    owl.chmod(0o640)
    set_enabled(owl, "QAWaterVisibility", enabled=False)
    assert stat.S_IMODE(owl.stat().st_mode) == 0o640


def test_a_link_to_the_edited_file_stays_one(owl):
    link = owl.parent / "link.owl"
    link.symlink_to(owl)
    set_enabled(link, "QAWaterVisibility", enabled=False)
    assert link.is_symlink()
    assert {name for name, _, enabled in said(owl) if not enabled} == {"QAWaterVisibility"}


def test_a_rule_that_shares_its_line_leaves_the_rest_of_the_line(owl):
    head, end, tail = owl.read_bytes().partition(b"</rdf:RDF>")
    add_rules(owl, BATTERY)
    rule = owl.read_bytes().removeprefix(head).removesuffix(end + tail).strip()
    owl.write_bytes(head.rstrip() + rule + b"\n" + end + tail)
    remove_rule(owl, "Battery")
    assert owl.read_bytes() == head.rstrip() + b"\n" + end + tail


def test_of_rules_that_share_a_name_all_are_switched_if_one_is_otherwise(owl, tmp_path):
    rules = tmp_path / "mine.swrl"
    rules.write_text("disabled Same: Objective(?o) -> Role(?o)\nSame: Role(?o) -> Objective(?o)\n")
    add_rules(owl, str(rules))
    assert set_enabled(owl, "Same", enabled=True)
    assert [enabled for name, _, enabled in said(owl) if name == "Same"] == [True, True]
