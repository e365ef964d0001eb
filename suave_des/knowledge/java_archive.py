"""An archive of the classes that Pellet needs, loaded and linked ahead of time (Java's AOT cache, JEP 514).

With it a process takes 1.9 s of CPU time from its start to the first inference instead of 2.6 s (medians of 5 starts
each, interleaved). Each Java process of stock owlready2 takes 1.1 s instead of 1.7 s; it has an archive of its own.
Java writes it after a training run of some seconds: a process of the lowest priority makes it once, after Java was
first used. Without an archive, or with one that Java rejects, all works the same.

    python -m suave_des.knowledge.java_archive

makes the one for Java inside Python at once, for a machine image for instance. SUAVE_DES_JAVA_ARCHIVE=off does without;
the absolute path of a folder keeps archives there, apart from the other caches.
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
from typing import Final

from suave_des.caches import private_cache
from suave_des.errors import InputError
from suave_des.knowledge.pellet.java import OPTIONS, jars, java_library

_SWITCH: Final = "SUAVE_DES_JAVA_ARCHIVE"
#: Archives that are kept, 25 to 35 MB each; the least recently used are removed.
MAX_FILES: Final = 6
#: Another attempt to make an archive is made after this time.
AGAIN_AFTER_S: Final = 86400.0
_MAKING_S: Final = 600.0

#: What training runs begin with: the shipped ontology, and a state.
_STATE: Final = """
import sys
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.state import KnowledgeState, ObjectiveState
ontology = Ontology.load()
search = "f_generate_search_path"
state = KnowledgeState.of(
    [ObjectiveState(search)], groundings={search: "fd_spiral_high"}, measurements={"water_visibility": "1"}
)
option = f"-XX:AOTCacheOutput={sys.argv[1]}"
"""
#: The training runs, by the reasoner's name: one inference each.
_TRAINING: Final = {
    "pellet": f"""{_STATE}
from suave_des.knowledge.pellet import jvm
jvm.start(option)
from suave_des.knowledge.pellet.in_process import InProcessPellet
InProcessPellet(ontology).infer(ontology.assertions(state))
""",
    "owlready2": f"""{_STATE}
from suave_des.knowledge.pellet.stock import StockPellet
StockPellet(ontology, options=[option]).infer(ontology.assertions(state))
""",
}


def archive_path(class_path: Sequence[str] | None = None, options: Sequence[str] = OPTIONS) -> Path | None:
    """Return the path of the archive for these jars and options; None if disabled, or without a cache folder.

    Java takes an archive only with the runtime, the jars (by path, size and time) and the options that it was made
    with: all that is in the name.
    """
    chosen = os.environ.get(_SWITCH, "")
    if chosen == "off":
        return None
    total = hashlib.sha256(repr(tuple(options)).encode())
    try:
        for path in (str(java_library()), *(jars() if class_path is None else class_path)):
            status = Path(path).stat()
            total.update(f"{path} {status.st_size} {status.st_mtime_ns}\n".encode())
    except (OSError, InputError):  # no Java: starting it gives the error
        return None
    folder = Path(chosen) if Path(chosen).is_absolute() else private_cache("java")
    return None if folder is None else folder / f"{total.hexdigest()[:32]}.aot"


def options_for(archive: Path | None) -> tuple[str, ...]:
    """Return the options with which Java uses an archive, if there is one."""
    if archive is None or not archive.is_file():
        return ()
    with suppress(OSError):
        os.utime(archive)
    # Checksums are compared: Java would run damaged classes otherwise.
    return (f"-XX:AOTCache={archive}", "-XX:+VerifySharedSpaces")


def make_later(archive: Path | None, reasoner: str = "pellet") -> None:
    """Have another process make a reasoner's archive, unless there is one, or one has tried within a day."""
    if archive is None or archive.exists() or not sys.executable:
        return
    tried = archive.with_suffix(".tried")
    try:
        tried.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        if tried.exists() and time.time() - tried.stat().st_mtime > AGAIN_AFTER_S:
            tried.unlink()
        tried.touch(mode=0o600, exist_ok=False)
        silent = subprocess.DEVNULL
        command = [sys.executable, "-P", "-m", __name__, reasoner, str(archive)]
        # A session of its own: Ctrl-C is meant for the command that the user runs.
        making = subprocess.Popen(command, stdin=silent, stdout=silent, stderr=silent, start_new_session=True)
        making.returncode = 0  # it is not waited for, and Python shall not warn of that
    except OSError:  # another process was first, or the folder cannot be written to
        return


def make(archive: Path | None = None, reasoner: str = "pellet") -> Path | None:
    """Make an archive for this environment; None if disabled.

    Args:
        archive: its path; None: the path for the Java in this process.
        reasoner: the reasoner that will use it, "pellet" or "owlready2".

    Raises:
        OSError: the cache folder cannot be written to.
        subprocess.SubprocessError: Java failed.
    """
    archive = archive or archive_path()
    if archive is None:
        return None
    archive.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    made = archive.with_suffix(f".{os.getpid()}")
    try:
        subprocess.run(
            [sys.executable, "-P", "-c", _TRAINING[reasoner], str(made)],
            check=True,
            timeout=_MAKING_S,
            capture_output=True,
            env={**os.environ, _SWITCH: "off"},
        )
        made.replace(archive)  # which Java wrote when that process ended
    finally:
        made.unlink(missing_ok=True)
    for old in sorted(archive.parent.glob("*.aot"), key=lambda path: path.stat().st_mtime)[:-MAX_FILES]:
        old.unlink(missing_ok=True)
        old.with_suffix(".tried").unlink(missing_ok=True)  # so that its next user makes it again at once
    return archive


def main(reasoner: str = "pellet", archive: str | None = None) -> int:
    """Make an archive at the lowest priority, and print its path."""
    with suppress(AttributeError, OSError):  # not everywhere
        os.nice(19)
    try:
        print(make(Path(archive) if archive else None, reasoner) or f"switched off by {_SWITCH}")
    except (OSError, subprocess.SubprocessError) as error:
        reason = str(error)
        if isinstance(error, subprocess.CalledProcessError):
            lines = [line for line in error.stderr.decode(errors="replace").splitlines() if line.strip()]
            said = [line for line in lines if not line.startswith("Picked up ")]  # options that Java was given
            reason = "; ".join([*said[-1:], f"exit status {error.returncode}"])
        print(f"suave-des: Java could not make its archive: {reason}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
