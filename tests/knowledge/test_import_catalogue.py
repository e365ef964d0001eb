"""Imports resolve to local files, whichever files were given and in whichever order; nothing is
fetched.
"""

import itertools

import pytest

from suave_des.errors import KnowledgeError
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.reasoner import Reasoner
from tests.helpers.exemplar_files import MROS_IMPORT, write_exemplar_files
from tests.helpers.knowledge_states import MOTION, SEARCH, searching

IMPORT = "https://raw.githubusercontent.com/meta-control/mc_mdl_tomasys/ros2/owl/tomasys.owl"
STORY = [
    searching(None, 2.3, status="UNGROUNDED"),
    searching("fd_spiral_high", 3.3),
    searching("fd_spiral_high", 1.3),
    searching("fd_spiral_low", 1.0),
    searching(
        "fd_spiral_low", 1.5, motion="fd_all_thrusters", components={"c_thruster_1": "FALSE"}
    ),
    searching(
        "fd_spiral_low", 1.5, motion="fd_recover_thrusters", components={"c_thruster_1": "FALSE"}
    ),
    searching(
        "fd_spiral_low",
        1.5,
        motion="fd_recover_thrusters",
        components={"c_thruster_1": "RECOVERED"},
    ),
]


def decisions(reasoner: Reasoner) -> list[dict[str, str | None]]:
    plans = [reasoner.plan(reasoner.analyze(state)) for state in STORY]
    return [{d.function: d.design for d in one.decisions} for one in plans]


@pytest.mark.parametrize("oldest", [False, True])
def test_the_exemplars_three_files_decide_as_the_shipped_two(kb, pellet, shipped, tmp_path, oldest):
    files = write_exemplar_files(shipped, tmp_path / "owl", oldest=oldest)
    base = Ontology.load(list(files.values()))
    assert set(base.files) == set(files.values())
    assert len(base.rules) == len(kb.rules)
    found = decisions(Reasoner(base, "pellet"))
    assert found == decisions(pellet)
    assert found[4] == {MOTION: "fd_recover_thrusters"}
    assert found[6] == {MOTION: "fd_all_thrusters", SEARCH: "fd_spiral_low"}


def test_the_order_of_files_does_not_matter_and_those_beside_are_found(shipped, tmp_path):
    files = write_exemplar_files(shipped, tmp_path / "owl")
    given = [
        *itertools.permutations(files.values()),
        (files["suave"],),
        (files["suave"], files["tomasys"]),
    ]
    bases = [Ontology.load(one) for one in given]
    assert {base.files for base in bases} == {tuple(sorted(files.values()))}
    assert len({base.content_hash for base in bases}) == 1


def test_a_given_file_wins_over_the_one_beside_and_that_over_the_shipped(
    suave_copy, shipped, tmp_path
):
    path = suave_copy()
    assert set(Ontology.load([path]).files) == {path, shipped / "tomasys.owl"}
    beside = path.with_name("tomasys.owl")
    beside.write_bytes((shipped / "tomasys.owl").read_bytes() + b"<!-- beside -->")
    assert set(Ontology.load([path]).files) == {path, beside}
    given = tmp_path / "elsewhere" / "tomasys.owl"
    given.parent.mkdir()
    given.write_bytes((shipped / "tomasys.owl").read_bytes() + b"<!-- given -->")
    assert set(Ontology.load([path, given]).files) == {path, given}


@pytest.mark.parametrize(
    "iri",
    [
        "http://metacontrol.org/tomasys",
        "http://metacontrol.org/tomasys#",
        MROS_IMPORT,
        "http://ros/mros#",
    ],
)
def test_known_iris_resolve_to_the_shipped_files(suave_copy, shipped, iri):
    path = suave_copy(replace={IMPORT: iri})
    assert set(Ontology.load([path]).files) == {path, shipped / "tomasys.owl"}


def test_an_unknown_import_is_an_error_with_file_and_line(suave_copy):
    path = suave_copy(replace={IMPORT: "http://example.org/wind.owl"})
    with pytest.raises(KnowledgeError) as error:
        Ontology.load([path])
    assert str(error.value).startswith(
        f"{path}: line 15: import http://example.org/wind.owl does not resolve"
    )


def test_import_cycles_end(suave_copy, shipped, kb):
    path = suave_copy()
    text = (shipped / "tomasys.owl").read_text(encoding="utf-8")
    ontology = '<owl:Ontology rdf:about="http://metacontrol.org/tomasys">'
    assert ontology in text
    cycle = ontology + '<owl:imports rdf:resource="http://www.metacontrol.org/suave"/>'
    path.with_name("tomasys.owl").write_text(text.replace(ontology, cycle), encoding="utf-8")
    for name in ("suave.owl", "tomasys.owl"):
        assert len(Ontology.load([path.with_name(name)]).rules) == len(kb.rules)


def test_a_file_given_twice_counts_once_and_two_versions_of_one_ontology_are_refused(
    suave_copy, shipped
):
    path = suave_copy("<!-- mine -->")
    assert set(Ontology.load([path, path, path.parent / "." / path.name]).files) >= {path}
    with pytest.raises(KnowledgeError, match="supplies the ontology"):
        Ontology.load([path, shipped / "suave.owl"])


def test_an_ontology_of_ones_own_may_add_to_the_shipped_ones(tmp_path, shipped):
    path = tmp_path / "mine.owl"
    path.write_text(
        '<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#" '
        'xmlns:owl="http://www.w3.org/2002/07/owl#" xmlns:tomasys="http://metacontrol.org/tomasys#" '
        'xml:base="http://example.org/mine"><owl:Ontology rdf:about="">'
        '<owl:imports rdf:resource="http://www.metacontrol.org/suave"/></owl:Ontology>'
        '<tomasys:FunctionDesign rdf:ID="fd_zigzag"><tomasys:solvesF '
        'rdf:resource="http://www.metacontrol.org/suave#f_generate_search_path"/></tomasys:FunctionDesign></rdf:RDF>'
    )
    base = Ontology.load([path])
    assert "fd_zigzag" in base.designs(SEARCH)
    assert set(base.files) == {path, shipped / "suave.owl", shipped / "tomasys.owl"}
    assert Reasoner(base, "pellet").analyze(searching("fd_zigzag")).facts == frozenset()
