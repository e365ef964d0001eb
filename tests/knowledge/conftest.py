"""What the tests of the knowledge room share: the shipped ontologies, edited copies, states, and no network."""

from __future__ import annotations

import socket
from collections.abc import Mapping
from pathlib import Path

import pytest

from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.reasoner import Reasoner
from suave_des.resources import shipped_folder
from tests.helpers.owl_text import MakeOntology


@pytest.fixture(autouse=True)
def no_network(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("something tried to reach the network")

    monkeypatch.setattr(socket.socket, "connect", refuse)
    monkeypatch.setattr(socket, "getaddrinfo", refuse)


@pytest.fixture(scope="session")
def shipped() -> Path:
    return shipped_folder("ontology")


@pytest.fixture(scope="session")
def kb() -> Ontology:
    return Ontology.load()


@pytest.fixture(scope="session")
def pellet(kb: Ontology) -> Reasoner:
    return Reasoner(kb, "pellet")


@pytest.fixture
def suave_copy(tmp_path: Path, shipped: Path) -> MakeOntology:
    """A copy of the shipped suave.owl in a folder of its own, with text replaced and individuals added."""

    def make(extra: str = "", replace: Mapping[str, str] | None = None, name: str = "suave.owl") -> Path:
        text = (shipped / "suave.owl").read_text(encoding="utf-8")
        for old, new in (replace or {}).items():
            assert old in text, f"{old!r} is not in the shipped suave.owl"
            text = text.replace(old, new)
        path = tmp_path / name
        path.write_text(text.replace("</rdf:RDF>", extra + "</rdf:RDF>"), encoding="utf-8")
        return path

    return make
