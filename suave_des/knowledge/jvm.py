"""The Java virtual machine inside this process: started once, when first needed, and never at import.

A virtual machine cannot be restarted, and a process that is forked after its start hangs: workers must be
spawned, and each has one of its own.
"""

from __future__ import annotations

import os
import threading
from pathlib import Path
from typing import Any, Final

import jpype
import jpype.config
import owlready2

from suave_des.errors import InputError
from suave_des.knowledge.java import java_library

_OPTIONS: Final = (
    "-Xrs",  # Ctrl-C belongs to Python: without this the process dies without running "finally"
    "-Xmx512m",
    "-XX:TieredStopAtLevel=1",  # halves the time to the first inference
    "-XX:+UseSerialGC",  # one thread less per worker; the heap is small
    "-Xshare:auto",
    "--enable-native-access=ALL-UNNAMED",  # else JPype's loading of its library is reported on the terminal
)
_lock: Final = threading.RLock()
_warnings: Final[list[str]] = []
_started_in: list[int] = []
_kept: Final[list[Any]] = []  # what Java holds on to by weak references only


def start() -> None:
    """Start the virtual machine, or do nothing if it runs in this process.

    Raises:
        InputError: there is no usable Java, or this process was forked from one where it ran.
    """
    if _is_running():  # asked before the lock is taken, which a forked process could find locked for ever
        return
    with _lock:
        if _is_running():
            return
        jars = sorted(Path(owlready2.__file__).with_name("pellet").glob("*.jar"))
        if jpype.isJVMStarted():
            for jar in jars:
                jpype.addClassPath(str(jar))
        else:
            jpype.startJVM(str(java_library()), *_OPTIONS, classpath=[str(jar) for jar in jars], convertStrings=False)
            # Java's end waits for the thread that started it, unless that is the one in which the process ends.
            if threading.current_thread() is not threading.main_thread():
                thread = jpype.JClass("java.lang.Thread")
                thread.detach()
                thread.attachAsDaemon()
        _capture_log()
        options = jpype.JClass("org.mindswap.pellet.PelletOptions")
        options.USE_CLASSIFICATION_MONITOR = jpype.JClass("org.mindswap.pellet.PelletOptions$MonitorType").NONE
        _started_in.append(os.getpid())


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
