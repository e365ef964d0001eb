"""What reference pages and README say of files, names and links is so."""

import ast
import inspect
import json
import re
import shlex
import subprocess
import sys
import textwrap
import tomllib

import make_cli_reference
import pytest
import yaml
from doc_blocks import ROOT, blocks_of

import suave_des
from suave_des import __version__, run_mission
from suave_des.campaign.campaign import run_campaign
from suave_des.campaign.results import SUMMARY_COLUMNS
from suave_des.records.metrics import COLUMNS, METRICS
from suave_des.records.mission_folder import EVENT_COLUMNS, TRAJECTORY_COLUMNS
from suave_des.records.runs import suave_pieces
from suave_des.scenario.models import FURTHER_METRICS

PAGES = [
    ROOT / "README.md",
    ROOT / "CHANGELOG.md",
    ROOT / "CONTRIBUTING.md",
    *sorted((ROOT / "docs").rglob("*.md")),
]
CSV_PAGE = ROOT / "docs" / "reference" / "csv.md"


def section(page, heading):
    parts = re.split(r"^## (.*)\n", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return parts[parts.index(heading) + 1]


def tables(text):
    """Cells of each table's rows, without its head."""
    found = re.findall(r"(?:^\|.*\n)+", text, flags=re.MULTILINE)
    return [
        [[cell.strip() for cell in row.split("|")[1:-1]] for row in each.splitlines()[2:]]
        for each in found
    ]


def lists(text):
    """Names that each list explains; after `a_mean`, `_std` stands for a_std."""
    found = re.findall(r"(?:^- .*\n(?:  .*\n)*)+", text, flags=re.MULTILINE)
    return [
        [
            name
            for names in re.findall(r"^- (`.*?`): ", each, flags=re.MULTILINE)
            for name in whole(names)
        ]
        for each in found
    ]


def whole(names):
    first, *others = [name.strip("`") for name in names.split(", ")]
    return [
        first,
        *(first.removesuffix("_mean") + name if name.startswith("_") else name for name in others),
    ]


@pytest.mark.parametrize(
    ("page", "heading", "names"),
    [
        (CSV_PAGE, "runs.csv", COLUMNS),
        (CSV_PAGE, "summary.csv", SUMMARY_COLUMNS),
        (CSV_PAGE, "events.csv", EVENT_COLUMNS),
        (CSV_PAGE, "trajectory.csv", TRAJECTORY_COLUMNS),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_columns_are_those_of_the_file(page, heading, names):
    assert lists(section(page, heading))[0] == list(names)


def test_the_guide_to_managers_lists_every_kind_of_diagnostics():
    rows = tables(section(ROOT / "docs" / "guides" / "managers.md", "Hooks"))[0]
    assert [row[0] for row in rows] == [f"`Kind.{kind.name}`" for kind in suave_des.Kind]


def test_the_list_of_columns_has_every_further_metric():
    assert {*lists(section(CSV_PAGE, "runs.csv"))[1]} == {*FURTHER_METRICS, "requirement_NAME"}


def test_every_further_metric_can_be_compared():
    assert {*FURTHER_METRICS} <= METRICS.keys()


@pytest.mark.parametrize(("revision", "place"), [("2023", 0), ("1.5", 1)])
def test_columns_of_the_exemplar_s_file_are_those_of_its_revision(revision, place):
    cells = [row[place].strip("`") for row in tables(section(CSV_PAGE, "suave/"))[0]]
    header = (
        next(suave_pieces(revision, "suave none", COLUMNS, [], 300.0))
        .strip()
        .replace('"', "")
        .replace("(x,y)", "(x;y)")
    )
    assert [cell for cell in cells if cell] == [
        name.replace("(x;y)", "(x,y)") for name in header.split(",")
    ]


@pytest.mark.parametrize("scenario", ["seams2023", "release15", "extended"])
def test_every_event_of_a_mission_is_in_the_list(scenario):
    rows = tables(section(CSV_PAGE, "events.csv"))[0]
    listed = {(name.strip("`"), source) for names, source, _ in rows for name in names.split(", ")}
    events = run_mission(scenario, "metacontrol", run=1, seed=1).events
    assert {(event.event, event.source) for event in events} <= listed


def test_keys_of_the_manifest_are_in_the_list(tmp_path):
    run_campaign("seams2023", ["none"], runs=1, seed=1, out=tmp_path / "campaign")
    manifest = json.loads((tmp_path / "campaign" / "manifest.json").read_text(encoding="utf-8"))
    (listed,) = lists(section(CSV_PAGE, "manifest.json"))
    assert sorted(listed) == sorted(manifest)


def test_keys_of_a_mission_are_in_the_list_or_told(tmp_path):
    (listed,) = lists(section(CSV_PAGE, "manifest.json"))
    run_mission("seams2023", "none", run=1, seed=1, out=tmp_path / "mission")
    mission = json.loads((tmp_path / "mission" / "mission.json").read_text(encoding="utf-8"))
    told = section(CSV_PAGE, "mission.json")
    assert set(mission) - set(listed) == set(re.findall(r"`(\w+)`:", told)) - set(listed)


def test_the_command_line_s_page_is_the_one_that_the_commands_give():
    page = (ROOT / "docs" / "reference" / "cli.md").read_text(encoding="utf-8")
    assert page == make_cli_reference.page(), "run python docs/make_cli_reference.py"


PYTHON_PAGE = ROOT / "docs" / "reference" / "python-api.md"


def test_the_python_page_lists_the_names_of_the_package_each_with_an_example():
    names = re.findall(r"^- `(\w+)`: ", PYTHON_PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert sorted(names) == sorted(suave_des.__all__) and len(names) <= 40
    examples = "\n".join(
        block.text for block in blocks_of(PYTHON_PAGE) if block.language == "python"
    )
    assert not [name for name in names if not re.search(rf"\b{name}\b", examples)]


def example_of(name):
    """The code under "Example:" in the docstring of a public name, or of its type."""
    text = inspect.getdoc(getattr(suave_des, name)) or ""
    found = re.search(r"^Example:\n((?:    .*\n|\n)+)", text + "\n", flags=re.MULTILINE)
    assert found, f"{name} has no example"
    return re.sub(r"^(>>>|\.\.\.) ?", "", textwrap.dedent(found[1]), flags=re.MULTILINE)


@pytest.mark.parametrize("name", sorted({*suave_des.__all__} - {"FAILED"}))
def test_the_docstring_of_a_public_name_has_an_example_that_is_python(name):
    ast.parse(example_of(name))


def anchors(page):
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {re.sub(r"[^a-z0-9 _-]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)]+)\)", page.read_text(encoding="utf-8")):
        if "://" in target:
            continue
        path, _, anchor = target.partition("#")
        linked = (page.parent / path).resolve() if path else page
        assert linked.is_file(), target
        assert not anchor or anchor in anchors(linked), target


def linked_from(page):
    targets = re.findall(r"\]\(([^)]+)\)", page.read_text(encoding="utf-8"))
    return {(page.parent / target.partition("#")[0]).resolve() for target in targets}


def test_every_page_is_two_steps_from_the_readme_which_links_a_handful():
    from_readme = linked_from(ROOT / "README.md")
    pages = from_readme & set(PAGES)
    assert len(pages) <= 12
    within_two_steps = from_readme.union(*map(linked_from, pages))
    assert {*(ROOT / "docs").rglob("*.md"), *(ROOT / "docs").rglob("*.ipynb")} <= within_two_steps


def test_pages_write_into_folders_of_their_own_so_that_they_can_follow_each_other_in_one_checkout():
    out = re.compile(r"^\$ suave-des .*--out (\w+)(?![.\w/])", flags=re.MULTILINE)
    written = {
        (folder, page) for page in PAGES for folder in out.findall(page.read_text(encoding="utf-8"))
    }
    folders = [folder for folder, _ in written]
    assert sorted(folders) == sorted(set(folders))


CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))


def test_the_citation_names_this_version():
    assert CITATION["version"] == __version__


def test_the_citation_names_the_licence():
    assert CITATION["license"] == "Apache-2.0"


def test_the_citation_names_the_readme_s_authors():
    authors = CITATION["preferred-citation"]["authors"]
    bibtex = (ROOT / "README.md").read_text(encoding="utf-8").partition("@inproceedings")[2]
    for author in authors:
        assert author["given-names"].split()[-1] in bibtex
    assert bibtex.partition("title")[0].count(" and") == len(authors) - 1


def test_what_the_container_copies_exists():
    text = (ROOT / "Containerfile").read_text(encoding="utf-8")
    sources = [
        name
        for copied in re.findall(r"^COPY (.*) \S+$", text, flags=re.MULTILINE)
        for name in copied.split()
    ]
    assert "suave_des" in sources
    assert all((ROOT / name).exists() for name in sources)


def test_what_the_container_runs_is_run_by_this_version(tmp_path):
    text = (ROOT / "Containerfile").read_text(encoding="utf-8")
    steps = [
        shlex.split(step)
        for line in re.findall(r"^RUN (.*)$", text, flags=re.MULTILINE)
        for step in line.split(" && ")
    ]
    tried = [step for step in steps if step[0] not in ("pip", "chmod")]
    assert [step[:2] for step in tried] == [["suave-des", "reproduce"]]
    for step in tried:
        # help is printed once the options are known
        done = subprocess.run(
            [sys.executable, "-m", "suave_des", *step[1:], "--help"],
            cwd=tmp_path,
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr


def test_the_container_has_what_results_need():
    (extras,) = re.findall(r"suave-des\[(.*)\]", (ROOT / "Containerfile").read_text("utf-8"))
    assert "report" in extras.split(",")


def test_the_change_log_has_this_version():
    assert f"## [{__version__}]" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_dependencies_are_explained():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    page = (ROOT / "docs" / "background" / "dependencies.md").read_text(encoding="utf-8")
    required = [
        *project["dependencies"],
        *(each for extra in project["optional-dependencies"].values() for each in extra),
    ]
    names = {re.match(r"[\w-]+", requirement)[0] for requirement in required} - {"suave-des"}
    assert set(re.findall(r"^- (\w[\w-]*) \(", page, flags=re.MULTILINE)) == names
