"""Find the code blocks of README and docs, run them page by page, and give what each shows when
run.

What a block is follows from its language and the words after it, which readers do not see:

- `console`: commands after `$ `, each followed by what it prints. `head=N` and `tail=N` keep the
  first and last lines of each output; `status=2` says how the last command ends; `test="--runs 4"`
  gives an option another value in quick tests; `picture=NAME` says that the block draws
  docs/images/NAME; `needs=curl` says which program README does not ask for. `console setup` is not
  run. Commands of `console background` go on while the
  rest of the page runs, at a free port in place of 8786; they show nothing.
- `python`: a script; the `text` block after it is what it prints.
- A block that is `long` is left out by quick tests and run by refresh_outputs.py; what it shows has
  a test elsewhere.
- Any language with `title=FILE` is a file, and with `insert=FILE` and `before=LINE` or `after=LINE`
  an addition to one.
- `bibtex` is neither run nor checked.

The blocks of a page run in its order in one folder, which has ontologies, scenarios and analysis
scripts in it, as a checkout.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import suave_des
from suave_des.cli.main import main

ROOT = Path(__file__).resolve().parent.parent
PAGES = (
    ROOT / "README.md",
    *sorted((ROOT / "docs" / "tutorials").glob("*.md")),
    *sorted((ROOT / "docs" / "guides").glob("*.md")),
    *(ROOT / "docs" / "reference" / name for name in ("cli.md", "csv.md", "python-api.md")),
    *sorted((ROOT / "docs" / "reference" / "api").glob("*.md")),
    *(ROOT / "docs" / "background" / name for name in ("determinism.md", "fidelity.md")),
)
"""Pages whose blocks are run; other pages have tests of their own."""
IMAGES = ROOT / "docs" / "images"

_FENCE = re.compile(r"```(\w+)(.*)")
_NUMBER = re.compile(r"\d+(?:\.\d+)?")
_UNRUN = ("bibtex",)
_PORT = "8786"
"""Of a Dask scheduler, on the pages."""


@dataclass(frozen=True)
class Block:
    """A fenced block.

    Attributes:
        page: the file.
        line: number of its opening line, from 1.
        language: word after the backticks.
        marks: the words after that.
        text: its content.
    """

    page: Path
    line: int
    language: str
    marks: dict[str, str]
    text: str

    @property
    def place(self) -> str:
        """Page and line, for messages."""
        return f"{self.page.relative_to(ROOT)}:{self.line}"


def blocks_of(page: Path) -> Iterator[Block]:
    """The blocks of a page, in order."""
    lines = page.read_text(encoding="utf-8").splitlines(keepends=True)
    number = 0
    while number < len(lines):
        fence = _FENCE.match(lines[number])
        if fence is None:
            number += 1
            continue
        end = lines.index("```\n", number)
        marks = dict(word.partition("=")[::2] for word in shlex.split(fence[2]))
        yield Block(page, number + 1, fence[1], marks, "".join(lines[number + 1 : end]))
        number = end + 1


def run_page(
    page: Path, folder: Path, *, quick: bool, absent: Collection[str] = ()
) -> Iterator[tuple[Block, str]]:
    """Run the blocks of a page in an empty folder, and give each with what it shows.

    Args:
        page: the file.
        folder: where to run them.
        quick: whether to run short forms, and to leave out what is `long`.
        absent: programs that this machine lacks: blocks that need one are left as they stand.

    Raises:
        RuntimeError: a command ended with another status than the page says, or a block cannot be
            used.
    """
    for name in ("ontology", "scenarios", "analysis"):
        shutil.copytree(ROOT / name, folder / name)
    printed = ""
    names: dict[str, Any] = {"__name__": "__main__"}
    port = _free_port()
    with _inside(folder), contextlib.ExitStack() as background:
        for block in blocks_of(page):
            shown = block.text
            if (quick and "long" in block.marks) or block.marks.get("needs") in absent:
                yield block, shown
                continue
            if "title" in block.marks:
                Path(block.marks["title"]).write_text(block.text, encoding="utf-8")
            elif "insert" in block.marks:
                _insert(block)
            elif "background" in block.marks:
                for command in _commands(block, port):
                    background.enter_context(_going_on(command))
                _wait_for(port)
            elif block.language == "console" and "setup" not in block.marks:
                shown = _run_console(block, port, quick=quick)
            elif block.language == "python":
                printed = _printed_by(block, names)
            elif block.language == "text":
                shown = _cut(printed, block.marks)
            elif block.language not in (*_UNRUN, "console"):
                raise RuntimeError(
                    f"{block.place}: nothing says what to do with this {block.language} block"
                )
            yield block, shown


def differs(block: Block, real: str, *, quick: bool) -> bool:
    """Whether what a block shows is not what really came.

    Decimals may differ by a hundredth, as the last digits of a mission may differ between machines;
    words and whole numbers may not. Where the quick test ran something shorter, the names of a
    table's rows are compared.
    """
    if quick and "test" in block.marks:
        return _row_names(block.text) != _row_names(real)
    shown_lines, real_lines = block.text.splitlines(), real.splitlines()
    if len(shown_lines) != len(real_lines):
        return True
    return any(not _same(*pair) for pair in zip(shown_lines, real_lines, strict=True))


def _same(shown: str, real: str) -> bool:
    words = [_NUMBER.sub("#", " ".join(line.split())) for line in (shown, real)]
    if words[0] != words[1]:
        return False
    pairs = zip(_NUMBER.findall(shown), _NUMBER.findall(real), strict=True)
    return all(
        abs(float(one) - float(other)) <= 0.02 + 0.01 * float(one)
        if "." in one + other
        else one == other
        for one, other in pairs
    )


def _row_names(text: str) -> list[str]:
    lines = text.splitlines()
    return [
        line.split()[0] for line in lines if line[:1].isalpha() and len(_NUMBER.findall(line)) > 2
    ]


@contextlib.contextmanager
def _inside(folder: Path) -> Iterator[None]:
    """Work in a folder; its modules, which commands may import, are forgotten at the end."""
    path, columns = list(sys.path), os.environ.pop("COLUMNS", None)
    with contextlib.chdir(folder):
        try:
            yield
        finally:
            sys.path[:] = path
            if columns is not None:
                os.environ["COLUMNS"] = columns
            for name, module in list(sys.modules.items()):
                if str(getattr(module, "__file__", None) or "").startswith(str(folder)):
                    del sys.modules[name]


def _insert(block: Block) -> None:
    path = Path(block.marks["insert"])
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    anchor, offset = (
        (block.marks["before"], 0) if "before" in block.marks else (block.marks["after"], 1)
    )
    places = [number for number, line in enumerate(lines) if line.strip() == anchor]
    if len(places) != 1:
        raise RuntimeError(f"{block.place}: {path} has {len(places)} lines {anchor!r}, not one")
    lines.insert(places[0] + offset, block.text)
    path.write_text("".join(lines), encoding="utf-8")


def _printed_by(block: Block, names: dict[str, Any]) -> str:
    output = io.StringIO()
    with contextlib.redirect_stdout(output):
        exec(compile(block.text, block.place, "exec"), names)
    return output.getvalue()


def _free_port() -> str:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return str(found.getsockname()[1])


def _wait_for(port: str) -> None:
    """Wait until somebody answers at a port, as who has typed the commands would."""
    end_s = time.monotonic() + 60.0
    while True:
        try:
            socket.create_connection(("127.0.0.1", int(port)), timeout=10.0).close()
            return
        except OSError:
            if time.monotonic() > end_s:
                raise
        time.sleep(0.1)


def _commands(block: Block, port: str) -> list[str]:
    lines = [line.removeprefix("$ ") for line in block.text.splitlines() if line.startswith("$ ")]
    return [line.replace(_PORT, port) for line in lines]


@contextlib.contextmanager
def _going_on(command: str) -> Iterator[None]:
    """Have a command run until the end."""
    process = subprocess.Popen(
        ["bash", "-c", f"exec {command}"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=os.environ | _where_things_are(),
    )
    try:
        yield
    finally:
        process.terminate()
        try:
            process.wait(60.0)
        finally:
            process.kill()


def _run_console(block: Block, port: str, *, quick: bool) -> str:
    shown, status = "", 0
    for command in _commands(block, port):
        if quick:
            output, status = _run(
                _shortened(command, block.marks.get("test", "")), status, workers="1"
            )
        else:
            output, status = _run(command, status, workers="2")
        line = f"$ {command}".replace(port, _PORT)
        shown += f"{line}\n{_cut(output, block.marks)}"
    if status != int(block.marks.get("status", 0)):
        raise RuntimeError(f"{block.place}: ended with status {status}:\n{shown}")
    return shown


def _shortened(command: str, options: str) -> str:
    """The command with other values of these options, which are added where it does not have
    them.
    """
    words = shlex.split(options)
    for option, value in zip(words[::2], words[1::2], strict=True):
        command, replaced = re.subn(rf"{option} \S+", f"{option} {value}", command)
        if not replaced:
            command += f" {option} {value}"
    return command


def _run(command: str, status_before: int, workers: str) -> tuple[str, int]:
    """Output and exit status; suave-des runs in this process, which saves starting Java each
    time.
    """
    if not command.startswith("suave-des "):
        return _shell(f"(exit {status_before}); {command}", "")
    own, _, rest = command.partition(" | ")
    words = shlex.split(own)
    if words[1] in ("campaign", "reproduce") and not {"--workers", "--scheduler"} & {*words}:
        words += ["--workers", workers]  # the same bytes with any number
    if words[1] in ("campaign", "reproduce", "validate"):
        words.append("--quiet")  # pages show what is printed where that takes less than ten seconds
    output, status = io.StringIO(), 0
    with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
        try:
            main(words[1:])
        except SystemExit as end:
            status = int(end.code or 0)
    return (output.getvalue(), status) if not rest else _shell(rest, output.getvalue())


def _where_things_are() -> dict[str, str]:
    return {
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(Path(suave_des.__file__).parent.parent),
    }


def _shell(command: str, given: str) -> tuple[str, int]:
    done = subprocess.run(
        ["bash", "-c", command],
        input=given,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env=os.environ | _where_things_are(),
        check=False,
    )
    return done.stdout, done.returncode


def _cut(output: str, marks: dict[str, str]) -> str:
    """The first and last lines, if the block asks for that; without blanks at the ends of lines."""
    lines = [line.rstrip() for line in output.splitlines()]
    head, tail = int(marks.get("head", 0)), int(marks.get("tail", 0))
    if (head or tail) and len(lines) > head + tail:
        lines = [*lines[:head], "...", *lines[len(lines) - tail :]]
    return "".join(f"{line}\n" for line in lines)
