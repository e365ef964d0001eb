"""What a page may run: its own script, and a library only where it has one."""

import re

import pytest

from suave_des.pages.page import page


def script_sources(library: str) -> str:
    text = page("replay.html", "title", {}, ["common.css"], ["common.js"], library)
    (sources,) = re.findall(r"script-src ([^;]*);", text)
    return sources


@pytest.mark.parametrize(
    ("library", "sources"), [("", "'unsafe-inline'"), ("H4sI", "'unsafe-inline' blob:")]
)
def test_only_a_page_with_a_library_may_run_what_it_expands(library, sources):
    assert script_sources(library) == sources
