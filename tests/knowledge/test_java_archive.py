"""The archive with which Java starts sooner: it is used, it is never trusted, and nothing depends on it."""

import os
import subprocess
import sys
import time
from pathlib import Path

import owlready2.reasoning
import pytest

from suave_des.knowledge import java_archive
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet.java import SHORT_LIVED
from suave_des.knowledge.reasoners import Reasoner, make_reasoner
from tests.helpers.knowledge_states import searching

STATE = searching("fd_spiral_high", "1.0")

_FIRST = """
from suave_des.knowledge.pellet import jvm
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet.in_process import InProcessPellet
assert InProcessPellet(Ontology.load()).infer(())
print(jvm.java_class("java.lang.System").getProperty("java.vm.info"))
"""


def _python(*arguments: str, cache: Path, switch: str = "on") -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "SUAVE_DES_CACHE_DIR": str(cache), "SUAVE_DES_JAVA_ARCHIVE": switch}
    return subprocess.run([sys.executable, *arguments], env=environment, capture_output=True, text=True, timeout=300)


def test_an_archive_is_used_and_a_damaged_one_is_removed_without_a_word(tmp_path: Path) -> None:
    made = _python("-m", "suave_des.knowledge.java_archive", cache=tmp_path)
    archive = Path(made.stdout.strip())
    assert made.returncode == 0 and archive.is_file() and archive.is_relative_to(tmp_path), made.stderr

    used = _python("-c", _FIRST, cache=tmp_path)
    assert (used.returncode, used.stderr) == (0, "")
    assert "sharing" in used.stdout

    content = bytearray(archive.read_bytes())
    content[len(content) // 2] ^= 0xFF
    archive.write_bytes(content)
    archive.with_suffix(".tried").touch()  # or another process would make the next one during this test
    damaged = _python("-c", _FIRST, cache=tmp_path)
    assert (damaged.returncode, damaged.stderr) == (0, "")
    assert "sharing" not in damaged.stdout
    assert not archive.exists()


class TestOfStockOwlready2:
    """Each of its inferences is a Java process, which is given an archive of its own."""

    def test_one_that_java_rejects_changes_nothing(
        self, kb: Ontology, pellet: Reasoner, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setenv("SUAVE_DES_JAVA_ARCHIVE", str(tmp_path / "with spaces"))
        archive = java_archive.archive_path(owlready2.reasoning._PELLET_CLASSPATH.split(os.pathsep), SHORT_LIVED)
        assert archive is not None
        archive.parent.mkdir()
        archive.write_bytes(b"damaged")
        assert make_reasoner("owlready2", kb).infer(STATE) == pellet.infer(STATE)
        assert f'"-XX:AOTCache={archive}"' in owlready2.reasoning._subprocess_kargs["env"]["JDK_JAVA_OPTIONS"]

    @pytest.mark.slow
    def test_it_takes_half_of_the_time(self, tmp_path: Path) -> None:
        def cpu_s(switch: str) -> float:
            program = (
                "import resource\n"
                "from suave_des.knowledge.ontology import Ontology\n"
                "from suave_des.knowledge.pellet.stock import StockPellet\n"
                "assert StockPellet(Ontology.load()).infer(())\n"
                "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime)\n"
            )
            done = _python("-c", program, cache=tmp_path, switch=switch)
            assert done.returncode == 0, done.stderr
            return float(done.stdout)

        cpu_s("on")
        until_s = time.monotonic() + 120.0
        while not list(tmp_path.rglob("*.aot")) and time.monotonic() < until_s:
            time.sleep(0.5)
        assert min(cpu_s("on") for _ in range(3)) < 0.8 * min(cpu_s("off") for _ in range(3))


def test_of_several_processes_one_makes_the_archive(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[object] = []
    monkeypatch.setattr(subprocess, "Popen", lambda *command, **_: started.append(command) or _Started())
    archive = tmp_path / "java" / "1.aot"
    for _ in range(3):
        java_archive.make_later(archive)
    assert len(started) == 1
    day_ago_s = time.time() - java_archive.AGAIN_AFTER_S - 1.0
    os.utime(archive.with_suffix(".tried"), (day_ago_s, day_ago_s))
    java_archive.make_later(archive)
    assert len(started) == 2, "what failed is tried again a day later"
    archive.touch()
    os.utime(archive.with_suffix(".tried"), (day_ago_s, day_ago_s))
    java_archive.make_later(archive)
    assert len(started) == 2, "it is there"


class _Started:
    returncode: int | None = None


def test_one_that_gave_way_to_newer_ones_is_made_again_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[object] = []
    monkeypatch.setattr(subprocess, "Popen", lambda *command, **_: started.append(command) or _Started())
    monkeypatch.setattr(subprocess, "run", lambda command, **_: Path(command[-1]).touch())
    archives = [tmp_path / f"{number}.aot" for number in range(java_archive.MAX_FILES + 1)]
    for number, archive in enumerate(archives):
        java_archive.make_later(archive)
        java_archive.make(archive)
        os.utime(archive, (number, number))
    assert not archives[0].exists()
    java_archive.make_later(archives[0])
    assert len(started) == len(archives) + 1


def test_a_folder_that_cannot_be_written_to_is_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subprocess, "Popen", lambda *_, **__: pytest.fail("a process was started"))
    (tmp_path / "file").touch()
    java_archive.make_later(tmp_path / "file" / "java" / "1.aot")


def test_it_can_be_switched_off(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SUAVE_DES_JAVA_ARCHIVE", "off")
    assert java_archive.archive_path([]) is None
    assert java_archive.options_for(None) == ()
    java_archive.make_later(None)
    made = _python("-m", "suave_des.knowledge.java_archive", cache=tmp_path, switch="off")
    assert made.returncode == 0 and "switched off" in made.stdout
    assert list(tmp_path.iterdir()) == []


def test_it_is_kept_in_the_folder_that_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SUAVE_DES_JAVA_ARCHIVE", str(tmp_path))
    archive = java_archive.archive_path([])
    assert archive is not None and archive.parent == tmp_path


def test_other_libraries_or_options_mean_another_archive(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SUAVE_DES_JAVA_ARCHIVE")
    jar = tmp_path / "a.jar"
    jar.write_bytes(b"1")
    paths = {java_archive.archive_path([str(jar)], ["-Xrs"]), java_archive.archive_path([str(jar)], ["-Xmx1g"])}
    jar.write_bytes(b"12")
    paths.add(java_archive.archive_path([str(jar)], ["-Xrs"]))
    assert len(paths) == 3 and None not in paths
    assert java_archive.archive_path([str(tmp_path / "none.jar")], ["-Xrs"]) is None


def test_why_no_archive_could_be_made_is_what_was_said_last_with_the_exit_status(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    said = "No space left\nPicked up JAVA_TOOL_OPTIONS: -Xmx512m"
    monkeypatch.setattr(java_archive, "_TRAINING", {"pellet": f"import sys; sys.stderr.write({said!r}); sys.exit(3)"})
    monkeypatch.setattr(os, "nice", lambda increment: increment)
    assert java_archive.main("pellet", str(tmp_path / "archive.aot")) == 2
    assert capsys.readouterr().err == "suave-des: Java could not make its archive: No space left; exit status 3\n"
    assert list(tmp_path.iterdir()) == []
