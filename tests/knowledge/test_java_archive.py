"""The archive with which Java starts sooner: it is used, it is never trusted, and nothing depends on it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from suave_des.knowledge.pellet import java

_FIRST = """
from suave_des.knowledge.pellet import java
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet.in_process import InProcessPellet
assert InProcessPellet(Ontology.load()).infer(())
print(java.java_class("java.lang.System").getProperty("java.vm.info"))
"""


def _python(program: str, cache: Path) -> str:
    environment = {**os.environ, "SUAVE_DES_CACHE_DIR": str(cache)}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, timeout=300)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def test_an_archive_is_used_and_a_damaged_one_is_removed_without_a_word(tmp_path: Path) -> None:
    _python("from suave_des.knowledge.pellet.java import make_archive; make_archive()", tmp_path)
    (archive,) = (tmp_path / "java").glob("*.aot")
    assert "sharing" in _python(_FIRST, tmp_path)
    content = bytearray(archive.read_bytes())
    content[len(content) // 2] ^= 0xFF
    archive.write_bytes(content)
    assert "sharing" not in _python(_FIRST, tmp_path)
    assert not archive.exists()


@pytest.fixture
def begun(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """Processes that were begun to make an archive in a cache folder of the test's; they are none."""
    monkeypatch.setenv("SUAVE_DES_CACHE_DIR", str(tmp_path))
    processes: list[object] = []

    class Process:
        def __init__(self, *arguments: object, **options: object) -> None:
            processes.append((arguments, options))

    monkeypatch.setattr(subprocess, "Popen", Process)
    return processes


def test_one_process_makes_it_and_another_only_after_a_day(begun: list[object]) -> None:
    for _ in range(3):
        java.make_archive_later()
    assert len(begun) == 1
    archive = java.archive_path()
    assert archive is not None
    os.utime(archive.with_suffix(".tried"), (0, 0))
    java.make_archive_later()
    assert len(begun) == 2
    os.utime(archive.with_suffix(".tried"), (0, 0))
    archive.touch()
    java.make_archive_later()
    assert len(begun) == 2


def test_without_a_folder_none_is_made(begun: list[object], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(java, "private_cache", lambda kind: None)
    java.make_archive_later()
    java.make_archive()
    assert not begun


def test_other_jars_and_options_have_another_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SUAVE_DES_CACHE_DIR", str(tmp_path))
    jar = tmp_path / "pellet.jar"
    jar.write_bytes(b"one")
    monkeypatch.setattr(java, "_jars", lambda: [str(jar)])
    found = {java.archive_path()}
    jar.write_bytes(b"other")
    found.add(java.archive_path())
    monkeypatch.setattr(java, "_OPTIONS", ("-Xrs",))
    found.add(java.archive_path())
    assert len(found) == 3
