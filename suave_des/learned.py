"""Training results: the file that training writes and managers read."""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

from pydantic import ConfigDict, Field, SkipValidation
from pydantic.dataclasses import dataclass

from suave_des.errors import InputError
from suave_des.files import json_value, read_bytes

FORMAT = 1
_KEY = "suave_des_learned"
_LIMIT_BYTES = 100_000_000


@dataclass(frozen=True, config=ConfigDict(strict=True))
class Learned:
    """A file with a manager's training result.

    Attributes:
        scenario: name of the scenario that the manager was trained on.
        missions: number of missions, runs 1 to that.
        inputs_sha256: SHA-256 of each file that training read, by its name as given, the manager's
            code among them.
        learned: what the manager's hook `recall` was given, and has changed.
    """

    manager: str
    scenario: str
    seed: int
    missions: Annotated[int, Field(ge=1)]
    inputs_sha256: dict[str, str]
    learned: Annotated[dict[str, Any], SkipValidation]

    def text(self) -> str:
        """Write the file's content; an InputError if what was learned cannot be written as JSON."""
        try:
            if not _has_text_keys(self.learned):
                raise TypeError("a dict has a key that is not text")
            return json.dumps({_KEY: FORMAT, **asdict(self)}, indent=1, allow_nan=False) + "\n"
        except (TypeError, ValueError, RecursionError) as error:
            remedy = "it may have text, finite numbers, True, False, None, lists, and dicts by text"
            raise InputError(
                f"what {self.manager} has learned cannot be written: {error}", remedy=remedy
            ) from None


def read_file(path: Path) -> Learned:
    """Read the file that training wrote; an InputError if it cannot be read, or is something
    else.
    """
    with suppress(AttributeError, TypeError, ValueError):
        content = json_value(read_bytes(path, _LIMIT_BYTES))
        if content.pop(_KEY, None) == FORMAT and isinstance(content.get("learned"), dict):
            return Learned(**content)
    raise InputError(
        "is not a file that suave-des train has written", file=path, remedy="give one that is"
    )


def read_learned(path: Path) -> Mapping[str, object]:
    """Read a training result as read_file does, with immutable values, so that all missions find
    the same.
    """
    return MappingProxyType({key: _frozen(value) for key, value in read_file(path).learned.items()})


def _has_text_keys(value: object) -> bool:
    if isinstance(value, dict):  # JSON would write numbers as text, which no manager looks up
        return all(isinstance(key, str) and _has_text_keys(each) for key, each in value.items())
    return not isinstance(value, list | tuple) or all(map(_has_text_keys, value))


def _frozen(value: object) -> object:
    if isinstance(value, dict):
        return MappingProxyType({key: _frozen(each) for key, each in value.items()})
    return tuple(map(_frozen, value)) if isinstance(value, list) else value
