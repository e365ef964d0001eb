"""A signal that asks to stop is raised, wherever Python is when it comes."""

import signal
import subprocess
import sys
import time

import pytest

from suave_des.interrupts import Stopped, exit_status, signals_raised


class Deaf:
    """What is raised as it is forgotten, nobody hears; nor in Python code that compiled code calls."""

    def __init__(self, number: int) -> None:
        self.number = number

    def __del__(self) -> None:
        signal.raise_signal(self.number)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_where_an_exception_is_lost_it_is_asked_again(number: int, capsys: pytest.CaptureFixture[str]) -> None:
    with signals_raised():
        with pytest.raises(Stopped):
            Deaf(number)
            time.sleep(20.0)
        assert exit_status() == 128 + number
    assert capsys.readouterr().err == ""


def test_what_else_is_lost_is_told_as_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    class Clumsy:
        def __del__(self) -> None:
            raise ValueError

    told = []
    monkeypatch.setattr("sys.unraisablehook", lambda lost: told.append(lost.exc_type))
    with signals_raised():
        Clumsy()
    assert told == [ValueError]


def test_when_the_command_has_ended_nothing_is_asked_any_more(monkeypatch: pytest.MonkeyPatch) -> None:
    heard = []
    before = signal.signal(signal.SIGTERM, lambda number, frame: heard.append(number))
    try:
        with signals_raised():
            Deaf(signal.SIGTERM)
        time.sleep(0.3)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert heard == []


def test_what_the_process_was_started_to_ignore_does_not_end_a_query() -> None:
    code = (
        "import signal\n"
        "from suave_des.interrupts import ends_at_once\n"
        "signal.signal(signal.SIGHUP, signal.SIG_IGN)\n"
        "with ends_at_once(10.0, 'late'):\n    signal.raise_signal(signal.SIGHUP)\n"
        "print('done')\n"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "done\n", "")
