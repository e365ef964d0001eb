"""Turn the repository's Markdown into the site's: pages of the root, links to other files, marks of
code blocks.
"""

from __future__ import annotations

import json
import posixpath
import re
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files, InclusionLevel
from mkdocs.structure.pages import Page

_PAGES = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
}
"""Pages of the repository's root, and their names on the site."""
_LINK = re.compile(r"\]\(([^)#\s]+)((?:#[^)\s]*)?)\)")
_LINK_WITH_TEXT = re.compile(r"\[([^\[\]]*)\]\(([^)#\s]+)\)")
_SOURCE = re.compile(r'(src|srcset)="([^"]+)"')
_ADDRESS = re.compile(r"[a-z][a-z0-9+.-]*:")
"""What an address begins with: https:, mailto:, and data: of a notebook's pictures."""
_BLOCK = re.compile(r"^```(\w+)([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_STYLE = re.compile(r"<style scoped>.*?</style>", re.DOTALL)
_TITLE = re.compile(r'(title|insert)=("[^"]*"|\S+)')
_TABLE = re.compile(r"<table>.*?</table>", re.DOTALL)
_WORD_PART = re.compile(r"(?<=\w[_/])(?=\w[^<>]*<)")
"""Where a name or path in a text may be broken, as `distance_inspected_m`; not inside a tag."""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages of the root, and every file of the repository that a page links to.

    Pages from outside docs/ have no place in the navigation; what links to them leads there.

    Args:
        files: the site's files, those below docs/.
        config: the site's configuration.
    """
    root = _root(config)
    for source, page in _PAGES.items():
        files.append(
            File.generated(config, page, content=(root / source).read_text(encoding="utf-8"))
        )
    for path in sorted((root / "docs" / "notebooks").glob("*.ipynb")):
        page = f"notebooks/{path.stem}.md"
        files.append(
            File.generated(
                config, page, content=notebook_markdown(json.loads(path.read_text("utf-8")))
            )
        )
    unread = list(files.documentation_pages())
    while unread:
        file = unread.pop()
        for path in _linked_files(file, root):
            if files.get_file_from_path(path) is None:
                added = File.generated(
                    config,
                    path,
                    abs_src_path=str(root / path),
                    inclusion=InclusionLevel.NOT_IN_NAV,
                )
                files.append(added)
                if added.is_documentation_page():
                    unread.append(added)
    return files


def _linked_files(file: File, root: Path) -> list[str]:
    """Files outside docs/ that a page links to, as paths from the repository's root."""
    targets = [target for target, _ in _LINK.findall(_BLOCK.sub("", file.content_string))]
    paths = [_in_repository(target, file.src_uri, root) for target in targets]
    return [
        path
        for path in paths
        if path
        and not path.startswith("docs/")
        and path not in _PAGES
        and not (root / path).is_dir()
    ]


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Point links at the site's files, and say of code blocks what the site can show.

    Args:
        markdown: the page as it stands in the repository.
        page: which page it is.
        config: the site's configuration.
        files: the site's files.
    """
    own, root = page.file.src_uri, _root(config)
    shown, place = [], 0
    for block in _BLOCK.finditer(markdown):
        shown += [_on_site(markdown[place : block.start()], own, root), _code(block)]
        place = block.end()
    return "".join([*shown, _on_site(markdown[place:], own, root)])


def on_page_content(html: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Let long names and paths in tables break between their parts, so that phones show tables
    whole.

    Args:
        html: the page's content.
        page: which page it is.
        config: the site's configuration.
        files: the site's files.
    """
    return _TABLE.sub(lambda table: _WORD_PART.sub("<wbr>", table[0]), html)


def _on_site(text: str, own: str, root: Path) -> str:
    """Text between code blocks, with links to the site's files; folders have no page there."""

    def linked_or_plain(found: re.Match[str]) -> str:
        path = _in_repository(found[2], own, root)
        return found[1] if path is not None and (root / path).is_dir() else found[0]

    def link(found: re.Match[str]) -> str:
        path = _in_repository(found[1], own, root)
        if path is None:
            return found[0]
        on_site = _PAGES.get(path, path.removeprefix("docs/"))
        if on_site.startswith("notebooks/"):
            on_site = on_site.replace(".ipynb", ".md")
        return f"]({posixpath.relpath(on_site, posixpath.dirname(own) or '.')}{found[2]})"

    def picture(found: re.Match[str]) -> str:
        path = _in_repository(found[2], own, root)
        return found[0] if path is None else f'{found[1]}="{path.removeprefix("docs/")}"'

    if own == "index.md":  # other pages have no HTML with pictures
        text = _SOURCE.sub(picture, text)
    return _LINK.sub(link, _LINK_WITH_TEXT.sub(linked_or_plain, text))


def _code(block: re.Match[str]) -> str:
    """A code block whose marks are a title at most.

    In `console` what follows `$ ` are commands and all else is output, which the site's style
    keeps from being copied; commands alone are `bash`.
    """
    language, marks, text = block.groups()
    if language == "console" and not re.search(r"^\$ ", text, re.MULTILINE):
        language = "bash"
    title = _TITLE.search(marks)
    if title is None:
        return f"```{language}\n{text}```"
    name = title[2].strip('"')
    if title[1] == "insert":
        name += ", addition"
    return f'```{language} title="{name}"\n{text}```'


def notebook_markdown(notebook: dict[str, Any]) -> str:
    """Turn a notebook with its outputs into Markdown: pictures are in the page, data frames are
    tables.
    """
    parts = []
    for cell in notebook["cells"]:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(source)
            continue
        parts.append(f"```python\n{source}\n```")
        parts += [_output(each) for each in cell["outputs"]]
    return "\n\n".join(parts) + "\n"


def _output(output: dict[str, Any]) -> str:
    """What a cell shows, as Markdown."""
    if output["output_type"] == "stream":
        return f"```text\n{''.join(output['text']).rstrip()}\n```"
    data = output.get("data", {})
    if "image/png" in data:
        return f"![](data:image/png;base64,{''.join(data['image/png']).replace(chr(10), '')})"
    if "text/html" in data:
        html = _STYLE.sub("", "".join(data["text/html"]))
        # The theme lets only tables without a class scroll by themselves.
        html = html.replace('<table border="1" class="dataframe">', "<table>")
        lines = [line.strip() for line in html.splitlines() if line.strip()]
        return "\n".join(['<div class="frame">', *lines, "</div>"])
    return f"```text\n{''.join(data.get('text/plain', ''))}\n```"


def _root(config: MkDocsConfig) -> Path:
    return Path(config.docs_dir).parent


def _in_repository(target: str, page: str, root: Path) -> str | None:
    """Path from the repository's root of what a page links to, none if it is an address."""
    if _ADDRESS.match(target):
        return None
    return posixpath.normpath(posixpath.join(posixpath.dirname(_source(page, root)), target))


def _source(page: str, root: Path) -> str:
    """Path from the repository's root of the file that a page of the site is made of."""
    sources = {site: source for source, site in _PAGES.items()}
    outside = (root / page).is_file() and not (root / "docs" / page).is_file()
    return page if outside else sources.get(page, f"docs/{page}")
