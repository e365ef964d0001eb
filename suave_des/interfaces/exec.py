"""Managers in other processes and languages: `exec:COMMAND` exchanges JSON lines with a program by
stdin and stdout.

Each message is a line, and gets a line as its answer; mission time stands still until then. A
program serves one mission after the other; as many are started in a process as it has missions
under way at a time, mostly one. The messages: docs/guides/other-programs.md.
"""

from __future__ import annotations

import atexit
import json
import os
import select
import shlex
import signal
import subprocess
import time
from collections import defaultdict
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from functools import cache, partial
from itertools import chain
from math import inf
from operator import attrgetter
from pathlib import Path
from typing import ClassVar
from weakref import WeakSet, finalize

from suave_des.clock import call_at, until
from suave_des.domain import Task
from suave_des.errors import InputError, PassingError, did_you_mean, shown
from suave_des.files import Json, json_value
from suave_des.managing.base import AdaptationProcess, Dependencies, ManagingSubsystem, System
from suave_des.metrics.result import MissionMetrics
from suave_des.monitor.diagnostics import EXEMPLAR_KINDS, Diagnostic, Kind

PROTOCOL = 1
"""Version of the messages; a program of another version is refused."""
LINE_LIMIT_BYTES = 1_000_000
TIME_OUT_S = 10.0
"""So long a program may take for an answer; the setting `time_out_s` changes it."""
_LONGEST_S = 1e6
"""Of thinking."""
_END_S = 1.0
_LOOK_S = 1.0
"""Longest wait for a program: one that took twice as long was one in which this process was stopped.
"""
_READ_BYTES = 65536
_KILLS_AT_END_OF_INPUT = 'read -r _; sleep 1; kill -s KILL -- "-$1"'
KINDS = {
    "measured": Kind.QA_STATUS,
    "component_status": Kind.COMPONENT_STATUS,
    "pose": Kind.POSE,
    "distance": Kind.DISTANCE,
}
_NAMES = {kind: name for name, kind in KINDS.items()}
_ANSWER = ("modes", "log", "latency_s")
_OWN_SETTINGS = ("time_out_s", "real_thinking")
_FIRST_ANSWER = ("protocol", "period_s", "starts_s", "subscribes_to", "depends_on", *_ANSWER)


class ProgramError(Exception):
    """A program that exits, does not answer, or violates the protocol."""


class ProgramTimeoutError(ProgramError, PassingError):
    """A program that does not answer in time, or was killed: neither need happen again."""


