"""Names of managers as a paper's readers are to see them."""

from pathlib import Path

import pytest

from tests.helpers.command import command_here

PUBLISHED = Path(__file__).parents[2] / "scenarios" / "published" / "seams2023_runs.csv"


@pytest.mark.parametrize("form", ["table", "csv", "markdown", "latex"])
def test_a_label_stands_wherever_the_name_did_and_nothing_else_changes(tmp_path, form):
    asked = ("compare", str(PUBLISHED), "--format", form)
    plain = command_here(*asked, "--managers", "none,metacontrol", cwd=tmp_path).stdout
    labelled = command_here(
        *asked, "--label", "metacontrol=mros-system", "--managers", "none,mros-system", cwd=tmp_path
    ).stdout
    assert "mros-system" in labelled and "metacontrol" not in labelled
    assert labelled.replace("mros-system", "metacontrol") == plain


def test_figures_take_them_too(tmp_path):
    asked = ("figure", str(PUBLISHED), "--out", "f.svg", "--label", "metacontrol=MROS")
    assert command_here(*asked, cwd=tmp_path).returncode == 0
    assert "MROS" in (tmp_path / "f.svg").read_text()


@pytest.mark.parametrize(
    ("label", "problem"),
    [
        ("none", "--label: 'none' is no NAME=TEXT"),
        ("=x", "is no NAME=TEXT"),
        ("none= ", "is no NAME=TEXT"),
        ("non=x", "there is no mission of 'non' (did you mean 'none'?"),
        ("none=random", "several managers would be shown as 'random'"),
    ],
)
def test_a_label_that_cannot_be_used_is_bad_input(tmp_path, label, problem):
    done = command_here("compare", str(PUBLISHED), "--label", label, cwd=tmp_path)
    assert done.returncode == 2 and problem in done.stderr
