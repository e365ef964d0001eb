"""The command `suave-des`: its commands, and how errors leave it."""

from __future__ import annotations

import atexit
import gc
import os
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from functools import lru_cache
from traceback import walk_tb
from typing import Annotated, Any, ClassVar

import typer

from suave_des import __version__
from suave_des.cli import campaign, files, results
from suave_des.cli.console import plain
from suave_des.cli.kb import commands as kb
from suave_des.cli.options import (
    CONTEXT,
    CommandsUnderHeadings,
    Headings,
    flag,
    remember_command_line,
)
from suave_des.errors import InputError, SuaveDesError
from suave_des.files import NO_SPACE
from suave_des.interrupts import exit_status, signals_raised, was_interrupted

BAD_INPUT, MISSIONS_MISSING = 2, 3
"""Exit statuses besides 0 and those of signals; 3: done, but failed missions have no row."""


class _CommandInterruptedError(Exception):
    """A signal stopped a command; the message says what is kept."""


class _Commands(CommandsUnderHeadings):
    """Handles interruptions before typer does, which would not report what is kept."""

    headings: ClassVar[Headings] = {
        "Run missions": (
            campaign.reproduce,
            campaign.run,
            campaign.campaign,
            campaign.train,
            campaign.serve,
        ),
        "Look at results": (
            results.compare,
            results.figure,
            results.report,
            results.replay,
            results.validate,
        ),
        "Knowledge, rules and trees": (kb.app, files.tree),
        "Files": (files.import_config, files.export_config, files.scenarios, files.schema),
    }

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as error:
            raise _CommandInterruptedError(str(error) or "interrupted") from None
        except BrokenPipeError:  # whoever reads the output has enough of it, such as head
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            raise typer.Exit(128 + signal.SIGPIPE) from None


def _report(message: str, status: int) -> int:
    with suppress(BrokenPipeError):
        print("suave-des: " + plain(" ".join(message.splitlines())), file=sys.stderr)
    return status


app = typer.Typer(
    name="suave-des",
    cls=_Commands,
    add_completion=True,
    context_settings=CONTEXT,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="SUAVE, the self-adaptive underwater vehicle exemplar, as a repeatable discrete-event simulation.",
    epilog="Exit status: 0 done; 1 kb check, kb test or validate --strict found something; 2 bad input;"
    " 3 done, but missions failed; 130 interrupted, 143 by kill.",
)


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"suave-des {__version__}")
        raise typer.Exit()


@app.callback()
def _options(
    version: Annotated[
        bool,
        flag("--version", "Print the version and exit.", callback=_print_version, is_eager=True),
    ] = False,
) -> None:
    """Options of the command itself."""


@lru_cache(maxsize=1)
def _command_line() -> Any:
    return typer.main.get_command(app)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command `suave-des`; an error that is meant for the user is reported in one line,
    with an exit status.

    Args:
        arguments: of the command line; left out: the process's own. Without any, the help is
            printed.

    Raises:
        SystemExit: always, with the exit status.
    """
    arguments = list(sys.argv[1:] if arguments is None else arguments) or ["--help"]
    remember_command_line(arguments)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # ? for what the terminal's encoding lacks
    atexit.unregister(gc.freeze)  # as of an earlier call
    # a last collection of all that was imported would take a tenth of a second
    atexit.register(gc.freeze)
    abandoned = _abandoned()
    try:
        with signals_raised():
            status = _run(arguments)
    except BaseException as error:
        status = _status_of(error)
    if _abandoned() > abandoned:
        _leave_by_force(status)
    sys.exit(status)


def _run(arguments: Sequence[str]) -> int:
    """Run a command; return its exit status."""
    line = _command_line()
    status = line.main(arguments, prog_name="suave-des", standalone_mode=False) or 0
    if sys.stdout is not None:
        sys.stdout.flush()  # what cannot be written is reported here, not while Python ends
    # typer's for any signal before the command began
    if was_interrupted() and status == 128 + signal.SIGINT:
        return _report("interrupted", exit_status())
    return int(status)


def _status_of(error: BaseException) -> int:
    """Report an error that is meant for the user, and return the exit status; raise any other."""
    if isinstance(error, _CommandInterruptedError):
        return _report(str(error), exit_status())
    if isinstance(error, InputError):
        return _report(str(error), BAD_INPUT)
    if isinstance(error, SuaveDesError):
        return _report(str(error), MISSIONS_MISSING)
    if was_interrupted():  # in the middle of an import, whose own error this may be
        return _report("interrupted", exit_status())
    # of standard output: files have errors of their own
    if isinstance(error, OSError) and error.errno in NO_SPACE:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # else Python would try again when it ends
        return _report(f"the output cannot be written: {error.strerror}", BAD_INPUT)
    settings = _unread_settings(error)
    if settings is not None:
        return _status_of(
            InputError(f"cannot be read: {error}", file=settings, remedy="correct or remove it")
        )
    # A wrong option or argument: a class that is private to typer, and was click's in earlier
    # versions of it.
    if hasattr(error, "format_message"):
        return _report(_usage_problem(error), BAD_INPUT)
    raise error


def _unread_settings(error: BaseException) -> str | None:
    """Return the file of matplotlib's settings, such as ./matplotlibrc, that its import could not
    read.
    """
    for frame, _ in walk_tb(error.__traceback__):
        if frame.f_code.co_name == "_rc_params_in_file":
            return str(frame.f_locals["fname"])
    return None


def _usage_problem(error: Any) -> str:
    context = getattr(error, "ctx", None)
    path = "suave-des" if context is None else context.command_path
    advice = f"see {path} --help"
    if "extra argument" in str(error):
        advice = f"several names have commas between them, without blanks; {advice}"
    return f"{error.format_message().rstrip('.')} ({advice})"


def _abandoned() -> int:
    """Count the reasoners that this process has abandoned after a time-out."""
    limit = sys.modules.get("suave_des.knowledge.pellet")
    return 0 if limit is None else int(limit.times_abandoned())


def _leave_by_force(status: int) -> None:
    """Exit while an abandoned reasoner still runs in Java, which cannot be stopped."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)
