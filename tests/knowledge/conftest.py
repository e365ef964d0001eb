"""What the tests of the knowledge room share: the shipped ontologies, edited copies, states, and no
network.
"""

import socket
from pathlib import Path

import pytest

from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.reasoner import Reasoner
from suave_des.resources import shipped_folder


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
