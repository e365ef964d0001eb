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
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

_PAGES = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
}
"""Pages of the repository's root, and their names on the site."""
_LINK = re.compile(r"\]\(([^)#\s]+)((?:#[^)\s]*)?)\)")
_FENCE = re.compile(r"^```(\w+) (.+)$", re.MULTILINE)
_STYLE = re.compile(r"<style scoped>.*?</style>", re.DOTALL)
_TITLE = re.compile(r'(title|insert)=("[^"]*"|\S+)')


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages of the root, and every file of the repository that a page links to.

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
    for file in files.documentation_pages():
        for target, _ in _LINK.findall(file.content_string):
            path = _in_repository(target, file.src_uri)
            if (
                path
                and not path.startswith("docs/")
                and path not in _PAGES
                and files.get_file_from_path(path) is None
            ):
                files.append(File.generated(config, path, abs_src_path=str(root / path)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Point links at the site's files, and reduce what follows the language of a code block to a
    title.

    Args:
        markdown: the page as it stands in the repository.
        page: which page it is.
        config: the site's configuration.
        files: the site's files.
    """
    own = page.file.src_uri

    def link(found: re.Match[str]) -> str:
        path = _in_repository(found[1], own)
        if path is None:
            return found[0]
        on_site = _PAGES.get(path, path.removeprefix("docs/"))
        if on_site.startswith("notebooks/"):
            on_site = on_site.replace(".ipynb", ".md")
        return f"]({posixpath.relpath(on_site, posixpath.dirname(own) or '.')}{found[2]})"

    return _FENCE.sub(_title, _LINK.sub(link, markdown))


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
        return "\n".join(line.strip() for line in html.splitlines() if line.strip())
    return f"```text\n{''.join(data.get('text/plain', ''))}\n```"


def _root(config: MkDocsConfig) -> Path:
    return Path(config.docs_dir).parent


def _in_repository(target: str, page: str) -> str | None:
    """Path from the repository's root of what a page links to, none if it is an address."""
    if "://" in target or target.startswith("mailto:"):
        return None
    sources = {site: source for source, site in _PAGES.items()}
    source = sources.get(page, f"docs/{page}")
    return posixpath.normpath(posixpath.join(posixpath.dirname(source), target))


def _title(fence: re.Match[str]) -> str:
    found = _TITLE.search(fence[2])
    if found is None:
        return f"```{fence[1]}"
    name = found[2].strip('"')
    return (
        f'```{fence[1]} title="{name}"'
        if found[1] == "title"
        else f'```{fence[1]} title="{name}, addition"'
    )
