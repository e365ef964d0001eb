"""Takes managers that are defined in a notebook, or at a prompt, to worker processes, which could not import them."""

from __future__ import annotations

import pickle
import sys
from collections.abc import Iterable
from pathlib import Path

from suave_des.registry import manager_class

_MAIN = "__main__"


def main_classes(managers: Iterable[str]) -> bytes | None:
    """Pack the classes among managers that are defined in a main program without a file, with all that they use.

    Returns:
        What `define_in_main` takes; None if there are none, as in a script, which workers import.
    """
    names = [name for name in managers if name.startswith(f"{_MAIN}:")]
    file = getattr(sys.modules[_MAIN], "__file__", None)
    if not names or (file is not None and Path(file).is_file()):  # a program from standard input is "<stdin>"
        return None
    import cloudpickle  # takes a class by its content where it cannot be imported

    packed: bytes = cloudpickle.dumps({name.partition(":")[2]: manager_class(name) for name in names})
    return packed


def define_in_main(packed: bytes) -> None:
    """Define the classes in this process's main program, where missions look for them."""
    for name, each in pickle.loads(packed).items():
        setattr(sys.modules[_MAIN], name, each)
