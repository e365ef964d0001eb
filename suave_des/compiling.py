"""Compilation of inner loops by numba, with the machine code cached on disk between processes."""

from __future__ import annotations

import ctypes
import hashlib
import os
import pickle
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar, cast, get_type_hints

import numba
import numpy as np
from numba.core import caching
from numpy.typing import NDArray

from suave_des.caches import private_cache
from suave_des.imports import hidden

# What numba would load on the first call. To see that there is a BLAS, it imports scipy.linalg,
# which takes 0.2 s and is used by no inner loop. There is one, as scipy is installed; what uses it
# imports it then.
with hidden("scipy.linalg"):
    from numba.np import arraymath
arraymath._HAVE_BLAS = True
_config: Any = numba.config
# Independent operations of a step are done side by side: a tenth less time, the same results.
_config.SLP_VECTORIZE = 1

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
Records = NDArray[Any]
"""An array of records, see `Record`."""

_DIGEST_BYTES = hashlib.sha256().digest_size
_F = TypeVar("_F", bound=Callable[..., Any])


def compiled(function: _F) -> _F:
    """Compile a function of arrays and numbers on its first call (division by zero gives inf or
    nan, as in numpy).
    """
    dispatcher: Any = numba.njit(error_model="numpy")(function)
    with suppress(
        RuntimeError
    ):  # no folder to keep machine code in: it is compiled in each process
        dispatcher._cache = _CodeCache(function)
    return cast(_F, dispatcher)


class Record(ctypes.Structure):
    """Base of records of numbers that Python and compiled functions share, by name.

    Fields are annotated with bool, int, float, another record, or an array's shape:
    `Annotated[Array, (6, 6)]`, which `shared` shows. A compiled function gets an array of records
    and takes one of it, a reference: `vehicle = vehicles[0]; vehicle.row += 1`.
    """


_R = TypeVar("_R", bound=type[Record])
_KINDS: dict[Any, Any] = {bool: ctypes.c_bool, int: ctypes.c_int64, float: ctypes.c_double}


def record(kind: _R) -> _R:
    """Lay out the fields of a record, as they are annotated in the class."""
    fields = []
    for name, annotation in get_type_hints(kind, include_extras=True).items():
        if name not in kind.__annotations__:
            continue
        field = _KINDS.get(annotation, annotation)
        for length in reversed(*getattr(annotation, "__metadata__", [()])):
            field = (ctypes.c_double if field is annotation else field) * length
        fields.append((name, field))
    kind._fields_ = fields
    return kind


def shared(records: ctypes.Array[Any]) -> Records:
    """View an array of records as numpy and compiled functions do: the same memory."""
    dtype = _dtypes.get(records._type_)
    if dtype is None:
        dtype = _dtypes[records._type_] = np.dtype(records._type_)
    return np.frombuffer(memoryview(records), dtype)


_dtypes: dict[type, np.dtype[Any]] = {}  # to make one takes as long as some flights


def for_types_of(function: _F, *arguments: object) -> _F:
    """Compile a function for the types of some arguments, and leave out looking them up at each
    call, which takes 1 us: arguments of other types would be misread.
    """
    dispatcher: Any = function
    if not hasattr(dispatcher, "overloads"):  # NUMBA_DISABLE_JIT
        return function
    signature = tuple(map(numba.typeof, arguments))
    dispatcher.compile(signature)
    return cast(_F, dispatcher.overloads[signature].entry_point)


# The cache, by private interfaces of numba: its own stops a process at a damaged file or a full
# disk, runs damaged machine code, and is beside the sources, which others may own.


class _CodeCache(caching.FunctionCache):
    """Keeps machine code in the user's cache folder; what is damaged there, or cannot be kept, is
    compiled again.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        if not os.environ.get("NUMBA_CACHE_DIR"):
            folder = private_cache("numba")
            if folder is None:
                raise RuntimeError("there is no cache folder")
            _config.CACHE_DIR = str(folder)
        super().__init__(function)
        plain = self._cache_file
        self._cache_file = _CheckedFile(
            self._cache_path, self._impl.filename_base, plain._source_stamp
        )

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        """Load the machine code for a signature; None if there is none, or none that can be
        used.
        """
        try:
            return super().load_overload(signature, target_context)
        except Exception:  # whatever a file that another version of numba has written leads to
            return None

    def save_overload(self, signature: Any, data: Any) -> None:
        """Keep the machine code for a signature, if possible."""
        with suppress(Exception):  # such as a full disk
            super().save_overload(signature, data)


class _CheckedFile(caching.IndexDataCacheFile):
    """Index and data files of numba's cache, each with a checksum."""

    def _load_index(self) -> dict[Any, Any]:
        version, stamp, overloads = self._read(self._index_path) or ("", None, {})
        return dict(overloads) if (version, stamp) == (self._version, self._source_stamp) else {}

    def _save_index(self, overloads: dict[Any, Any]) -> None:
        self._write(self._index_path, (self._version, self._source_stamp, overloads))

    def _load_data(self, name: str) -> Any:
        return self._read(self._data_path(name))

    def _save_data(self, name: str, data: Any) -> None:
        self._write(self._data_path(name), data)

    def _write(self, path: str, data: Any) -> None:
        with self._open_for_write(path) as file:
            content = self._dump(data)
            file.write(hashlib.sha256(content).digest() + content)

    def _read(self, path: str) -> Any:
        """Read a file; None if it is not there, or damaged."""
        content = Path(path).read_bytes() if Path(path).is_file() else b""
        digest, content = content[:_DIGEST_BYTES], content[_DIGEST_BYTES:]
        return pickle.loads(content) if hashlib.sha256(content).digest() == digest else None
