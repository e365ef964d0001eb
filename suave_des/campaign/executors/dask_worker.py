"""The input of a Dask worker, sent by value, and the functions that run missions from it."""

from __future__ import annotations

import errno
import hashlib
import importlib
import os
import pickle
import platform
import shutil
import sys
import tempfile
import threading
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import suave_des
from suave_des.campaign.inputs import declared_files, manager_code, scenarios_of, versions
from suave_des.campaign.missions import Finished, JobSpec, MissionFailure, MissionKey, WorkerError
from suave_des.campaign.user_modules import user_modules
from suave_des.errors import InputError, SuaveDesError

if TYPE_CHECKING:
    from suave_des.campaign.executors.mission_runner import MissionRunner

EXIT_AFTER_S = 30.0
"""A mission that is so much over its time, in code that cannot be interrupted, ends its worker."""
_CAMPAIGNS_KEPT = 4
"""So many campaigns can share a cluster without being prepared anew for each chunk."""
_MODULES = "modules"


@lru_cache(maxsize=1)
def needs() -> dict[str, str]:
    """Return what determines results apart from the job, by name; it must be equal on all machines of a campaign."""
    total = hashlib.sha256()
    folder = Path(suave_des.__file__).parent
    for path in sorted(folder.rglob("*.py")):
        total.update(f"{path.relative_to(folder)}\n".encode() + path.read_bytes())
    return {**versions(), "suave-des code": total.hexdigest()[:12], "machine": platform.machine()}


@dataclass(frozen=True)
class Parcel:
    """A job and the content of every file that it needs.

    Attributes:
        job: the job, with the paths that the user's files have there; its ontologies are all, imported ones included.
        files: contents of ontologies, files of rules, and files that managers declare, by these paths.
        modules: Python files of managers and functions, by their path below the folder of modules.
        manager_code: SHA-256 of each manager's module.
    """

    job: JobSpec
    files: Mapping[str, bytes]
    modules: Mapping[str, bytes]
    manager_code: Mapping[str, str]


def pack(job: JobSpec) -> Parcel:
    """Collect all that a job needs.

    Raises:
        InputError: a file cannot be read, or a manager is in a module that cannot be sent.
    """
    from suave_des.knowledge.ontology_file import collect
    from suave_des.simulation.functions import custom_functions

    ontologies, rules = job.loaded.ontologies, job.loaded.rules
    with suppress(InputError):  # reported by the managers that reason with it, if there are any
        ontologies = tuple(sorted(source.path for source in collect(ontologies)))
    declared = declared_files(scenarios_of(job.loaded, job.variation), job.managers)
    modules = user_modules(job.managers, custom_functions(job.loaded))
    return Parcel(
        replace(job, loaded=replace(job.loaded, ontologies=ontologies, manager_files=declared)),
        files={str(path): path.read_bytes() for path in (*ontologies, *rules, *declared.values())},
        modules={place: path.read_bytes() for place, path in modules.items()},
        manager_code={name: manager_code(name) for name in job.managers},
    )


class Unpacked:
    """A job whose files are in a folder of this machine.

    Attributes:
        job: with the paths that the files have here.
        folder: where they are.
        modules: as of the parcel.
        manager_code: as of the parcel.

    Args:
        parcel: of pack.
        folder: an empty one.
    """

    def __init__(self, parcel: Parcel, folder: Path) -> None:
        self.folder = Path(os.path.realpath(folder))
        self.modules, self.manager_code = frozenset(parcel.modules), parcel.manager_code
        for place, content in parcel.modules.items():
            self._write(self.folder / _MODULES / place, content)
        # Each file is in a folder of its own: it keeps its name, which counts, and is beside no other.
        here = {
            known: self._write(self.folder / f"{number:06}" / Path(known).name, content)
            for number, (known, content) in enumerate(parcel.files.items())
        }
        self._names = {str(path): known for known, path in here.items()}
        loaded = parcel.job.loaded
        loaded = replace(
            loaded,
            ontologies=tuple(here[str(path)] for path in loaded.ontologies),
            rules=tuple(here[str(path)] for path in loaded.rules),
            manager_files={name: here[str(path)] for name, path in loaded.manager_files.items()},
        )
        self.job = replace(parcel.job, loaded=loaded)

    @staticmethod
    def _write(path: Path, content: bytes) -> Path:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
        return path

    def with_known_names(self, finished: Finished) -> Finished:
        """Return an outcome that names the user's own files."""
        key, outcome = finished
        if isinstance(outcome, MissionFailure):
            return key, outcome._replace(cause=self._renamed(outcome.cause))
        return finished

    def error_with_known_names(self, error: SuaveDesError) -> SuaveDesError:
        """Return the same error, naming the user's own files."""
        reduced = error.__reduce__()
        assert isinstance(reduced, tuple)
        make, arguments = reduced[:2]
        renamed = make(*(self._renamed(part) if isinstance(part, str) else part for part in arguments))
        assert isinstance(renamed, SuaveDesError)
        return renamed

    def _renamed(self, text: str) -> str:
        for here, known in self._names.items():
            text = text.replace(here, known)
        return text


