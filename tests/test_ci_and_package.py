"""Each package keeps within its budget, a table in CONTRIBUTING.md; and .ci leaves no test out in
silence.
"""

import re
from pathlib import Path

import pytest
import yaml
from hatchling.builders.wheel import WheelBuilder

from tests.helpers.browser import chromium

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize(
    ("ci", "outcome"), [("true", pytest.fail.Exception), (None, pytest.skip.Exception)]
)
def test_without_a_browser_tests_of_pages_fail_in_ci_and_are_skipped_elsewhere(
    monkeypatch, tmp_path, ci, outcome
):
    monkeypatch.setattr("shutil.which", lambda name: None)
    monkeypatch.setenv("PLAYWRIGHT_BROWSERS_PATH", str(tmp_path))
    monkeypatch.setenv("CI", ci) if ci else monkeypatch.delenv("CI", raising=False)
    with pytest.raises(outcome, match="no Chromium"), chromium():
        pass


def test_ci_says_that_it_is_and_runs_the_slow_tests():
    text = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert "\nexport CI=true" in text
    assert re.search(r"^timeout \d+ .venv/bin/pytest -m slow", text, flags=re.MULTILINE)


def test_versions_are_tried_on_rooms_that_exist():
    rooms = re.findall(r"tests/\w+", (ROOT / ".ci" / "versions").read_text(encoding="utf-8"))
    assert len(rooms) >= 5
    assert all((ROOT / room).is_dir() for room in rooms)


def test_hooks_before_a_commit_are_what_ci_checks():
    (local,) = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))[
        "repos"
    ]
    assert local["repo"] == "local"  # needs no network
    text = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    in_ci = set(
        re.findall(
            r"\.venv/bin/((?:ruff|lint-imports|mypy)\b[^&\n]*?) *(?:&.*)?$",
            text,
            flags=re.MULTILINE,
        )
    )
    assert {hook["entry"] for hook in local["hooks"]} == in_ci


def test_what_is_installed_has_every_module_and_shipped_file():
    """A line of .gitignore that fits a package's name would leave the package out."""
    found = {file.relative_path for file in WheelBuilder(str(ROOT)).recurse_included_files()}
    modules = {str(path.relative_to(ROOT)) for path in (ROOT / "suave_des").rglob("*.py")}
    assets = {str(path.relative_to(ROOT)) for path in (ROOT / "suave_des").rglob("assets/*")}
    assert modules | assets <= found
