"""The site: built strictly, with every page, and as readers see it in a browser."""

import re

import pytest
from doc_blocks import ROOT
from mkdocs_hooks import on_page_content, on_page_markdown
from refresh_notebooks import NOTEBOOKS, shown

from tests.helpers.browser import DESKTOP, PHONE, chromium, opened
from tests.helpers.command import python

SOME_PAGES = [
    ".",
    "analysis",
    "guides/other-programs",
    "guides/test-rules",
    *(f"notebooks/{path.stem}" for path in NOTEBOOKS),
]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    # With --quiet, warnings would not count.
    words = ("-m", "mkdocs", "build", "--strict", "--site-dir", folder)
    done = python(*words, cwd=ROOT, NO_MKDOCS_2_WARNING="1")
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr
    return folder


@pytest.fixture(scope="module")
def browser():
    with chromium() as started:
        yield started


def test_every_page_is_there(site):
    for page in (ROOT / "docs").rglob("*.md"):
        assert (site / page.relative_to(ROOT / "docs").with_suffix("") / "index.html").is_file()
    assert "Write a rule" in (site / "index.html").read_text(encoding="utf-8")


def test_nothing_is_loaded_from_elsewhere(site):
    for page in site.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        loaded = re.findall(r'<(?:script|img|iframe|link)\b[^>]*?(?:src|href)="?([^" >]+)', text)
        assert not [
            address for address in loaded if "://" in address or address.startswith("//")
        ], page


def test_the_public_api_is_documented(site):
    for page, name in (
        ("missions", "suave_des.run_campaign"),
        ("managers", "suave_des.managing.base.ManagingSubsystem.adapt"),
        ("interfaces", "suave_des.Mission.advance"),
        ("interfaces", "suave_des.PipelineInspection.step"),
        ("knowledge", "suave_des.kb.knowledge_base.KnowledgeBase.infer"),
    ):
        text = (site / "reference" / "api" / page / "index.html").read_text(encoding="utf-8")
        assert f'id="{name}"' in text


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_pictures_of_notebooks_are_visible(site, browser, path):
    import nbformat

    pictures = sum(text == "a picture\n" for text in shown(nbformat.read(path, as_version=4)))
    with opened(browser, site / "notebooks" / path.stem / "index.html") as found:
        widths = found.value(
            "[...document.querySelectorAll('article img')].map(each => each.naturalWidth)"
        )
    assert len([width for width in widths if width > 300]) == pictures


OVERFLOWING = """[...document.querySelectorAll('html, article pre > code')]
    .filter(each => each.scrollWidth > each.clientWidth + 1)
    .map(each => each.textContent.slice(0, 80))"""


def overflowing(site, browser, page, size):
    with opened(browser, site / page / "index.html", size) as found:
        return found.value(OVERFLOWING)


@pytest.mark.parametrize("page", SOME_PAGES)
@pytest.mark.parametrize("size", [DESKTOP, PHONE], ids=["desktop", "phone"])
def test_nothing_is_wider_than_the_window(site, browser, page, size):
    assert not overflowing(site, browser, page, size)


SCROLLING = """[...document.querySelectorAll('.md-typeset__scrollwrap')]
    .filter(each => each.scrollWidth > each.clientWidth + 1)
    .map(each => each.textContent.trim().slice(0, 80))"""


@pytest.mark.parametrize("page", SOME_PAGES)
def test_tables_are_shown_whole_on_a_desktop(site, browser, page):
    with opened(browser, site / page / "index.html") as found:
        assert not found.value(SCROLLING)


@pytest.mark.parametrize(
    "page", ["analysis", "notebooks/own-manager", "notebooks/sweep-with-salib"]
)
def test_tables_of_up_to_five_columns_are_shown_whole_on_a_phone(site, browser, page):
    with opened(browser, site / page / "index.html", PHONE) as found:
        assert not found.value(SCROLLING)


@pytest.mark.slow
@pytest.mark.parametrize("size", [DESKTOP, PHONE], ids=["desktop", "phone"])
def test_that_is_so_of_every_page(site, browser, size):
    pages = [file.parent.relative_to(site) for file in site.rglob("index.html")]
    assert not [page for page in pages if overflowing(site, browser, page, size)]


CONTRAST = """() => {
  const light = colour => colour.match(/[\\d.]+/g).slice(0, 3).map(Number).map(value => value / 255)
    .map(value => value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4)
    .reduce((sum, value, place) => sum + value * [0.2126, 0.7152, 0.0722][place], 0.05);
  const contrast = (one, other) => Math.max(one / other, other / one);
  const of = (element, kind) => light(getComputedStyle(document.querySelector(element))[kind]);
  return {
    links: contrast(of('article p a', 'color'), of('body', 'backgroundColor')),
    header: contrast(of('.md-header', 'color'), of('.md-header', 'backgroundColor')),
  };
}"""
"""The formula is that of WCAG 2.1, "relative luminance"."""


