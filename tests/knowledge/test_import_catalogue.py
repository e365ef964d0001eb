"""Imports resolve to local files, whichever files were given and in whichever order; nothing is
fetched.
"""

import itertools
from pathlib import Path

import pytest

from suave_des.errors import KnowledgeError
from suave_des.knowledge.checks import static_findings
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.reasoner import Reasoner
from suave_des.knowledge.resolver import as_written, collect
from tests.helpers.checks import subject
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
def test_the_exemplars_three_files_decide_as_the_shipped_ones(
    kb, pellet, shipped, tmp_path, oldest
):
    files = write_exemplar_files(shipped, tmp_path / "owl", oldest=oldest)
    base = Ontology.load(list(files.values()))
    assert set(base.files) == set(files.values())
    assert len(base.rules) == len(kb.rules)
    found = decisions(Reasoner(base, "pellet"))
    assert found == decisions(pellet)
    assert found[4] == {MOTION: "fd_recover_thrusters"}
    assert found[6] == {MOTION: "fd_all_thrusters", SEARCH: "fd_spiral_low"}


@pytest.fixture(scope="module")
def exemplar(shipped, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return write_exemplar_files(shipped, tmp_path_factory.mktemp("exemplar") / "owl")


@pytest.fixture(scope="module")
def all_given(exemplar) -> Ontology:
    return Ontology.load(list(exemplar.values()))


@pytest.mark.parametrize("order", list(itertools.permutations(range(3)))[1:])
def test_the_order_of_files_does_not_matter(exemplar, all_given, order):
    files = list(exemplar.values())
    assert Ontology.load([files[place] for place in order]).content_hash == all_given.content_hash


@pytest.mark.parametrize("names", [("suave",), ("suave", "tomasys")])
def test_files_beside_those_given_are_found(exemplar, all_given, names):
    found = Ontology.load([exemplar[name] for name in names])
    assert found.files == all_given.files == tuple(sorted(exemplar.values()))
    assert found.content_hash == all_given.content_hash


def test_an_import_that_is_not_beside_is_a_shipped_file(suave_copy, shipped):
    path = suave_copy()
    assert set(Ontology.load([path]).files) == {path, shipped / "tomasys.owl", shipped / "mros.owl"}


@pytest.fixture
def beside(suave_copy, shipped) -> tuple[Path, Path]:
    """A copy of suave.owl, and one of tomasys.owl beside it."""
    path = suave_copy()
    imported = path.with_name("tomasys.owl")
    imported.write_bytes((shipped / "tomasys.owl").read_bytes() + b"<!-- beside -->")
    return path, imported


def test_a_file_beside_wins_over_the_shipped_one(beside, shipped):
    path, imported = beside
    assert set(Ontology.load([path]).files) == {path, imported, shipped / "mros.owl"}


def test_a_given_file_wins_over_the_one_beside(beside, shipped, tmp_path):
    path, _ = beside
    given = tmp_path / "elsewhere" / "tomasys.owl"
    given.parent.mkdir()
    given.write_bytes((shipped / "tomasys.owl").read_bytes() + b"<!-- given -->")
    assert set(Ontology.load([path, given]).files) == {path, given, shipped / "mros.owl"}


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
    assert set(Ontology.load([path]).files) == {path, shipped / "tomasys.owl", shipped / "mros.owl"}


def test_import_cycles_end(suave_copy, shipped, kb):
    path = suave_copy()
    text = (shipped / "tomasys.owl").read_text(encoding="utf-8")
    ontology = '<owl:Ontology rdf:about="http://metacontrol.org/tomasys">'
    assert ontology in text
    cycle = ontology + '<owl:imports rdf:resource="http://www.metacontrol.org/suave"/>'
    path.with_name("tomasys.owl").write_text(text.replace(ontology, cycle), encoding="utf-8")
    for name in ("suave.owl", "tomasys.owl"):
        assert len(Ontology.load([path.with_name(name)]).rules) == len(kb.rules)


def test_a_file_given_twice_counts_once(suave_copy):
    path = suave_copy("<!-- mine -->")
    assert set(Ontology.load([path, path, path.parent / "." / path.name]).files) >= {path}


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
    assert set(base.files) == {
        path,
        *(shipped / f"{name}.owl" for name in ("suave", "tomasys", "mros")),
    }
    assert Reasoner(base, "pellet").analyze(searching("fd_zigzag")).facts == frozenset()


def written(path, iri, *imports, base=None, inside=""):
    """Write an ontology without anything but its imports."""
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = "".join(f'<owl:imports rdf:resource="{each}"/>\n' for each in imports)
    path.write_text(
        '<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"\n'
        f'xmlns:owl="http://www.w3.org/2002/07/owl#"{f" xml:base={base!r}" if base else ""}>\n'
        f'<owl:Ontology rdf:about="{iri}">\n{lines}</owl:Ontology>{inside}</rdf:RDF>',
        encoding="utf-8",
    )
    return path


def reasons(*given):
    return {
        (each.importing.name, each.iri): (each.file, each.reason)
        for each in collect(given).supplies
    }


LIB = "http://example.org/lib"


def test_an_importing_file_does_not_supply_its_own_import(tmp_path):
    """Its xml:base, or the last part of its name, may well be that of what it imports."""
    app = written(tmp_path / "lib.owl", "http://example.org/app/lib", LIB, base=LIB)
    lib = written(tmp_path / "other.owl", LIB)
    found = reasons(app)
    assert found["lib.owl", LIB] == (lib, "by its IRI, beside the importing file")


def test_an_iri_wins_over_a_name(tmp_path):
    app = written(tmp_path / "app.owl", "http://example.org/app", LIB)
    same_name = written(tmp_path / "elsewhere" / "lib.owl", "http://example.com/lib")
    beside = written(tmp_path / "renamed.owl", LIB)
    assert reasons(app, same_name)["app.owl", LIB][0] == beside


def test_names_with_dots_are_whole_names(tmp_path):
    iri = "http://example.org/lib-v1.2"
    app = written(tmp_path / "app.owl", "http://example.org/app", iri)
    written(tmp_path / "lib-v1.owl", "http://example.com/old")
    lib = written(tmp_path / "lib-v1.2.owl", "http://example.com/new")
    assert reasons(app)["app.owl", iri] == (lib, "by its name, beside the importing file")


def test_relative_paths_are_relative_to_the_file(tmp_path):
    app = written(tmp_path / "app.owl", "http://example.org/app", "sub/lib.owl")
    lib = written(tmp_path / "sub" / "lib.owl", LIB)
    ((_, iri),) = reasons(app)
    assert as_written(iri) == "sub/lib.owl"
    assert reasons(app)["app.owl", iri] == (lib, "by its path")


def importing(folder: Path, ending: str) -> Path:
    """An ontology in a notation that imports a file of a folder beside its own."""
    relative = CLIMBING.format(ending)
    app = written(folder / "model" / "app.owl", "http://example.org/app", relative)
    if ending == "ttl":
        app = app.with_suffix(".ttl")
        app.write_text(
            "@prefix owl: <http://www.w3.org/2002/07/owl#> .\n"
            f"<http://example.org/app> a owl:Ontology ; owl:imports <{relative}> .\n"
        )
    return app


CLIMBING = "../my%20libs/lib.v2.{}#"
"""A relative path out of the folder, with a space, dots, and a mark at its end."""


@pytest.mark.parametrize("ending", ["owl", "ttl"])
def test_a_relative_path_may_lead_out_of_the_folder(tmp_path, ending):
    """A shared folder of ontologies beside that of the model."""
    app = importing(tmp_path, ending)
    lib = written(tmp_path / "my libs" / "lib.v2.owl", LIB)
    if ending == "ttl":
        lib = lib.with_suffix(".ttl")
        lib.write_text(f"<{LIB}> a <http://www.w3.org/2002/07/owl#Ontology> .\n")
    ((supplied, reason),) = reasons(app).values()
    assert (supplied.resolve(), reason) == (lib, "by its path")


@pytest.mark.parametrize(
    "iri",
    [
        "http://example.org/wind.owl",
        "sub/lib.owl",
        "a" * 400 + ".owl",
        "file:///" + "a" * 400,
        "file:gone/lib.owl",
    ],
)
def test_an_import_that_no_file_supplies_is_told_as_written_with_its_place(tmp_path, iri):
    app = written(tmp_path / "app.owl", "http://example.org/app", iri)
    with pytest.raises(KnowledgeError) as error:
        collect([app])
    assert (error.value.file, error.value.place) == (str(app), "line 4")
    assert error.value.problem.startswith(f"import {iri} does not resolve")


@pytest.mark.parametrize("ending", ["owl", "ttl"])
def test_a_path_that_leads_out_of_the_folder_to_no_file_is_told_as_written(tmp_path, ending):
    with pytest.raises(KnowledgeError) as error:
        collect([importing(tmp_path, ending)])
    assert error.value.problem.startswith(f"import {CLIMBING.format(ending)} does not")


def test_links_in_a_circle_beside_are_nobodys_input(tmp_path):
    app = written(tmp_path / "app.owl", "http://example.org/app", LIB)
    lib = written(tmp_path / "lib.owl", LIB)
    (tmp_path / "circle.owl").symlink_to("circle.owl")
    assert reasons(app)["app.owl", LIB][0] == lib


def test_file_urls_are_read(tmp_path):
    lib = written(tmp_path / "sub folder" / "lib.owl", LIB)
    app = written(tmp_path / "app.owl", "http://example.org/app", lib.as_uri())
    assert reasons(app)["app.owl", lib.as_uri()] == (lib, "by its path")


CATALOG = """<?xml version="1.0" encoding="UTF-8" standalone="no"?>
<catalog prefer="public" xmlns="urn:oasis:names:tc:entity:xmlns:xml:catalog">
    <group id="Folder Repository"><uri id="x" name="{iri}" uri="{uri}"/></group>
</catalog>
"""


def test_the_catalog_of_protege_wins_over_any_other_file(tmp_path):
    tomasys = "http://metacontrol.org/tomasys"
    app = written(tmp_path / "app.owl", "http://example.org/app", tomasys)
    mine = written(tmp_path / "sub" / "my%20own.owl", "http://example.org/mine")
    mine = mine.rename(tmp_path / "sub" / "my own.owl")
    written(tmp_path / "tomasys.owl", "http://example.org/tomasys")
    catalog = CATALOG.format(iri=tomasys, uri="sub/my%20own.owl")
    (tmp_path / "catalog-v001.xml").write_text(catalog, encoding="utf-8")
    assert reasons(app)["app.owl", tomasys] == (mine, "by catalog-v001.xml")


def test_a_catalog_that_names_a_missing_file_is_passed_over(tmp_path):
    app = written(tmp_path / "app.owl", "http://example.org/app", LIB)
    lib = written(tmp_path / "lib.owl", LIB)
    catalog = CATALOG.format(iri=LIB, uri="gone.owl")
    (tmp_path / "catalog-v001.xml").write_text(catalog, encoding="utf-8")
    assert reasons(app)["app.owl", LIB][0] == lib


@pytest.mark.parametrize("uri", ["http://[half", "a" * 400])
def test_a_catalog_with_entries_that_are_no_files_is_passed_over(tmp_path, uri):
    app = written(tmp_path / "app.owl", "http://example.org/app", LIB)
    lib = written(tmp_path / "lib.owl", LIB)
    catalog = CATALOG.format(iri=LIB, uri=uri)
    (tmp_path / "catalog-v001.xml").write_text(catalog, encoding="utf-8")
    assert reasons(app)["app.owl", LIB][0] == lib


def test_a_group_of_the_catalog_has_its_own_base(tmp_path):
    app = written(tmp_path / "app.owl", "http://example.org/app", LIB)
    lib = written(tmp_path / "sub" / "mine.owl", "http://example.org/mine")
    catalog = CATALOG.format(iri=LIB, uri="mine.owl").replace("<group ", '<group xml:base="sub/" ')
    (tmp_path / "catalog-v001.xml").write_text(catalog, encoding="utf-8")
    assert reasons(app)["app.owl", LIB] == (lib, "by catalog-v001.xml")


def test_damaged_files_beside_are_nobodys_input(tmp_path):
    app = written(tmp_path / "app.owl", "http://example.org/app", "http://ros/mros")
    (tmp_path / "old.owl").write_text("about http://ros/mros, and no XML", encoding="utf-8")
    assert reasons(app)["app.owl", "http://ros/mros"][1] == "shipped"


@pytest.mark.parametrize("order", [(IMPORT, MROS_IMPORT), (MROS_IMPORT, IMPORT)])
def test_the_order_of_imports_does_not_matter(tmp_path, shipped, order):
    app = written(tmp_path / "app.owl", "http://example.org/app", *order)
    files = {each.path for each in collect([app]).files}
    assert files == {app, shipped / "tomasys.owl", shipped / "mros.owl"}


def test_terms_of_mros_come_only_with_it(tmp_path, shipped):
    """A model of one's own may have an `energy` of its own."""
    energy = (
        '<rdf:Description rdf:about="http://example.org/app#energy"><rdf:type '
        'rdf:resource="http://metacontrol.org/tomasys#QualityAttributeType"/></rdf:Description>'
    )
    app = written(tmp_path / "app.owl", "http://example.org/app", IMPORT, inside=energy)
    base = Ontology.load([app])
    assert set(base.files) == {app, shipped / "tomasys.owl"}
    assert base.model.attributes == {"energy": "http://example.org/app#energy"}


def test_files_that_use_mros_through_tomasys_alone_still_have_it(suave_copy, shipped):
    """Until version 1.0 the shipped tomasys.owl held the terms of mros."""
    path = suave_copy(replace={f'<owl:imports rdf:resource="{MROS_IMPORT}"/>': ""})
    found = collect([path])
    assert {each.path for each in found.files} == {
        path,
        shipped / "tomasys.owl",
        shipped / "mros.owl",
    }
    assert found.supplies[-1].reason.endswith("its terms are used without an import")


def test_rules_that_two_files_share_count_once(suave_copy, shipped, tmp_path, kb):
    """As with an older tomasys.owl, which holds the rules of mros, beside mros.owl."""
    text = (shipped / "tomasys.owl").read_text(encoding="utf-8")
    rules = (shipped / "mros.owl").read_text(encoding="utf-8").partition("// Rules")[2]
    rules = rules[rules.index("<rdf:Description") :]
    path = suave_copy()
    older = path.with_name("tomasys.owl")
    older.write_text(text.replace("</rdf:RDF>", rules), encoding="utf-8")
    base = Ontology.load([path])
    assert older in base.files
    assert [rule.name for rule in base.rules] == [rule.name for rule in kb.rules]


def test_kb_check_tells_which_file_supplies_an_import(tmp_path):
    given = subject(tmp_path)
    findings = static_findings(given, collect(given.ontologies))
    (note,) = [each for each in findings if each.message.startswith("imports: ")]
    assert note.file == str(tmp_path / "suave.owl")
    assert note.message == (
        f"imports: {IMPORT} is shipped/ontology/tomasys.owl (shipped); "
        f"{MROS_IMPORT} is shipped/ontology/mros.owl (shipped)"
    )
