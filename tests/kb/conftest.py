"""What the tests of `kb` share: one knowledge base, edited copies, and the command line."""

from __future__ import annotations

import pytest

from suave_des.cli.main import main
from suave_des.kb import KnowledgeBase
from suave_des.resources import shipped_folder
from tests.helpers.knowledge_states import FEWER_NUMBERS


@pytest.fixture(scope="session")
def knowledge():
    return KnowledgeBase.load()


@pytest.fixture(scope="session")
def small():
    """The shipped knowledge base with fewer ranges of measured values, for what goes through all of them."""
    return KnowledgeBase.load(values=FEWER_NUMBERS)


@pytest.fixture
def edited(tmp_path):
    """A copy of the shipped suave.owl with things added at its end."""

    def make(extra, name="suave.owl"):
        text = (shipped_folder("ontology") / "suave.owl").read_text(encoding="utf-8")
        path = tmp_path / name
        path.write_text(text.replace("</rdf:RDF>", extra + "</rdf:RDF>"), encoding="utf-8")
        return path

    return make


@pytest.fixture
def command(capsys):
    """Runs `suave-des kb ...` in this process: (status, output, errors)."""

    def run(*arguments):
        with pytest.raises(SystemExit) as end:
            main(["kb", *map(str, arguments)])
        said = capsys.readouterr()
        return int(end.value.code or 0), said.out, said.err

    return run
