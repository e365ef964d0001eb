"""Writes the rows of runs.csv as Parquet, which keeps their types."""

from __future__ import annotations

import io
from importlib.util import find_spec
from typing import TYPE_CHECKING

from suave_des.errors import InputError

if TYPE_CHECKING:
    import pandas

PARQUET_FILE = "runs.parquet"


def check_parquet() -> None:
    """See that Parquet can be written.

    Raises:
        InputError: pyarrow is not installed.
    """
    if find_spec("pyarrow") is None:
        raise InputError("Parquet needs pyarrow, which is not installed", remedy="pip install 'suave-des[parquet]'")


def parquet_bytes(frame: pandas.DataFrame) -> bytes:
    """Return a data frame as the content of a Parquet file."""
    buffer = io.BytesIO()
    frame.to_parquet(buffer, engine="pyarrow", index=False)
    return buffer.getvalue()
