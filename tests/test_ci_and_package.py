"""Each package keeps within its budget, a table in CONTRIBUTING.md; and .ci leaves no test out in
silence.
"""

import re
import sys
import tomllib
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest
import yaml
from hatchling.builders.wheel import WheelBuilder

from tests.helpers.browser import chromium
from tests.helpers.needed import PROGRAMS, need

ROOT = Path(__file__).parents[1]


def playwright(driver_starts: bool, browser: Path) -> ModuleType:
    """A stand-in for playwright on a machine without a browser or without a library."""
    module = ModuleType("playwright.sync_api")

    @contextmanager
    def sync_playwright():
        if not driver_starts:
            raise Exception("Connection closed while reading from the driver")
        yield SimpleNamespace(chromium=SimpleNamespace(executable_path=str(browser)))

    module.sync_playwright = sync_playwright
    return module


in_ci_and_elsewhere = pytest.mark.parametrize(
    ("ci", "outcome"), [("true", pytest.fail.Exception), (None, pytest.skip.Exception)]
)


@pytest.fixture
def environment(monkeypatch, ci):
    monkeypatch.setenv("CI", ci) if ci else monkeypatch.delenv("CI", raising=False)


@in_ci_and_elsewhere
@pytest.mark.parametrize(
    ("driver_starts", "told"),
    [(True, "no Chromium"), (False, "Connection closed while reading from the driver")],
)
def test_without_a_browser_tests_of_pages_fail_only_in_ci(
    monkeypatch, tmp_path, environment, outcome, driver_starts, told
):
    monkeypatch.setattr("shutil.which", lambda name: None)
    stand_in = playwright(driver_starts, tmp_path / "gone")
    monkeypatch.setitem(sys.modules, "playwright.sync_api", stand_in)
    with pytest.raises(outcome, match=told), chromium():
        pass


@in_ci_and_elsewhere
@pytest.mark.parametrize(
    "command", [("no-such-program", "--version"), (sys.executable, "-c", "import no_such_module")]
)
def test_without_a_program_its_tests_fail_only_in_ci(monkeypatch, environment, outcome, command):
    monkeypatch.setitem(PROGRAMS, "that one", command)
    with pytest.raises(outcome, match="there is no that one"):
        need("that one")


def test_ci_says_that_it_is():
    assert "\nexport CI=true" in (ROOT / ".ci" / "run").read_text(encoding="utf-8")


def test_ci_runs_the_slow_tests():
    text = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert re.search(r"^measured timeout \d+ .venv/bin/pytest -m slow", text, flags=re.MULTILINE)


def test_versions_are_tried_on_rooms_that_exist():
    rooms = re.findall(r"tests/[\w.]+", (ROOT / ".ci" / "versions").read_text(encoding="utf-8"))
    assert len(rooms) >= 5
    assert all((ROOT / room).exists() for room in rooms)


def minors_declared() -> list[int]:
    """Python 3's minor versions of the project's classifiers."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return [
        int(each.rpartition(".")[2])
        for each in project["classifiers"]
        if each.startswith("Programming Language :: Python :: 3.")
    ]


def test_the_readme_names_the_pythons_of_the_classifiers():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    lowest, highest = re.search(r"Python 3\.(\d+) to 3\.(\d+)", readme).groups()
    assert minors_declared() == list(range(int(lowest), int(highest) + 1))


def test_ci_tries_the_pythons_of_the_classifiers():
    versions = (ROOT / ".ci" / "versions").read_text(encoding="utf-8")
    tried = re.search(r"^for python in (.*); do$", versions, flags=re.MULTILINE)[1].split()
    assert tried == [f"python3.{minor}" for minor in minors_declared()]


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


def test_every_file_of_the_package_is_installed():
    """A line of .gitignore that fits a package's name would leave the package out."""
    found = {file.relative_path for file in WheelBuilder(str(ROOT)).recurse_included_files()}
    modules = {str(path.relative_to(ROOT)) for path in (ROOT / "suave_des").rglob("*.py")}
    assets = {str(path.relative_to(ROOT)) for path in (ROOT / "suave_des").rglob("assets/*")}
    assert modules | assets <= found