class _Program:
    """A running program."""

    has_ended = False

    def __init__(self, command: tuple[str, ...]) -> None:
        try:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                bufsize=0,
                start_new_session=True,
            )
        except OSError as error:
            remedy = "give a program that can be run, such as exec:./my_manager or exec:perl my_manager.pl"
            raise InputError(
                f"cannot be run: {error.strerror}", file=command[0], remedy=remedy
            ) from None
        assert self._process.stdin is not None and self._process.stdout is not None
        self._in = self._process.stdin.fileno()
        self._out = self._process.stdout.fileno()
        # If this process is killed, its end of the pipe closes, and the shell kills the program
        # with its children.
        group = str(self._process.pid)
        self._watcher = subprocess.Popen(
            ("sh", "-c", _KILLS_AT_END_OF_INPUT, "sh", group),
            stdin=subprocess.PIPE,
            start_new_session=True,
        )
        self._poll = select.poll()
        self._poll.register(self._out, select.POLLIN)
        self._rest = b""

    def ask(self, message: Mapping[str, object], time_out_s: float) -> Json:
        """Send a message, and return its answer."""
        if self.has_ended:
            raise ProgramError("was ended after an error")
        # of mappings of other types
        line = json.dumps(message, separators=(",", ":"), default=dict).encode() + b"\n"
        try:
            while line:
                line = line[os.write(self._in, line) :]
        except BrokenPipeError:
            raise self._ended() from None
        answer = self._line(time_out_s)
        try:
            found = json_value(answer)
        except ValueError:
            raise ProgramError(
                f"answered {shown(answer[:80].decode(errors='replace'))}, which is not JSON"
            ) from None
        if not isinstance(found, dict):
            raise ProgramError(f"answered {shown(found)}, which is not an object")
        return found

    def _line(self, time_out_s: float) -> bytes:
        due_s = time.monotonic() + time_out_s
        while b"\n" not in self._rest:
            if len(self._rest) > LINE_LIMIT_BYTES:
                raise ProgramError(f"answered with a line of more than {LINE_LIMIT_BYTES:,} bytes")
            if not self._has_more(due_s):
                if self._process.poll() is not None:  # and a child keeps its output open
                    raise self._ended()
                half = " but half a line" if self._rest else ""
                raise ProgramTimeoutError(f"gave no answer{half} within {time_out_s:g} s")
            if not (part := os.read(self._out, _READ_BYTES)):
                raise self._ended()
            self._rest += part
        line, self._rest = self._rest.split(b"\n", 1)
        if self._rest:
            raise ProgramError("answered with more than one line")
        return line

    def _has_more(self, due_s: float) -> bool:
        """Wait until the program has written something or ended, or a time has come.

        One at which this process was stopped (Ctrl-Z), and the program perhaps, too, is put off.
        """
        while (wait_s := due_s - time.monotonic()) > 0.0:
            part_s = min(wait_s, _LOOK_S)
            if self._poll.poll(part_s * 1e3):
                return True
            if self._process.poll() is not None:
                break
            stopped_s = time.monotonic() - (due_s - wait_s) - part_s
            if stopped_s > _LOOK_S:
                due_s += stopped_s
        return bool(self._poll.poll(0))

    def _ended(self) -> ProgramError:
        with suppress(subprocess.TimeoutExpired):
            status = self._process.wait(_END_S)
            kind = ProgramTimeoutError if status == -signal.SIGKILL else ProgramError
            return kind(f"ended with status {status}")
        return ProgramError("closed its output")

    def end(self) -> None:
        """End the program: it sees the end of its input; then whatever is left of it and its
        children is killed.
        """
        if self.has_ended:
            return
        self.has_ended = True
        for stream in (self._process.stdin, self._process.stdout):
            assert stream is not None
            stream.close()
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(_END_S)
        # nobody is left; macOS says so by a PermissionError
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        self._watcher.kill()
        self._watcher.communicate()


_idle: defaultdict[tuple[str, ...], list[_Program]] = defaultdict(list)
"""The programs of this process that are in no mission, by their commands."""
_in_missions: WeakSet[_Program] = WeakSet()
"""The programs of this process that are in a mission."""


def _take(command: tuple[str, ...]) -> _Program:
    """Return a program for a mission: one that is idle, or a new one."""
    idle = _idle[command]
    program = idle.pop() if idle else _Program(command)
    _in_missions.add(program)
    return program


def _give_back(command: tuple[str, ...], program: _Program) -> None:
    """Keep the program of a mission that is over for the next one."""
    _in_missions.discard(program)
    if not program.has_ended:
        _idle[command].append(program)


@atexit.register
def end_programs() -> None:
    """End all programs that this process has started."""
    for program in (*_in_missions, *chain.from_iterable(_idle.values())):
        program.end()
    _in_missions.clear()
    _idle.clear()


