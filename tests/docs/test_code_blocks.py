"""Every command, code block and notebook of README and docs is run, and does what the page says."""

import os
import re
import time
import tomllib
from difflib import unified_diff
from pathlib import Path

import nbformat
import pytest
from doc_blocks import IMAGES, PAGES, ROOT, Block, blocks_of, differs, run_page
from jupyter_client.manager import KernelManager
from make_screenshots import PICTURES
from mkdocs_hooks import notebook_markdown
from PIL import Image
from refresh_notebooks import NOTEBOOKS, executed, shown

from tests.helpers.command import python
from tests.helpers.needed import is_there, missing

REFRESH = "if the new output is right, run python docs/refresh_outputs.py, of a notebook docs/refresh_notebooks.py"
RUN_ALL = "python3 -m venv .venv && .venv/bin/pip install . && .venv/bin/suave-des reproduce"
TEST_ALL = "python3 -m venv .venv && .venv/bin/pip install '.[test]' && .venv/bin/pytest"
README = ROOT / "README.md"


def name(page):
    return str(page.relative_to(ROOT))


def blocks_show_what_they_print(page, folder, *, quick):
    needed = {block.marks["needs"] for block in blocks_of(page) if "needs" in block.marks}
    absent = sorted(program for program in needed if not is_there(program))
    wrong = [
        f"{block.place}\n"
        + "".join(unified_diff(block.text.splitlines(True), real.splitlines(True), "page", "real"))
        for block, real in run_page(page, folder, quick=quick, absent=absent)
        if differs(block, real, quick=quick)
    ]
    assert not wrong, "\n".join([*wrong, REFRESH])
    if absent:
        missing(f"there is no {' and no '.join(absent)}: only the other blocks were run")


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_blocks_show_what_they_print(page, tmp_path):
    blocks_show_what_they_print(page, tmp_path, quick=True)


def run_without_curl(folder):
    """What the blocks of a page show, of which the first needs curl, where it is absent."""
    page = folder / "page.md"
    page.write_text("```console needs=curl\n$ curl\nwas\n```\n```console\n$ echo is\nwas\n```\n")
    return [shown for _, shown in run_page(page, folder, quick=True, absent=["curl"])]


def test_a_block_whose_program_is_absent_is_left(tmp_path):
    assert run_without_curl(tmp_path)[0] == "$ curl\nwas\n"


def test_a_block_after_one_whose_program_is_absent_is_run(tmp_path):
    assert run_without_curl(tmp_path)[1:] == ["$ echo is\nis\n"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "page",
    [
        page
        for page in PAGES
        if any({"test", "long"} & set(block.marks) for block in blocks_of(page))
    ],
    ids=name,
)
def test_blocks_that_are_shortened_elsewhere_show_what_they_print(page, tmp_path):
    blocks_show_what_they_print(page, tmp_path, quick=False)


def test_blocks_of_other_pages_are_of_kinds_that_need_no_run():
    others = {path for path in (ROOT / "docs").rglob("*.md") if path not in PAGES}
    assert {block.language for page in others for block in blocks_of(page)} <= {
        "yaml",
        "csv",
        "console",
        "python",
    }


