"""Results stay the same, to the byte, unless CHANGELOG.md says that they change."""

import json

import pytest

from tests.golden.golden import FILE, QUICK, SLOW, made

EXPECTED = json.loads(FILE.read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    "name", [*QUICK, *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW)]
)
def test_results_are_as_before(name):
    assert made((QUICK | SLOW)[name]) == EXPECTED[name]
