"""suave-des bench: how fast missions are on this machine."""

from __future__ import annotations


def bench() -> None:
    """Measure."""
