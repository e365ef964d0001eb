"""The Java virtual machine inside this process: started once, when first needed, and never at import.

A virtual machine cannot be restarted, and a process that is forked after its start hangs: workers must be
spawned, and each has one of its own.
"""

from __future__ import annotations

import os
import threading
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from suave_des.errors import InputError
from suave_des.imports import hidden
from suave_des.knowledge import java_archive
from suave_des.knowledge.java import java_library

with hidden("numpy"):  # which takes 0.1 s, and JPype needs only to tell its truth values from others
    import jpype
    import jpype.config

#: What Java is started with, whatever the machine.
OPTIONS: Final = (
    "-Xrs",  # Ctrl-C belongs to Python: without this the process dies without running "finally"
    "-Xmx512m",
    "-XX:TieredStopAtLevel=1",  # halves the time to the first inference
    "-XX:+UseSerialGC",  # one thread less per worker; the heap is small
    "-Xshare:auto",
    "-Xlog:disable",  # of Java itself; an archive that it cannot use would be reported on the terminal
    "--enable-native-access=ALL-UNNAMED",  # else JPype's loading of its library is reported on the terminal
)
#: What Java throws, in Python.
JavaError: Final = jpype.JException
_lock: Final = threading.RLock()
_warnings: Final[list[str]] = []
_started_in: list[int] = []
_archives: Final[list[Path]] = []  # of this process's Java, until it is seen to that there is one
_kept: Final[list[Any]] = []  # what Java holds on to by weak references only


def start(*more: str) -> None:
    """Start the virtual machine, or do nothing if it runs in this process.

    Args:
        more: options to start it with besides.

    Raises:
        InputError: there is no usable Java, or this process was forked from one where it ran.
    """
    if _is_running():  # asked before the lock is taken, which a forked process could find locked for ever
        return
    with _lock:
        if _is_running():
            return
        jars = _jars()
        if jpype.isJVMStarted():
            for jar in jars:
                jpype.addClassPath(jar)
        else:
            _start(jars, more)
        _silence_jena()
        _capture_log()
        options = jpype.JClass("org.mindswap.pellet.PelletOptions")
        options.USE_CLASSIFICATION_MONITOR = jpype.JClass("org.mindswap.pellet.PelletOptions$MonitorType").NONE
        # The end of the process waits for the thread that started Java, unless it lets go; it is attached anew, as one
        # that is not waited for, when it next calls Java.
        jpype.JClass("java.lang.Thread").detach()
        _started_in.append(os.getpid())


def _start(jars: list[str], more: tuple[str, ...]) -> None:
    archive = java_archive.archive_path(class_path(), OPTIONS)
    sharing = java_archive.use_options(archive)
    jpype.startJVM(str(java_library()), *OPTIONS, *sharing, *more, classpath=jars, convertStrings=False)
    if archive is not None:
        if sharing:
            java_archive.remove_refused(archive, str(jpype.JClass("java.lang.System").getProperty("java.vm.info")))
        _archives.append(archive)


def make_archive_later() -> None:
    """Have the next start of Java take less time, if that can be: to be called when the first inference is done."""
    while _archives:
        java_archive.make_later(_archives.pop())


def class_path() -> list[str]:
    """The class path that Java is started with, as JPype completes it."""
    return [*_jars(), str(Path(jpype.__file__).resolve().parent.parent / "org.jpype.jar")]


def _jars() -> list[str]:
    """owlready2's jars, without log4j: to find out that there is nothing to be logged it takes 0.2 s."""
    package = find_spec("owlready2")  # which is not imported: that takes time too
    assert package is not None and package.origin is not None
    return sorted(str(jar) for jar in Path(package.origin).with_name("pellet").glob("*.jar") if "log4j" not in jar.name)


def _is_running() -> bool:
    """Whether Java runs in this process; an error when it was started in the process that this was forked from."""
    if _started_in and _started_in[0] != os.getpid():
        raise InputError(
            "Java was started before this process was forked, and cannot be used in it",
            remedy='start worker processes with the "spawn" method',
        )
    return bool(_started_in)


def java_class(name: str) -> Any:
    """A Java class by its full name; starts the virtual machine."""
    start()
    return jpype.JClass(name)


def take_warnings() -> list[str]:
    """What Java logged since the last call: the only place where Pellet says that it dropped a rule."""
    taken = list(_warnings)
    _warnings.clear()
    return taken


def _silence_jena() -> None:
    """Have Jena log nowhere. Its logger, SLF4J, would say on the terminal that it found nothing to log with."""
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