_campaigns: dict[str, tuple[Unpacked, MissionRunner]] = {}
"""Campaigns that this worker works for, by their tokens."""
_lock = threading.Lock()
"""Missions run one at a time, however many threads a worker has: they need the process for themselves."""


def run(token: str, here: Mapping[str, str], parcel: bytes, chunk: bytes) -> bytes:
    """Run missions in this process, which is a worker of a cluster.

    Args:
        token: the campaign's.
        here: needs() of the machine that the campaign was started on.
        parcel: a Parcel, pickled.
        chunk: keys of the missions, pickled.

    Returns:
        Pickled seconds that it took, and outcomes.

    Raises:
        InputError: the job cannot be run; files have the names that the user knows.
        WorkerError: there is no room for temporary files.
    """
    from distributed import get_worker

    worker, began_s = get_worker(), time.monotonic()
    where = f"worker {worker.address}"
    if needs() != here:
        raise misfit(where, here, needs())
    try:
        finished = _outcomes(token, parcel, chunk, worker.local_directory)
        return pickle.dumps((time.monotonic() - began_s, finished))
    except MemoryError:
        os._exit(errno.ENOMEM)  # as if it had been killed for it: a new worker begins with little
    except InputError as error:
        if error.file is not None:
            raise
        raise type(error)(f"{where}: {error.problem}", place=error.place, remedy=error.remedy) from None
    except OSError as error:
        raise WorkerError(f"{where}: its temporary files cannot be written: {error.strerror}") from error


def misfit(where: str, here: Mapping[str, str], there: Mapping[str, str]) -> InputError:
    """Return the error that machines differ in something that determines results."""
    name = next(name for name in here if there.get(name) != here[name])
    return InputError(
        f"{name} is {there.get(name, 'missing')} on {where}, and {here[name]} here, which could change results",
        remedy="install the same version on all machines",
    )


def _outcomes(token: str, parcel: bytes, chunk: bytes, scratch: str) -> list[Finished]:
    keys = [MissionKey(*key) for key in pickle.loads(chunk)]
    with _lock:
        unpacked: Unpacked | None = None
        try:
            if token in _campaigns:
                unpacked, runner = _campaigns[token]
            else:
                unpacked = _unpack(pickle.loads(parcel), scratch)
                _campaigns[token] = unpacked, (runner := _make_runner(unpacked))
            return [unpacked.with_known_names(finished) for finished in runner.each(keys)]
        except SuaveDesError as error:
            if unpacked is None:
                raise
            if token not in _campaigns:
                _remove(unpacked)
            raise unpacked.error_with_known_names(error) from None


def _unpack(parcel: Parcel, scratch: str) -> Unpacked:
    # Modules of the same name belong to one campaign at a time; others prepare anew with their next chunk.
    for token in [token for token, (other, _) in _campaigns.items() if other.modules & set(parcel.modules)]:
        forget(token)
    for token in list(_campaigns)[: 1 - _CAMPAIGNS_KEPT]:
        forget(token)
    return Unpacked(parcel, Path(tempfile.mkdtemp(prefix="suave-des-", dir=scratch)))


def _make_runner(unpacked: Unpacked) -> MissionRunner:
    from suave_des.campaign.executors.mission_runner import MissionRunner

    for place in unpacked.modules:
        names = place.removesuffix(".py").removesuffix("/__init__").split("/")
        for depth in range(1, len(names) + 1):
            sys.modules.pop(".".join(names[:depth]), None)
    importlib.invalidate_caches()
    sys.path.insert(0, str(unpacked.folder / _MODULES))
    for name, code in unpacked.manager_code.items():
        if manager_code(name) != code:
            raise InputError(f"manager {name!r} has different code there", remedy="install the same version")
    return MissionRunner(unpacked.job, EXIT_AFTER_S)


def forget(token: str) -> None:
    """Remove what was prepared for a campaign."""
    if token in _campaigns:
        _remove(_campaigns.pop(token)[0])


def _remove(unpacked: Unpacked) -> None:
    if (modules := str(unpacked.folder / _MODULES)) in sys.path:
        sys.path.remove(modules)
    shutil.rmtree(unpacked.folder, ignore_errors=True)
