"""Compilation of inner loops by numba, with the machine code cached on disk between processes."""

from __future__ import annotations

import ctypes
import importlib
import os
import pickle
import platform
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from enum import Enum, EnumType
from hashlib import sha256
from importlib.metadata import version
from inspect import CO_VARARGS, CO_VARKEYWORDS, isfunction, ismodule
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any, TypeVar, cast, get_type_hints

import numpy as np
from numpy.typing import NDArray

from suave_des.caches import keep_latest, private_cache
from suave_des.imports import hidden

with warnings.catch_warnings(), hidden("yaml", even_if_loaded=True):
    # numba would take settings from a file in the current folder, such as modules to import.
    warnings.simplefilter("ignore")
    import numba
    from numba.core import caching, compiler, serialize
    from numba.core.dispatcher import Dispatcher
    from numba.core.runtime.nrt import rtsys
numba.core.config._config_fname = os.devnull

_config: Any = numba.config
# Independent operations of a step are done side by side: a tenth less time, the same results.
_config.SLP_VECTORIZE = 1

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
Records = NDArray[Any]
"""An array of records, see `Record`."""

_FOLDER = "NUMBA_CACHE_DIR"
_LIBRARIES = ("builtins", "math", "numba", "numpy")
"""What is in them is known by its name, as their versions are."""
_DIGEST_BYTES = sha256().digest_size
_MOST_FILES = 256
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "_nrt": False}
"""Of numba: without its runtime, which counts references to arrays. An inner loop needs none, and
counting them takes up to half of a short call's time.
"""
_RUNTIME = b"NRT_"
"""What the names of the runtime's functions begin with; some arguments need them all the same."""
_F = TypeVar("_F", bound=Callable[..., object])


def compiled(function: _F) -> _F:
    """Compile a function of arrays and numbers on its first call (division by zero gives inf or
    nan, as in numpy).

    It neither makes arrays nor returns them or parts of them: its caller makes what it fills.
    """
    dispatcher: Any = numba.njit(**_OPTIONS)(function)
    dispatcher._cache = _CodeCache(dispatcher)
    return cast(_F, dispatcher)


class Record(ctypes.Structure):
    """Base of records of numbers that Python and compiled functions share, by name.

    Fields are annotated with bool, int, float, another record, or an array's shape:
    `Annotated[Array, (6, 6)]`, which `shared` shows. A compiled function gets an array of records
    and takes one of it, a reference: `vehicle = vehicles[0]; vehicle.row += 1`.
    """


_R = TypeVar("_R", bound=type[Record])
_KINDS: dict[object, type] = {bool: ctypes.c_bool, int: ctypes.c_int64, float: ctypes.c_double}


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


_dtypes: dict[type, np.dtype[np.void]] = {}  # to make one takes as long as some flights


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


class _CodeCache(caching._Cache):
    """Keeps machine code in the user's cache folder, by private interfaces of numba.

    numba's own cache stops a process at a damaged file or a full disk, runs damaged machine code,
    and takes a file whose index says so for the code of another version of the function. Here each
    file has a checksum that covers all that its code was made from; what is damaged, of something
    else, or cannot be kept is compiled again.
    """

    def __init__(self, dispatcher: Dispatcher) -> None:
        self._dispatcher = dispatcher

    @property
    def cache_path(self) -> str:
        """The folder; empty if there is none."""
        return os.environ.get(_FOLDER) or str(private_cache("numba") or "")

    def enable(self) -> None:
        """Do nothing: it always is."""

    disable = flush = enable

    def load_overload(self, signature: object, target_context: Any) -> object:
        """Load the machine code for a signature; None if there is none that can be used."""
        with suppress(Exception), _without_linear_algebra():  # no end to what a file leads to
            # numba's own cache calls target_context.refresh() first, which loads all that it needs
            # to compile, and takes 0.2 s.
            path, made_from = self._place(signature, target_context.codegen())
            content = path.read_bytes()
            digest, content = content[:_DIGEST_BYTES], content[_DIGEST_BYTES:]
            if sha256(made_from + content).digest() == digest:
                path.touch()
                if _RUNTIME in content:  # such as for texts; it takes 0.02 s
                    rtsys.initialize(target_context)
                parts = pickle.loads(content)
                return compiler.CompileResult._rebuild(target_context, *parts)
        # Now numba compiles, and would load these, with linear algebra.
        with _without_linear_algebra():
            importlib.import_module("numba.np.arraymath")
        return None

    def save_overload(self, signature: object, data: Any) -> None:
        """Keep the machine code for a signature, if possible."""
        with suppress(Exception):  # such as a full disk
            if data.lifted or data.library.has_dynamic_globals:  # it has addresses in it
                return
            path, made_from = self._place(signature, data.codegen)
            content = serialize.dumps(data._reduce())
            part = path.with_suffix(f".{os.getpid()}.part")
            try:
                part.write_bytes(sha256(made_from + content).digest() + content)
                part.replace(path)
            finally:
                part.unlink(missing_ok=True)
            keep_latest(path.parent, f"*{path.suffix}", _MOST_FILES)

    def _place(self, signature: object, codegen: Any) -> tuple[Path, bytes]:
        """Return the file of the machine code for a signature, and what that is made from.

        Raises:
            ValueError: it cannot be told what it is made from, or there is no cache folder.
        """
        if not (folder := self.cache_path):
            raise ValueError("no cache folder")
        function = self._dispatcher.py_func
        made_from = repr((*_SETTING, signature, codegen.magic_tuple())).encode()
        made_from += "\n".join(_ingredients(self._dispatcher, (), [])).encode()
        name = f"{function.__name__}-{sha256(made_from).hexdigest()[:40]}.nbc"
        return Path(folder) / name, made_from


