"""The documentation site is built without a warning, and needs no network to be read."""

import os
import re
import subprocess
import sys

import pytest
from doc_blocks import ROOT


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(folder)],
        cwd=ROOT,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return folder


def test_every_page_is_there(site):
    for page in (ROOT / "docs").rglob("*.md"):
        assert (site / page.relative_to(ROOT / "docs").with_suffix("") / "index.html").is_file()
    assert "Write a rule" in (site / "index.html").read_text(encoding="utf-8")


def test_nothing_is_loaded_from_elsewhere(site):
    for page in site.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        loaded = re.findall(r'<(?:script|img|iframe|link)\b[^>]*?(?:src|href)="?([^" >]+)', text)
        assert not [address for address in loaded if "://" in address or address.startswith("//")], page


def test_the_public_api_is_documented(site):
    for page, name in (
        ("missions", "suave_des.run_campaign"),
        ("managers", "suave_des.managing.base.ManagingSubsystem.adapt"),
        ("interfaces", "suave_des.Mission.advance"),
        ("interfaces", "suave_des.PipelineInspection.step"),
        ("knowledge", "suave_des.kb.KnowledgeBase.infer"),
    ):
        text = (site / "reference" / "api" / page / "index.html").read_text(encoding="utf-8")
        assert f'id="{name}"' in text