@pytest.fixture(scope="module", params=["light", "dark"])
def contrasts(request, site, browser):
    with opened(browser, site / "index.html", theme=request.param) as found:
        return found.value(CONTRAST)


@pytest.mark.parametrize("what", ["links", "header"])
def test_text_has_the_contrast_that_wcag_asks_for(contrasts, what):
    assert contrasts[what] >= 4.5


def copied(site, browser, page, text):
    """What the copy button of the code block with some text copies."""
    with opened(browser, site / page / "index.html") as found:
        found.value("document.addEventListener('copy', () => window.copied = `${getSelection()}`)")
        block = found.page.locator("article .highlight", has_text=text).first
        block.hover()
        block.locator("[data-clipboard-target], .md-code__button").first.click()
        found.wait_until("window.copied !== undefined")
        return found.value("window.copied")


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("reproduce", ["python3 -m venv .venv && .venv/bin/pip install . && .venv/bin/suave-des reproduce"]),
        ("--out before", ["suave-des campaign seams2023 --runs 100 --out before"]),
        (
            "--out bold",
            [
                "sed 's/>3.25</>2.75</' ontology/suave.owl > bold.owl",
                "suave-des campaign seams2023 --managers metacontrol --ontology bold.owl"
                " --runs 100 --out bold | grep metacontrol",
            ],
        ),
    ],
)  # fmt: skip
def test_the_copy_button_copies_nothing_but_commands(site, browser, text, lines):
    assert [line for line in copied(site, browser, ".", text).splitlines() if line] == lines


@pytest.mark.parametrize(
    ("size", "picture"), [(DESKTOP, "replay.png"), (PHONE, "replay-phone.png")]
)
def test_the_first_picture_is_one_for_the_window(site, browser, size, picture):
    with opened(browser, site / "index.html", size) as found:
        shown = "document.querySelector('article picture img')"
        assert found.value(f"{shown}.currentSrc").endswith(f"/images/{picture}")
        assert found.value(f"{shown}.naturalWidth") > 300


class TestHooks:
    def markdown(self, text, own="guides/page.md"):
        from types import SimpleNamespace

        page = SimpleNamespace(file=SimpleNamespace(src_uri=own))
        config = SimpleNamespace(docs_dir=str(ROOT / "docs"))
        return on_page_markdown(text, page, config, None)

    @pytest.mark.parametrize(
        ("own", "text", "link"),
        [
            ("guides/page.md", "[a](../../README.md#b)", "[a](../index.md#b)"),
            ("guides/page.md", "[a](../notebooks/rules.ipynb)", "[a](../notebooks/rules.md)"),
            ("analysis/README.md", "[a](../docs/reference/validation.md#b)", "[a](../reference/validation.md#b)"),
            ("analysis/README.md", "[c](studies.py)", "[c](studies.py)"),
        ],
        ids=["page of the root", "notebook", "from outside docs", "file outside docs"],
    )  # fmt: skip
    def test_links_lead_to_the_site_s(self, own, text, link):
        assert self.markdown(text, own) == link

    def test_folders_outside_docs_have_no_link(self):
        text = "[a](../docs/reference/validation.md#b), [c](studies.py), [d/](predictions)"
        assert self.markdown(text, own="analysis/README.md").endswith(", d/")

    @pytest.mark.parametrize("text", ["![](data:image/png;base64,a//b/+c=)", "[a](mailto:a@b.org)"])
    def test_what_is_no_link_to_a_page_stays(self, text):
        assert self.markdown(text) == text

    @pytest.mark.parametrize(
        ("text", "shown"),
        [
            (
                '<table><td><a href="x">a_b/c_d</a></td></table>',
                '<table><td><a href="x">a_<wbr>b/<wbr>c_<wbr>d</a></td></table>',
            ),
            ('<table><td><a href="a_b/c.md">a</a></td></table>', None),
            ("<p>a_b</p>", None),
        ],
        ids=["name in a table", "address in a table", "name elsewhere"],
    )
    def test_only_names_in_tables_may_break_between_their_parts(self, text, shown):
        assert on_page_content(text, None, None, None) == (shown or text)

    def test_code_stays(self):
        assert self.markdown("```python\nhooks[name](event)\n```") == (
            "```python\nhooks[name](event)\n```"
        )

    @pytest.mark.parametrize(
        ("block", "first"),
        [
            ("```console head=2\n$ a\nb\n```", "```console"),
            ("```console setup\na && b\n```", "```bash"),
            ("```yaml title=a.yaml\na: 1\n```", '```yaml title="a.yaml"'),
            ("```yaml insert=a.yaml after=b\na: 1\n```", '```yaml title="a.yaml, addition"'),
        ],
    )
    def test_of_the_marks_of_a_block_only_a_title_stays(self, block, first):
        assert self.markdown(block) == "\n".join([first, *block.splitlines()[1:]])
