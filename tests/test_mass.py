"""The package keeps within its budgets of tokens, and nothing new stands above a ceiling."""

import ast
import re
import textwrap
from functools import cache
from pathlib import Path

import pytest

from tests import measure

ROOT = Path(__file__).parents[1]
ROW = re.compile(r"^\| `(suave_des[\w/]*)` \| ([\d,]+) \|$", flags=re.MULTILINE)
CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
BUDGETS = {place: int(tokens.replace(",", "")) for place, tokens in ROW.findall(CONTRIBUTING)}


tokens_of = cache(measure.tokens_of)
"""Counts them once for a package and for what it is in."""


@pytest.mark.parametrize("place", measure.places())
def test_within_its_budget_of_tokens(place):
    tokens = sum(map(tokens_of, measure.files_of(place)))
    assert tokens <= BUDGETS[place], f"{place} has {tokens:,} tokens; see Budgets in CONTRIBUTING"


@pytest.fixture(scope="module")
def present() -> list[measure.Excess]:
    return list(measure.present())


def test_nothing_above_a_ceiling_that_was_not_before(present):
    most = {(each.kind, each.place): each.amount for each in measure.recorded()}
    grown = [each for each in present if each.amount > most.get((each.kind, each.place), 0)]
    assert not grown


def test_the_baseline_holds_nothing_that_is_gone_or_smaller(present):
    """After something has become simpler: python tests/measure.py --baseline."""
    assert set(measure.recorded()) <= set(present)


def function(source: str) -> measure.Function:
    (_, found), *_ = measure.functions_of(ast.parse(textwrap.dedent(source)))
    return found


@pytest.mark.parametrize(
    ("body", "ways"),
    [
        ("return a", 1),
        ("return a if b else c", 2),
        ("return a and b or c", 3),
        ("return [x for x in a if x if b]", 4),
        ("for x in a:\n        assert x", 3),
        ("match a:\n        case 1:\n            pass\n        case _:\n            pass", 2),
    ],
)
def test_complexity_counts_as_radon_does(body, ways):
    assert measure.complexity(function(f"def f(a, b, c):\n    {body}\n")) == ways


def test_a_function_inside_is_counted_by_itself():
    outer = function(
        """
        def outer(a):
            def inner(b):
                return 1 if b else 2
            return inner(a)
        """
    )
    assert measure.complexity(outer) == 1


@pytest.mark.parametrize(
    ("statement", "form"),
    [
        ("x = a if b else c if d else e", "chained conditional"),
        ("x = [y for y in [z for z in a]]", "nested comprehension"),
        ("x, y = a, b", "unlike assignment"),
    ],
)
def test_statements_that_say_several_things_are_found(statement, form):
    found = measure.forms(function(f"def f():\n    {statement}\n"))
    assert {kind for kind, amount in found.items() if amount} == {form}


@pytest.mark.parametrize("statement", ["x, y = y, x", "x, y = a", "x = a if b else c"])
def test_statements_that_say_one_thing_are_not(statement):
    assert not any(measure.forms(function(f"def f():\n    {statement}\n")).values())


def test_only_code_has_mass(tmp_path):
    plain, spread = tmp_path / "plain.py", tmp_path / "spread.py"
    plain.write_text("x = f(1, 2)\n", encoding="utf-8")
    spread.write_text('"""A docstring."""\n\n# why\nx = f(\n    1, 2\n)  # so\n', encoding="utf-8")
    assert measure.tokens_of(plain) == measure.tokens_of(spread) == 8


@pytest.mark.parametrize(
    ("name", "text", "tokens"),
    [("a.js", "// why\nlet x = 1;\n", 5), ("a.css", "/* why */\np { margin: 0 }\n", 6)],
)
def test_what_a_page_needs_has_mass(tmp_path, name, text, tokens):
    (tmp_path / name).write_text(text, encoding="utf-8")
    assert measure.tokens_of(tmp_path / name) == tokens


def test_a_formatted_text_is_one_token_in_each_python():
    assert len(measure.said_in("x = f'{a} and {f\"{b!r:>{c}}\"}' + 'd'\n")) == 5
