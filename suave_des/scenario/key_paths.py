"""Values of a scenario by their key paths, such as signals.water_visibility.period_s."""

from __future__ import annotations

from typing import Any

from suave_des.errors import InputError, did_you_mean


def plain_value(data: dict[str, Any], path: str) -> Any:
    """Give the value at a key path of a scenario as plain data.

    Raises:
        InputError: the path leads nowhere.
    """
    holder, key = _holder(data, path)
    return holder[key]


def set_value(data: dict[str, Any], path: str, value: Any) -> None:
    """Replace the value at a key path of a scenario as plain data.

    Raises:
        InputError: the path leads nowhere.
    """
    holder, key = _holder(data, path)
    holder[key] = value


def _parts(data: dict[str, Any], path: str) -> list[str]:
    """The keys of a key path; names of managers may have points in them, and their settings need not be there yet."""
    first, _, rest = path.partition(".")
    if first != "managers" or ":" not in rest:
        return path.split(".")
    managers = data["managers"]
    named = max((name for name in managers if rest.startswith(f"{name}.")), key=len, default=None)
    if named is None:
        module, _, below = rest.partition(":")
        named = f"{module}:{below.partition('.')[0]}"
    keys = rest.removeprefix(named).removeprefix(".").split(".")
    settings = managers.setdefault(named, {})
    if isinstance(settings, dict) and keys != [""]:
        settings.setdefault(keys[0], None)
    return ["managers", named, *(keys if keys != [""] else [])]


def _holder(data: dict[str, Any], path: str) -> tuple[Any, Any]:
    """The mapping or list that holds the value at a key path, and its key there."""
    here, parts = data, _parts(data, path)
    for depth, part in enumerate(parts):
        if isinstance(here, list):
            if not (part.isascii() and part.isdigit() and len(part) < 10) or int(part) >= len(here):
                raise InputError(f"{path}: there is no entry {part}", remedy=f"entries are 0 to {len(here) - 1}")
        elif not isinstance(here, dict):
            raise InputError(f"{path}: {'.'.join(parts[:depth])} is a plain value", remedy="leave out what follows it")
        elif part not in here:
            raise InputError(f"{path}: unknown key", remedy=did_you_mean(part, sorted(map(str, here))))
        holder, key = here, int(part) if isinstance(here, list) else part
        here = here[key]
    return holder, key
