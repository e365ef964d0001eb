"""Faults are made where they can change what a module does."""

import pytest

from tests.mutate import Fault, faults_in, is_module

TEXT = 'def limited(x):\n    """At most 5 and not less."""\n    return x if x < 5 else 4\n'


def test_faults_of_a_module():
    assert list(faults_in(TEXT)) == [
        Fault(3, 18, "<", "<="),
        Fault(3, 20, "5", "(5 + 1)"),
        Fault(3, 27, "4", "(4 + 1)"),
    ]


def test_a_fault_stands_in_place_of_its_token():
    (fault, *_) = faults_in(TEXT)
    assert fault.put_into(TEXT) == TEXT.replace("x < 5", "x <= 5")


@pytest.mark.parametrize(("text", "is_python"), [("a = 1\n", True), ("a = *\n", False)])
def test_what_is_no_longer_python_is_no_fault(text, is_python):
    assert is_module(text) is is_python
