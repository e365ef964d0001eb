"""Layers of a scenario: a file merged deeply over its base, each value knowing its file and line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from suave_des.errors import InputError
from suave_des.scenario.wording import KeyPath, place_text
from suave_des.scenario.yamlfile import YamlDocument

_KIND_KEYS = ("kind", "distribution")
"""Keys that say what a mapping is: one of another kind replaces the base's, whose keys would not fit."""

_REMOVABLE_IN: tuple[KeyPath, ...] = (("signals",), ("knowledge", "values"))
"""Mappings of freely named entries, in which a null removes the base's entry."""


class Place(NamedTuple):
    """Where a value stands; depth 0 is the file that the user named, its base is 1, and so on."""

    depth: int
    line: int
    file: Path


@dataclass(frozen=True)
class Layer:
    """Plain data of one or several merged files, with the place of each key path."""

    data: dict[str, Any]
    places: Mapping[KeyPath, Place]

    @staticmethod
    def of(document: YamlDocument, depth: int) -> Layer:
        """The layer of one file."""
        places = {path: Place(depth, line, document.path) for path, line in document.lines.items()}
        return Layer(document.data, places)

    def place(self, key_path: KeyPath) -> Place:
        """Place of a key path, or of the nearest part that holds it."""
        for length in range(len(key_path), 0, -1):
            if (place := self.places.get(key_path[:length])) is not None:
                return place
        return self.places[()]

    def stands(self, key_path: KeyPath) -> bool:
        """Whether a key path stands in a file, and is not a default."""
        return key_path in self.places

    def error(self, problem: str, key_path: KeyPath, remedy: str | None) -> InputError:
        """An error about what stands at a key path."""
        place = self.place(key_path)
        return InputError(problem, file=place.file, place=place_text(place.line, key_path), remedy=remedy)

    def without(self, key: str) -> Layer:
        """The same without one key of the top level."""
        data = {other: value for other, value in self.data.items() if other != key}
        return Layer(data, {path: place for path, place in self.places.items() if path[:1] != (key,)})

    def below(self, key: str) -> Layer:
        """What stands under a key whose value is a mapping."""
        places = {path[1:]: place for path, place in self.places.items() if path[:1] == (key,)}
        return Layer(self.data[key], places)

    def replaced(self, key: str, value: Layer) -> Layer:
        """The same with another mapping under a key."""
        rest = self.without(key)
        places = {(key, *path): place for path, place in value.places.items()}
        return Layer({**rest.data, key: value.data}, {**rest.places, **places})


def merge(base: Layer, over: Layer) -> Layer:
    """Lay one layer over another: mappings merge, everything else replaces."""
    replaced: set[KeyPath] = set()
    data = _merge(base.data, over.data, (), replaced)
    kept = {
        path: place
        for path, place in base.places.items()
        if not any(path[:length] in replaced for length in range(1, len(path) + 1))
    }
    return Layer(data, {**kept, **over.places})


def _merge(base: dict[str, Any], over: dict[str, Any], path: KeyPath, replaced: set[KeyPath]) -> dict[str, Any]:
    merged = dict(base)
    for key, value in over.items():
        below = (*path, key)
        known = base.get(key)
        if isinstance(known, dict) and isinstance(value, dict) and _same_kind(known, value):
            merged[key] = _merge(known, value, below, replaced)
            continue
        replaced.add(below)
        if value is None and key in base and path in _REMOVABLE_IN:
            del merged[key]
        else:
            merged[key] = value
    return merged


def _same_kind(base: dict[str, Any], over: dict[str, Any]) -> bool:
    return all(over[key] == base.get(key, over[key]) for key in _KIND_KEYS if key in over)
