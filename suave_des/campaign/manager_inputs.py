"""What managers are made of besides the project's own code: their modules, and the files that they declare."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from suave_des.campaign.own_modules import own_modules
from suave_des.campaign.variation import Variation
from suave_des.errors import InputError
from suave_des.managing.learned import read_file
from suave_des.registry import is_built_in, is_installed, manager_class, takes_argument
from suave_des.scenario.loader import LoadedScenario

_LIMIT_BYTES = 1_000_000_000


def check_managers(scenarios: Iterable[LoadedScenario], managers: Sequence[str]) -> dict[str, str]:
    """See that managers can work with scenarios, and that their files are there.

    Args:
        scenarios: the campaign's, with all settings that its managers will have.
        managers: names, or module:Class.

    Returns:
        SHA-256 of each file that managers are in or declare, by its place among modules, or its name as given.

    Raises:
        InputError: a manager refuses a scenario, or a file cannot be read.
    """
    inputs = {place: _sha256(path) for place, path in _modules(managers)}
    found: dict[str, Path] = {}
    for loaded in scenarios:
        for manager in managers:
            manager_class(manager).check(loaded)
        found |= declared_files([loaded], managers)
    return inputs | {name: _sha256(path) for name, path in found.items()}


def declared_files(scenarios: Iterable[LoadedScenario], managers: Sequence[str]) -> dict[str, Path]:
    """Return where the files are that managers declare, by their names as given.

    Raises:
        InputError: one is not there.
    """
    return {
        name: path
        for loaded in scenarios
        for manager in managers
        for name, path in loaded.declared_files(manager, manager_class(manager))
    }


def scenarios_of(loaded: LoadedScenario, variation: Variation) -> Iterator[LoadedScenario]:
    """Yield scenarios that have, between them, each value of the managers' settings that a sweep varies."""
    if any(path.startswith("managers.") for path in variation.paths.values()):
        yield from (variation.scenario(loaded, point) for point in sorted(set(variation.sweep.each_value())))
    else:
        yield loaded


def trained_on(loaded: LoadedScenario, managers: Sequence[str], seed: int, runs: int) -> Iterator[str]:
    """Yield a remark for each manager whose training had missions of the campaign: its results say little."""
    for manager in managers:
        name = loaded.manager_settings(manager).get("learned")
        if name is not None:
            learned = read_file(loaded.manager_file(manager, str(name)))
            if (learned.scenario, learned.seed) == (loaded.scenario.name, seed):
                seen = min(runs, learned.missions)
                yield f"{manager}: runs 1 to {seen} are missions that it was trained on; give another --seed"


def check_trusted(managers: Iterable[str], named: Iterable[str], folder: Path, *, confirmed: bool) -> None:
    """See that the code of a received campaign's managers is meant to run here; nothing is imported before that.

    What is imported already, as by a script that resumes a campaign with a manager of its own, runs in any case.

    Args:
        managers: those that the folder names.
        named: those that the user has named himself.
        folder: the campaign's.
        confirmed: whether the user has said that the folder's managers may run.

    Raises:
        InputError: a manager is neither installed nor named nor confirmed.
    """
    unknown = [name for name in managers if not (is_installed(name) or name in set(named) or _is_imported(name))]
    if unknown and not confirmed:
        raise InputError(
            f"the campaign would run the code of {', '.join(unknown)}, which this folder names",
            file=folder,
            remedy=f"if you trust it, name it: --managers {','.join(unknown)}; or give --yes",
        )


def _is_imported(name: str) -> bool:
    return ":" in name and not takes_argument(name) and name.partition(":")[0] in sys.modules


def _modules(managers: Sequence[str]) -> Iterator[tuple[str, Path]]:
    """Yield the files that managers are in: their modules, and what these import of the user's own."""
    for manager in managers:
        if is_built_in(manager) or takes_argument(manager):
            continue
        module = manager_class(manager).__module__
        if module == "__main__":
            continue
        path = Path(getattr(sys.modules[module], "__file__", None) or "")
        if path.is_file():
            is_package = path.stem == "__init__"
            yield f"{module.replace('.', '/')}{'/__init__' if is_package else ''}{path.suffix}", path
        if path.suffix == ".py":
            yield from own_modules([manager]).items()


def _sha256(path: Path) -> str:
    try:
        if path.stat().st_size > _LIMIT_BYTES:
            raise InputError("is too large", file=path, remedy=f"at most {_LIMIT_BYTES:,} bytes")
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise InputError(
            f"cannot be read: {error.strerror}", file=path, remedy="check the name and the rights"
        ) from None
