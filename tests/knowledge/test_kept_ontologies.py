"""What ontology files state is kept between processes; it is always what the file states now."""

import os
from pathlib import Path

import pytest

from suave_des.caches import SharedEntries
from suave_des.knowledge import ontology_file
from suave_des.knowledge.ontology_file import OntologyFile, read_ontology
from suave_des.resources import find
from tests.helpers.command import python

STATED = ("iris", "is_xml", "base", "imports", "triples")
MISSION = """
import sys
from suave_des import load_scenario
from suave_des.simulation.simulator import Simulator
print(Simulator(load_scenario("seams2023")).run("metacontrol", 1, 1).metrics)
print({"rdflib", "jpype"} & set(sys.modules))
"""


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache folder."""
    monkeypatch.setenv("SUAVE_DES_CACHE_DIR", str(tmp_path / "cache"))
    return tmp_path / "cache" / "ontologies"


@pytest.fixture
def copied(tmp_path: Path) -> Path:
    path = tmp_path / "mine.owl"
    path.write_bytes(find("suave.owl", "ontology").read_bytes())
    return path


def read_anew(path: Path) -> OntologyFile:
    """Read a file as a new process does."""
    ontology_file._read.cache_clear()
    return read_ontology(path)


def stated(file: OntologyFile) -> list[object]:
    return [getattr(file, name) for name in STATED]


@pytest.mark.parametrize("name", ["suave.owl", "mros.owl", "tomasys.owl", "suave_extended.owl"])
def test_what_is_kept_is_what_was_parsed(cache, name):
    path = find(name, "ontology")
    first, second = read_anew(path), read_anew(path)
    assert stated(second) == stated(first)
    assert [type(value) for _, _, value in second.triples] == [
        type(value) for _, _, value in first.triples
    ]
    assert len(list(cache.iterdir())) == 1


def test_the_graph_of_what_was_kept_has_all_that_it_states(cache, copied):
    first, second = read_anew(copied), read_anew(copied)
    assert set(second.graph) == set(first.graph)
    assert len(second.graph) == len(second.triples)


def test_a_changed_file_is_parsed_anew(cache, copied):
    before = read_anew(copied)
    copied.write_text(copied.read_text().replace("fd_spiral_high", "fd_spiral_top"))
    after = read_anew(copied)
    assert any("fd_spiral_top" in subject for subject, _, _ in after.triples)
    assert not any("fd_spiral_top" in subject for subject, _, _ in before.triples)


def test_content_under_another_name_is_parsed_anew(cache, tmp_path):
    text = "<http://x.org/a> a <http://www.w3.org/2002/07/owl#Ontology> ."
    paths = [tmp_path / "a.ttl", tmp_path / "b.ttl"]
    for path in paths:
        path.write_text(text + " <#c> <#d> <#e> .")
    one, other = map(read_anew, paths)  # relative names begin with the file's
    assert {s for s, _, _ in one.triples} != {s for s, _, _ in other.triples}


def test_a_file_whose_name_is_not_utf_8_is_read(cache, copied):
    path = copied.with_name(os.fsdecode(b"mine\xff.owl"))
    copied.rename(path)
    assert stated(read_anew(path)) == stated(read_anew(path))


def test_two_halves_of_a_surrogate_pair_stay_two(cache, tmp_path):
    path = tmp_path / "a.ttl"
    path.write_text(
        '<http://x.org/a> a <http://www.w3.org/2002/07/owl#Ontology> ; <#label> "\\uD83D\\uDE00" .'
    )
    assert stated(read_anew(path)) == stated(read_anew(path))


def test_characters_of_all_alphabets_are_kept(cache, tmp_path):
    path = tmp_path / "a.ttl"
    path.write_text(
        '<http://x.org/é> a <http://www.w3.org/2002/07/owl#Ontology> ; <#label> "深い 😀"@ja .'
    )
    assert stated(read_anew(path)) == stated(read_anew(path))
    assert len(list(cache.iterdir())) == 1


def test_what_is_damaged_is_parsed_anew(cache, copied):
    whole = stated(read_anew(copied))
    (kept,) = cache.iterdir()
    kept.write_bytes(kept.read_bytes().replace(b"fd_spiral_high", b"fd_spiral_HIGH"))
    assert stated(read_anew(copied)) == whole


def test_what_other_programs_made_of_it_is_not_used(cache, copied, monkeypatch):
    whole = stated(read_anew(copied))
    (kept,) = cache.iterdir()
    wrong = ["[]", True, None, [], []]
    SharedEntries(cache, kept.stem).add("", wrong)
    ontology_file._programs.cache_clear()
    monkeypatch.setattr(ontology_file, "hash_of_code", lambda folder: "another")
    assert stated(read_anew(copied)) == whole
    ontology_file._programs.cache_clear()


def test_a_mission_whose_inferences_are_known_loads_neither_rdflib_nor_java():
    first, second = (python("-c", MISSION).stdout.split("\n") for _ in range(2))
    assert first[0] == second[0]
    assert second[1] == "set()"
