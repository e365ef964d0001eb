"""The Java virtual machine inside this process: started once, when first needed, and never at import.

A virtual machine cannot be restarted, and a process that is forked after its start hangs: workers must be
spawned, and each has one of its own.
"""

from __future__ import annotations

import os
import threading
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from suave_des.errors import InputError
from suave_des.imports import hidden
from suave_des.knowledge import java_archive
from suave_des.knowledge.pellet.java import OPTIONS, jars, java_library, without_options_of_others

with hidden("numpy"):  # takes 0.1 s, and JPype needs it only to recognise numpy's truth values
    import jpype
    import jpype.config

#: What Java throws, in Python.
JavaError: Final = jpype.JException
_lock: Final = threading.RLock()
_warnings: Final[list[str]] = []
_started_in: list[int] = []
_archives: Final[list[Path]] = []  # of this process's Java, until the first inference
_kept: Final[list[Any]] = []  # what Java holds by weak references only


def start(*more: str) -> None:
    """Start the virtual machine, or do nothing if it runs in this process.

    Args:
        more: further options to start it with.

    Raises:
        InputError: there is no usable Java, or this process was forked from one where it ran.
    """
    if _is_running():  # checked without the lock, which a forked process may find locked for ever
        return
    with _lock:
        if _is_running():
            return
        if jpype.isJVMStarted():
            for jar in jars():
                jpype.addClassPath(jar)
        else:
            _start(more)
        _silence_jena()
        _capture_log()
        options = jpype.JClass("org.mindswap.pellet.PelletOptions")
        options.USE_CLASSIFICATION_MONITOR = jpype.JClass("org.mindswap.pellet.PelletOptions$MonitorType").NONE
        # At its end the process waits for the thread that started Java, unless that is detached; its next call of Java
        # attaches it again, as one that is not waited for.
        jpype.JClass("java.lang.Thread").detach()
        _started_in.append(os.getpid())


def _start(more: tuple[str, ...]) -> None:
    archive = java_archive.archive_path()
    sharing = java_archive.options_for(archive)
    with without_options_of_others():
        jpype.startJVM(str(java_library()), *OPTIONS, *sharing, *more, classpath=jars(), convertStrings=False)
    if archive is not None:
        info = str(jpype.JClass("java.lang.System").getProperty("java.vm.info"))
        if sharing and "sharing" not in info:  # Java rejected it: it is damaged
            with suppress(OSError):
                archive.unlink()
        _archives.append(archive)


def make_archive_later() -> None:
    """Make the archive that shortens the next start of Java; call this after the first inference."""
    while _archives:
        java_archive.make_later(_archives.pop())


def _is_running() -> bool:
    """Whether Java runs in this process; an error when it was started in the process that this was forked from."""
    if _started_in and _started_in[0] != os.getpid():
        raise InputError(
            "Java was started before this process was forked, and cannot be used in it",
            remedy='start worker processes with the "spawn" method',
        )
    return bool(_started_in)


def java_class(name: str) -> Any:
    """Return a Java class by its full name; starts the virtual machine."""
    start()
    return jpype.JClass(name)


def take_warnings() -> list[str]:
    """Return what Java logged since the last call, the only place where Pellet reports that it dropped a rule."""
    taken = list(_warnings)
    _warnings.clear()
    return taken


def _silence_jena() -> None:
    """Load Jena's logger while nothing reaches the terminal: SLF4J reports there that it found nothing to log with."""
    system = jpype.JClass("java.lang.System")
    terminal = system.err
    system.setErr(jpype.JClass("java.io.PrintStream")(jpype.JClass("java.io.OutputStream").nullOutputStream()))
    try:
        jpype.JClass("org.slf4j.LoggerFactory").getILoggerFactory()
    finally:
        system.setErr(terminal)


def _capture_log() -> None:
    """Send java.util.logging to a list instead of the terminal."""

    @jpype.JImplements("java.util.logging.Filter")
    class Keep:
        @jpype.JOverride  # type: ignore[untyped-decorator]
        def isLoggable(self, record: Any) -> bool:  # noqa: N802 - the interface's name
            _warnings.append(str(record.getMessage()))
            return False  # nothing more is done with it

    root = jpype.JClass("java.util.logging.Logger").getLogger("")
    for handler in root.getHandlers():
        root.removeHandler(handler)
    collector = jpype.JClass("java.util.logging.ConsoleHandler")()
    collector.setLevel(jpype.JClass("java.util.logging.Level").WARNING)
    collector.setFilter(Keep())
    root.addHandler(collector)
    _kept.extend((root, collector))