class ExecManager(ManagingSubsystem):
    """exec:COMMAND: a program that receives a message for each event, and answers with modes."""

    command: ClassVar[str]

    @classmethod
    def input_files(cls, settings: Mapping[str, object]) -> Collection[str]:
        """The files that the command names, and the one that its setting `learned` names."""
        words = shlex.split(cls.command)
        return (*(word for word in words if Path(word).is_file()), *super().input_files(settings))

    def __init__(self, system: System) -> None:
        super().__init__(system)
        self._command = tuple(map(self._located, shlex.split(self.command)))
        self._time_out_s = float(system.settings.get("time_out_s", TIME_OUT_S))
        self._real_thinking = float(system.settings.get("real_thinking", 0.0))
        if not 0.0 <= self._real_thinking < inf:
            raise InputError(
                f"real_thinking: {self._real_thinking:g} is out of range",
                remedy="give seconds of mission time per second of thinking",
            )
        self._thinks_until_s = 0.0
        self._depends_on: Dependencies | None = None
        self._begin: Json = {}
        self._program: _Program | None = None
        self._give_back: Callable[[], object] = lambda: None

    def _located(self, word: str) -> str:
        """Return where the file is that a word of the command names, or the word if it names
        none.
        """
        try:
            return str(self.system.file(word).resolve())
        except InputError:
            return word

    def recall(self, learned: Mapping[str, object], training: bool) -> None:
        """Tell the program what there is, and take its settings."""
        system = self.system
        settings = {
            name: value for name, value in system.settings.items() if name not in _OWN_SETTINGS
        }
        answer = self._ask(
            "mission_started",
            protocol=PROTOCOL,
            scenario=system.scenario.name,
            time_limit_s=system.scenario.mission.time_limit_s,
            seed=system.stream("exec").getrandbits(48),
            settings=settings,
            learned=learned,
            attributes=list(system.measurements),
            functions=self._available_modes(),
            mission_wide_functions=system.functions,
        )
        if answer.pop("protocol", PROTOCOL) != PROTOCOL:
            raise self._error(f"does not speak version {PROTOCOL} of the protocol")
        try:
            self._take_settings(answer)
        except (TypeError, ValueError, AttributeError, KeyError) as error:
            raise self._error(f"answered {shown(answer)} to mission_started: {error}") from None
        self._begin = answer

    def _available_modes(self) -> dict[str, Sequence[str]]:
        modes = self.system.modes
        return {function: modes.available_modes(function) for function in modes.nodes}

    def _take_settings(self, answer: Json) -> None:
        period_s = answer.pop("period_s", None)
        self.period_s = None if period_s is None else float(period_s)
        self.starts_s = float(answer.pop("starts_s", 0.0))
        names = answer.pop("subscribes_to", [_NAMES[kind] for kind in EXEMPLAR_KINDS])
        if unknown := [name for name in names if name not in KINDS]:
            raise ValueError(f"subscribes_to: {did_you_mean(unknown[0], KINDS)}")
        self._subscribes_to = tuple(KINDS[name] for name in names)
        if (edges := answer.pop("depends_on", None)) is not None:
            self._depends_on = {
                name: tuple(sorted(map(float, each))) for name, each in edges.items()
            }

    def mission_started(self) -> None:
        """Send the program this message with the settings, and carry out its answer."""
        self._act(self._begin)

    def mission_ended(self, metrics: MissionMetrics) -> None:
        """Send the program the metrics, and leave it to another mission."""
        self._ask("mission_ended", metrics=asdict(metrics))
        self._give_back()

    def task_requested(self, task: Task) -> None:
        """Send the program a task that begins."""
        self._tell("task_requested", task=task.name, functions=task.functions)

    def task_cancelled(self, task: Task) -> None:
        """Send the program a task that is over; its functions are set to fd_unground first."""
        super().task_cancelled(task)
        self._tell("task_cancelled", task=task.name, functions=task.functions)

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        """Pass a diagnostic on."""
        kind = _NAMES.get(diagnostic.kind)
        if kind is not None:
            self._tell("diagnostic", kind=kind, key=diagnostic.key, value=diagnostic.value)

    def adapt(self) -> AdaptationProcess | None:
        """Let the program adapt, with all current measurements."""
        measured = self.system.measured
        answer = self._ask(
            "adapt", measured={name: measured(name) for name in self.system.measurements}
        )
        due_s = self._due_s(answer)
        if due_s > self.system.now_s:
            return self._adapt_at(due_s, answer)
        self._carry_out(answer)
        return None

    def _adapt_at(self, due_s: float, answer: Json) -> AdaptationProcess:
        yield until(self.system.env, due_s)
        self._carry_out(answer)

    def _tell(self, kind: str, /, **content: object) -> None:
        self._act(self._ask(kind, **content))

    def _act(self, answer: Json) -> None:
        """Carry out an answer when the program has thought of it."""
        due_s = self._due_s(answer)
        if due_s > self.system.now_s:
            call_at(self.system.env, due_s, partial(self._carry_out, answer))
        else:
            self._carry_out(answer)

    def _due_s(self, answer: Json) -> float:
        """Return when the program has thought of an answer: it thinks of one after the other."""
        latency_s = answer.get("latency_s", 0.0)
        if type(latency_s) not in (int, float) or not 0.0 <= latency_s <= _LONGEST_S:
            problem = f"answered a latency_s of {shown(latency_s)}"
            raise self._error(f"{problem}; it is a number from 0 to {_LONGEST_S:g}")
        self._thinks_until_s = max(self.system.now_s, self._thinks_until_s) + latency_s
        return self._thinks_until_s

    def _ask(self, kind: str, /, **content: object) -> Json:
        if self._program is None:
            self._program = program = _take(self._command)
            # A mission that does not end leaves it to another one when nobody refers to it any more.
            self._give_back = finalize(self, _give_back, self._command, program)
        began_s = time.monotonic()
        try:
            answer = self._program.ask(
                {"type": kind, "time_s": self.system.now_s, **content}, self._time_out_s
            )
        except BaseException as error:  # a time-out of the mission, too, leaves an answer under way
            self._program.end()
            if isinstance(error, ProgramError):
                raise type(error)(f"the program {error}") from None
            raise
        known = _FIRST_ANSWER if kind == "mission_started" else _ANSWER
        if unknown := [key for key in answer if key not in known]:
            raise self._error(
                f"answered {shown(unknown[0])} to {kind}: {did_you_mean(unknown[0], known)}"
            )
        if self._real_thinking and kind != "mission_started":  # whose time is the program's start
            took_s = time.monotonic() - began_s
            answer.setdefault("latency_s", took_s * self._real_thinking)
        return answer

    def _carry_out(self, answer: Json) -> None:
        modes = answer.get("modes", {})
        lines = answer.get("log", ())
        if not isinstance(modes, dict) or not isinstance(lines, list | tuple):
            raise self._error(
                f"answered {shown(dict(answer))}; modes is an object, log a list of texts"
            )
        requests = self.system.modes.requests
        latency_s = answer.get("latency_s", 0.0)
        for line in lines:
            self.system.log("says", str(line))
        for function, mode in modes.items():
            self._request(function, mode)
        if self.system.modes.requests > requests:
            self.reasoning_time_s += latency_s
        if latency_s:
            self.system.state_changed()

    def _request(self, function: str, mode: object) -> None:
        """Request a mode; a ProgramError if there is none of that name."""
        is_accepted = isinstance(mode, str) and self.system.change_mode(function, mode)
        if not is_accepted and mode not in self.system.modes.available_modes(function):
            known = self._available_modes()
            near = did_you_mean(mode, known.get(function, known))
            raise self._error(f"requested mode {shown(mode)} of {shown(function)}: {near}")

    def _error(self, problem: str) -> ProgramError:
        return ProgramError(f"the program {problem}")


@cache
def exec_manager(command: str) -> type[ManagingSubsystem]:
    """Make the class of the manager `exec:COMMAND`.

    Raises:
        InputError: the command is not a list of words.
    """
    try:
        shlex.split(command)
    except ValueError as error:
        raise InputError(f"exec:{command}: {error}", remedy="close the quotes") from None
    answered = {name: property(attrgetter(f"_{name}")) for name in ("depends_on", "subscribes_to")}
    return type("ExecManager", (ExecManager,), {"command": command, **answered})