@contextmanager
def _without_linear_algebra() -> Iterator[None]:
    """Let numba load its array functions without scipy.linalg, which it imports only to see that
    there is a BLAS: that takes 0.2 s, and no inner loop uses one.
    """
    with hidden("scipy.linalg"):
        yield
    arraymath: Any = sys.modules.get("numba.np.arraymath")
    if arraymath is not None:
        # There is a BLAS, as scipy is installed; what uses it imports it then.
        arraymath._HAVE_BLAS = True


_SETTING = (
    platform.python_version(),
    *(version(name) for name in ("numba", "llvmlite", "numpy")),
    sorted(
        (name, value)
        for name, value in os.environ.items()
        if name.startswith("NUMBA_") and name != _FOLDER
    ),
)


def _ingredients(value: Any, names: Sequence[str], seen: list[object]) -> Iterator[str]:
    """Yield what goes into machine code that uses a value: of a function, its code and all that its
    names stand for, as that is frozen; of a module, the values of the names that are used.

    Args:
        names: that the code which uses the value has.
        seen: functions whose ingredients were yielded; it grows.

    Raises:
        ValueError: it is something of which that cannot be told.
    """
    if isinstance(value, Dispatcher):
        yield f"compiled with {sorted(value.targetoptions.items())}"
        value = value.py_func
    if _module_of(value).partition(".")[0] in _LIBRARIES:
        yield f"{_module_of(value)}.{value.__name__}"
    elif isfunction(value):
        if value not in seen:
            seen.append(value)
            yield from _of_function(value, seen)
    elif ismodule(value):
        yield value.__name__
        yield from _of_names(names, vars(value), names, seen)
    elif isinstance(value, tuple):
        yield f"{type(value).__name__} of {len(value)}"
        for each in value:
            yield from _ingredients(each, names, seen)
    elif isinstance(value, np.ndarray):
        yield f"{value.dtype} {value.shape} {value.strides} {value.tobytes().hex()}"
    elif isinstance(value, EnumType):
        members: list[Enum] = list(value)
        yield f"{value.__name__} {[(each.name, each.value) for each in members]!r}"
    elif value is None or isinstance(value, bool | int | float | complex | str | np.generic | Enum):
        yield f"{type(value).__name__} {value!r}"
    else:
        raise ValueError(f"unknown: {value!r}")


def _module_of(value: Any) -> str:
    if isinstance(value, np.ufunc):
        return "numpy"  # before its version 2.2 they do not say so themselves
    return str(getattr(value, "__module__", ""))


def _of_function(function: FunctionType, seen: list[object]) -> Iterator[str]:
    """Yield the ingredients of a function, and of the functions in it."""
    closed_over = zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
    values = {**function.__globals__, **{name: cell.cell_contents for name, cell in closed_over}}
    defaults = function.__defaults__, tuple((function.__kwdefaults__ or {}).items())
    yield from _ingredients(defaults, (), seen)
    codes = [function.__code__]
    for code in codes:  # it grows
        codes += [each for each in code.co_consts if isinstance(each, CodeType)]
        constants = [each for each in code.co_consts if not isinstance(each, CodeType)]
        arguments = code.co_flags & (CO_VARARGS | CO_VARKEYWORDS), code.co_argcount
        yield f"{code.co_code.hex()} {code.co_exceptiontable.hex()} {arguments} {constants}"
        yield f"{code.co_names} {code.co_varnames} {code.co_freevars}"
        used = (*code.co_names, *code.co_freevars)
        yield from _of_names(used, values, code.co_names, seen)


def _of_names(
    used: Iterable[str], values: Mapping[str, Any], names: Sequence[str], seen: list[object]
) -> Iterator[str]:
    """Yield the names that have a value, and the ingredients of these."""
    for name in used:
        if name in values:
            yield name
            yield from _ingredients(values[name], names, seen)
