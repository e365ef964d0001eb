"""Each package keeps within its budget of lines and modules, a table in CONTRIBUTING.md: what is new makes room."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TABLE = re.findall(
    r"^\| `([\w/]+)` \| ([\d,]+) \| ([\d,]*) \|$", (ROOT / "CONTRIBUTING.md").read_text("utf-8"), flags=re.MULTILINE
)
BUDGETS = {name: (int(lines.replace(",", "")), int(modules or 0)) for name, lines, modules in TABLE}


def size(files: list[Path]) -> tuple[int, int]:
    """Lines and number of files."""
    return sum(len(file.read_text("utf-8").splitlines()) for file in files), len(files)


def files_of(place: str) -> list[Path]:
    """All Python files below a folder; of the package itself, only its own modules."""
    if place == "suave_des/modules":
        return sorted((ROOT / "suave_des").glob("*.py"))
    return sorted((ROOT / place).rglob("*.py"))


@pytest.mark.parametrize("place", BUDGETS)
def test_within_its_budget(place):
    lines, modules = size(files_of(place))
    most_lines, most_modules = BUDGETS[place]
    assert lines <= most_lines, f"{place} has {lines} lines: make it simpler, or take its budget from another package"
    assert not most_modules or modules <= most_modules


def test_every_package_has_a_budget():
    packages = {f"suave_des/{path.name}" for path in (ROOT / "suave_des").iterdir() if (path / "__init__.py").exists()}
    assert packages | {"suave_des", "tests"} <= set(BUDGETS)
