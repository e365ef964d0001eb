"""Runs a program as on other processors: with the code that libraries have for these."""

from __future__ import annotations

from tests.helpers.command import python

OTHERS = ("Haswell", "Nehalem", "Prescott")
"""Kinds of x86 processors, the newest of 2013, by the names of OpenBLAS, which comes with numpy."""


def printed_on_each(program: str) -> list[str]:
    """Return what a program prints on this processor and on each of the others."""
    environments = [{}, *({"OPENBLAS_CORETYPE": name} for name in OTHERS)]
    done = [python("-c", program, **environment) for environment in environments]
    for each in done:
        assert each.returncode == 0, each.stderr
    return [each.stdout for each in done]
