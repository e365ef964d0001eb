"""What the tests of `kb` share: one knowledge base, edited copies, and the command line."""

from functools import partial

import pytest

from suave_des.kb.knowledge_base import KnowledgeBase
from tests.helpers.knowledge_states import FEWER_NUMBERS


@pytest.fixture(scope="session")
def knowledge():
    return KnowledgeBase.load()


@pytest.fixture(scope="session")
def small():
    """The shipped knowledge base with fewer ranges of measured values, for what goes through all of
    them.
    """
    return KnowledgeBase.load(values=FEWER_NUMBERS)


@pytest.fixture
def command(command):
    """Runs `suave-des kb ...` in this process: (status, output, errors)."""
    return partial(command, "kb")