class TestDiffering:
    def block(self, text, **marks):
        return Block(README, 1, "console", marks, text)

    @pytest.mark.parametrize(
        ("shown", "real", "counts"),
        [
            ("fd_spiral_low\n", "fd_spiral_high\n", True),
            ("62 missions\n", "63 missions\n", True),
            ("mean 187.85\n", "mean 187.91\n", False),
            ("mean 187.85\n", "mean 197.91\n", True),
            ("one\ntwo\n", "one\n", True),
        ],
        ids=["word", "whole number", "decimal, slightly", "decimal", "line"],
    )
    def test_what_counts_as_another_output(self, shown, real, counts):
        assert differs(self.block(shown), real, quick=False) is counts

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
    pattern = re.search(
        r'grep -m 1 -o "(.*)" README\.md', (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    )
    assert pattern is not None
    assert (
        re.search(pattern[1].replace("[test", r"[test"), README.read_text(encoding="utf-8"))[0]
        == TEST_ALL
    )


def test_every_picture_is_drawn_by_a_block_or_taken_by_the_script():
    drawn = {
        block.marks["picture"]
        for page in PAGES
        for block in blocks_of(page)
        if "picture" in block.marks
    }
    assert drawn | set(PICTURES) == {path.name for path in IMAGES.iterdir()}


@pytest.mark.parametrize("picture", sorted(IMAGES.iterdir()), ids=lambda path: path.name)
def test_pictures_are_small_pngs(picture):
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert picture.stat().st_size < 300_000


@pytest.mark.parametrize("name", ["--mode-follow", "--mode-low", "--bad", "--good"])
def test_the_picture_of_two_missions_keeps_the_colours_of_what_it_shows(name):
    css = (ROOT / "suave_des" / "pages" / "assets" / "common.css").read_text(encoding="utf-8")
    wanted = bytes.fromhex(re.search(rf"{name}: #(\w{{6}})", css)[1])  # the first theme is light
    with Image.open(IMAGES / "replay-two.png") as picture:
        drawn = [colour for _, colour in picture.convert("RGB").getcolors()]
    assert min(max(abs(a - b) for a, b in zip(wanted, each, strict=True)) for each in drawn) < 16


# Keeps the script, as Slurm does: dask-jobqueue removes it as soon as it is submitted.
SBATCH = "#!/bin/sh\ncp $1 job.sh\nbash job.sh > job.log 2>&1 &\necho $! >> jobs\necho Submitted batch job $!\n"
SCANCEL = "#!/bin/sh\nkill $@\n"


@pytest.mark.slow
def test_the_slurm_script_runs(tmp_path):
    (script,) = [
        block.text
        for block in blocks_of(ROOT / "docs" / "guides" / "cluster.md")
        if "title" in block.marks
    ]
    for long, short in (("cores=32", "cores=1"), ("jobs=4", "jobs=1"), ("runs=100_000", "runs=2")):
        assert long in script
        script = script.replace(long, short)
    (tmp_path / "on_slurm.py").write_text(script, encoding="utf-8")
    commands = tmp_path / "bin"
    commands.mkdir()
    for name, text in (("sbatch", SBATCH), ("scancel", SCANCEL)):
        (commands / name).write_text(text)
        (commands / name).chmod(0o755)
    done = python("on_slurm.py", cwd=tmp_path, PATH=f"{commands}{os.pathsep}{os.environ['PATH']}")
    assert done.stdout == "6 missions are in on_slurm/runs.csv\n", done.stderr
    assert len((tmp_path / "on_slurm" / "runs.csv").read_text().splitlines()) == 1 + 6
    (job,) = (tmp_path / "jobs").read_text().split()
    end_s = time.monotonic() + 60.0
    while Path(f"/proc/{job}").exists():  # which closing the cluster has cancelled
        assert time.monotonic() < end_s
        time.sleep(0.1)


def test_there_are_four_notebooks():
    assert [path.stem for path in NOTEBOOKS] == [
        "first-campaign",
        "own-manager",
        "rules",
        "sweep-with-salib",
    ]


@pytest.fixture(scope="module")
def kernel():
    """Runs all notebooks: each imports the same modules and starts Java."""
    manager = KernelManager()
    yield manager
    if manager.has_kernel:
        manager.shutdown_kernel(now=True)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_shows_what_it_showed(path, kernel, tmp_path):
    kept = list(shown(nbformat.read(path, as_version=4)))
    assert kept, "it was never run"
    for text, now in zip(kept, shown(executed(path, tmp_path, kernel)), strict=True):
        assert not differs(Block(path, 1, "text", {}, text), now, quick=False), (
            f"{text}{now}{REFRESH}"
        )


@pytest.fixture(scope="module", params=NOTEBOOKS, ids=lambda path: path.stem)
def on_the_site(request):
    """A notebook, and its page on the site."""
    notebook = nbformat.read(request.param, as_version=4)
    return notebook, notebook_markdown(notebook)


class TestNotebookOnTheSite:
    def test_has_every_cell(self, on_the_site):
        notebook, page = on_the_site
        assert not [cell.source for cell in notebook.cells if cell.source not in page]

    def test_has_every_picture(self, on_the_site):
        notebook, page = on_the_site
        pictures = sum(text == "a picture\n" for text in shown(notebook))
        assert page.count("data:image/png") == pictures

    def test_brings_no_style_of_its_own(self, on_the_site):
        _, page = on_the_site
        assert "<style" not in page
