"""What travels to a machine that shares no disk with this one: a job, and the content of every file that it needs."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from suave_des.campaign.outcomes import Failure, Finished, Job
from suave_des.campaign.own_modules import own_modules
from suave_des.campaign.request import manager_code
from suave_des.errors import InputError, SuaveDesError
from suave_des.knowledge.inference_cache import InferenceCache
from suave_des.managing.registry import manager_class
from suave_des.scenario.loader import LoadedScenario

MODULES_FOLDER = "modules"
_FILES_FOLDER = "files"
_KNOWLEDGE_BASES, _POINTS_LOOKED_AT = 16, 10_000
"""What reasoners remember is taken along for so many knowledge bases, each of which takes half a second to read."""


@dataclass(frozen=True)
class Parcel:
    """A job by value.

    Attributes:
        job: the job, with the paths that the user's files have here.
        ontologies: names and contents of ontologies, imported ones included.
        rules: names and contents of files of rules.
        modules: Python files of managers, by their place below the folder of modules.
        manager_code: SHA-256 of each manager's module.
        memories: what reasoners remember, by the digest of what it rests on.
    """

    job: Job
    ontologies: tuple[tuple[str, bytes], ...]
    rules: tuple[tuple[str, bytes], ...]
    modules: Mapping[str, bytes]
    manager_code: Mapping[str, str]
    memories: Mapping[str, bytes]


def pack(job: Job) -> Parcel:
    """A job with all that it needs.

    Raises:
        InputError: a file cannot be read, or a manager is in a module that cannot travel.
    """
    return Parcel(
        job,
        ontologies=tuple((str(path), path.read_bytes()) for path in _with_imports(job.loaded)),
        rules=tuple((str(path), path.read_bytes()) for path in job.loaded.rules),
        modules={place: path.read_bytes() for place, path in own_modules(job.managers).items()},
        manager_code={name: manager_code(name) for name in job.managers},
        memories=_memories(job),
    )


def _with_imports(loaded: LoadedScenario) -> list[Path]:
    from suave_des.knowledge.ontology_file import collect

    try:
        return sorted(source.path for source in collect(loaded.ontologies))
    except InputError:  # told by those who reason with it, if there are any
        return list(loaded.ontologies)


def _memories(job: Job) -> dict[str, bytes]:
    if not any(manager_class(name).needs_knowledge for name in job.managers):
        return {}
    from suave_des.knowledge.cached_pellet import cache_digest
    from suave_des.simulation.knowledge import open_base

    digests = []
    for loaded in _knowledge_bases(job):
        if loaded.scenario.knowledge.reasoner == "remembered":
            with suppress(InputError):  # told by the missions that reason with it
                digests.append(cache_digest(open_base(loaded)))
    return {digest: InferenceCache(digest).content() for digest in digests}


def _knowledge_bases(job: Job) -> Iterator[LoadedScenario]:
    """The scenario, once for each knowledge base that a sweep makes of it, as far as these are few."""
    variation = job.variation
    varied = [name for name, path in variation.paths.items() if path.startswith("knowledge.")]
    if not varied:
        yield job.loaded
        return
    seen: list[list[Any]] = []
    for point in range(min(variation.sweep.points, _POINTS_LOOKED_AT)):
        values = variation.sweep.values(point)
        if (its := [values[name] for name in varied]) not in seen:
            seen.append(its)
            yield variation.scenario(job.loaded, point)
            if len(seen) == _KNOWLEDGE_BASES:
                return


@dataclass(frozen=True)
class Unpacked:
    """A job whose files are in a folder of this machine.

    Attributes:
        job: with the paths that the files have here.
        names: of each of these paths, the name that the user knows.
    """

    job: Job
    names: Mapping[str, str]

    def as_known(self, finished: Iterable[Finished]) -> list[Finished]:
        """Outcomes that name the user's own files."""
        return [
            (key, outcome._replace(cause=self._renamed(outcome.cause)) if isinstance(outcome, Failure) else outcome)
            for key, outcome in finished
        ]

    def error_as_known(self, error: SuaveDesError) -> SuaveDesError:
        """The same error, naming the user's own files."""
        reduced = error.__reduce__()
        assert isinstance(reduced, tuple)
        make, arguments = reduced[:2]
        renamed = make(*(self._renamed(part) if isinstance(part, str) else part for part in arguments))
        assert isinstance(renamed, SuaveDesError)
        return renamed

    def _renamed(self, text: str) -> str:
        for here, known in self.names.items():
            text = text.replace(here, known)
        return text


def unpack(parcel: Parcel, folder: Path) -> Unpacked:
    """Write a parcel's files into a folder, its memories into this user's cache.

    Args:
        parcel: of pack.
        folder: an empty one.
    """
    folder = Path(os.path.realpath(folder))
    names: dict[str, str] = {}
    for place, content in parcel.modules.items():
        path = folder / MODULES_FOLDER / place
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    for digest, content in parcel.memories.items():
        InferenceCache(digest).take_over(content)
    ontologies, rules = (_written(files, folder, names) for files in (parcel.ontologies, parcel.rules))
    loaded = replace(parcel.job.loaded, ontologies=ontologies, rules=rules)
    return Unpacked(replace(parcel.job, loaded=loaded), names)


def _written(files: Iterable[tuple[str, bytes]], folder: Path, names: dict[str, str]) -> tuple[Path, ...]:
    """Each file in a folder of its own: it keeps its name, which counts, and is beside no other."""
    paths = []
    for known, content in files:
        path = folder / _FILES_FOLDER / f"{len(names):06}" / Path(known).name
        path.parent.mkdir(parents=True)
        path.write_bytes(content)
        names[str(path)] = known
        paths.append(path)
    return tuple(paths)
