"""Every command and code block of README and docs is run, and does what the page says."""

import re
import tomllib
from difflib import unified_diff

import pytest
from doc_blocks import IMAGES, PAGES, ROOT, Block, blocks_of, differs, run_page
from make_screenshots import PICTURES

REFRESH = "if the new output is right, run python docs/refresh_outputs.py"
RUN_ALL = "python3 -m venv .venv && .venv/bin/pip install . && .venv/bin/suave-des reproduce"
TEST_ALL = "python3 -m venv .venv && .venv/bin/pip install '.[test]' && .venv/bin/pytest"
README = ROOT / "README.md"


def name(page):
    return str(page.relative_to(ROOT))


def outdated(page, folder, *, quick):
    return [
        f"{block.place}\n" + "".join(unified_diff(block.text.splitlines(True), real.splitlines(True), "page", "real"))
        for block, real in run_page(page, folder, quick=quick)
        if differs(block, real, quick=quick)
    ]


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_blocks_show_what_they_print(page, tmp_path):
    wrong = outdated(page, tmp_path, quick=True)
    assert not wrong, "\n".join([*wrong, REFRESH])


@pytest.mark.slow
@pytest.mark.parametrize(
    "page", [page for page in PAGES if any({"test", "long"} & set(block.marks) for block in blocks_of(page))], ids=name
)
def test_blocks_that_are_shortened_elsewhere_show_what_they_print(page, tmp_path):
    wrong = outdated(page, tmp_path, quick=False)
    assert not wrong, "\n".join([*wrong, REFRESH])


def test_blocks_of_other_pages_are_of_kinds_that_need_no_run():
    others = {path for path in (ROOT / "docs").rglob("*.md") if path not in PAGES}
    assert {block.language for page in others for block in blocks_of(page)} <= {"yaml", "csv", "console", "python"}


class TestDiffering:
    def block(self, text, **marks):
        return Block(README, 1, "console", marks, text)

    def test_a_word_counts(self):
        assert differs(self.block("fd_spiral_low\n"), "fd_spiral_high\n", quick=False)

    def test_a_whole_number_counts(self):
        assert differs(self.block("62 missions\n"), "63 missions\n", quick=False)

    def test_a_decimal_may_be_a_hundredth_off(self):
        assert not differs(self.block("mean 187.85\n"), "mean 187.91\n", quick=False)
        assert differs(self.block("mean 187.85\n"), "mean 197.91\n", quick=False)

    def test_a_missing_line_counts(self):
        assert differs(self.block("one\ntwo\n"), "one\n", quick=False)

    def test_shorter_runs_keep_their_rows(self):
        long = self.block("none 187.85 1 2\nrandom 180.15 3 4\n", test="--runs 3")
        assert not differs(long, "none 150.00 5 6\nrandom 170.00 7 8\n", quick=True)
        assert differs(long, "none 150.00 5 6\n", quick=True)


def setup_commands():
    return [block.text.strip() for block in blocks_of(README) if "setup" in block.marks]


def test_the_set_up_takes_one_command_each():
    assert setup_commands() == [RUN_ALL, TEST_ALL]


def test_the_set_up_commands_name_what_the_package_declares():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert "suave-des" in project["scripts"]
    assert any(re.match("pytest", each) for each in project["optional-dependencies"]["test"])
    assert project["requires-python"] == ">=3.11"


def test_ci_runs_the_readme_s_test_command():
    pattern = re.search(r'grep -m 1 -o "(.*)" README\.md', (ROOT / ".ci" / "run").read_text(encoding="utf-8"))
    assert pattern is not None
    assert re.search(pattern[1].replace("[test", r"[test"), README.read_text(encoding="utf-8"))[0] == TEST_ALL


def test_every_picture_is_drawn_by_a_block_or_taken_by_the_script():
    drawn = {block.marks["picture"] for page in PAGES for block in blocks_of(page) if "picture" in block.marks}
    assert drawn | set(PICTURES) == {path.name for path in IMAGES.iterdir()}


@pytest.mark.parametrize("picture", sorted(IMAGES.iterdir()), ids=lambda path: path.name)
def test_pictures_are_small_pngs(picture):
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert picture.stat().st_size < 300_000
