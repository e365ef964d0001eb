"""What tests need of the machine beside Python and its packages."""

from __future__ import annotations

import os
import subprocess
from typing import NoReturn

import pytest

PROGRAMS = {
    "curl": ("curl", "--version"),
    "perl with JSON::PP": ("perl", "-MJSON::PP", "-e", "1"),
    "node": ("node", "--version"),
    "gcc": ("gcc", "--version"),
}
"""Programs that README does not ask for, each with a command that succeeds where it is."""


def missing(what: str) -> NoReturn:
    """Skip the test and say what is missing, or fail it where the environment says CI=true."""
    if os.environ.get("CI") == "true":
        pytest.fail(what)
    pytest.skip(what)


def is_there(name: str) -> bool:
    """Whether one of the programs is on this machine and works."""
    try:
        return subprocess.run(PROGRAMS[name], capture_output=True, check=False).returncode == 0
    except FileNotFoundError:
        return False


def need(name: str) -> None:
    """Go on where one of the programs is there; see `missing` otherwise."""
    if not is_there(name):
        missing(f"there is no {name}")
