"""Make small faults in the package, one at a time, and count those that its tests notice.

    python tests/mutate.py suave_des/vehicle [--faults N] [--seed N]

The faults are made in a copy of the checkout, whose tests of the same package (tests/vehicle) are
run with each. Those that go unnoticed are printed: each is a missing test, or makes no difference.
"""

from __future__ import annotations

import argparse
import io
import random
import shutil
import subprocess
import sys
import tempfile
import time
import tokenize
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
LEFT_OUT = shutil.ignore_patterns(".git", ".venv", "__pycache__", "site", ".*_cache")
REPLACEMENTS = {
    "<": "<=",
    "<=": "<",
    ">": ">=",
    ">=": ">",
    "==": "!=",
    "!=": "==",
    "+": "-",
    "-": "+",
    "/": "*",
    "and": "or",
    "or": "and",
    "not": "",
    "True": "False",
    "False": "True",
    "min": "max",
    "max": "min",
    "any": "all",
    "all": "any",
    "break": "continue",
}


class Fault(NamedTuple):
    """A token of a file, and what stands there instead; lines count from 1."""

    line: int
    column: int
    before: str
    after: str

    def put_into(self, text: str) -> str:
        """Return the text with the fault."""
        lines = text.splitlines(keepends=True)
        line, end = lines[self.line - 1], self.column + len(self.before)
        lines[self.line - 1] = line[: self.column] + self.after + line[end:]
        return "".join(lines)


def faults_in(text: str) -> Iterator[Fault]:
    """Yield the faults that can be made in a module; some are no longer Python, see is_module."""
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        after = REPLACEMENTS.get(token.string)
        if token.type == tokenize.NUMBER:
            after = f"({token.string} + 1)"
        if after is not None and token.type in (tokenize.NUMBER, tokenize.OP, tokenize.NAME):
            yield Fault(*token.start, token.string, after)


def is_module(text: str) -> bool:
    """Whether a text can be compiled."""
    try:
        compile(text, "a module", "exec")
    except SyntaxError:
        return False
    return True


def chosen(folder: Path, seed: int) -> Iterator[tuple[Path, Fault]]:
    """Yield the faults that can be made in a folder's modules, each of which is left one, in an
    order that the seed decides.
    """
    texts = {path: path.read_text(encoding="utf-8") for path in sorted(folder.rglob("*.py"))}
    faults = [(path, fault) for path, text in texts.items() for fault in faults_in(text)]
    random.Random(seed).shuffle(faults)
    for path, fault in faults:
        if is_module(fault.put_into(texts[path])):
            yield path, fault


def passes(root: Path, tests: str, limit_s: float) -> bool:
    """Whether all tests of a folder pass within a time."""
    command = [sys.executable, "-m", "pytest", "-n", "0", "-x", "-q", tests]
    try:
        run = subprocess.run(command, cwd=root, capture_output=True, timeout=limit_s)
    except subprocess.TimeoutExpired:
        return False
    return run.returncode == 0


def main() -> None:
    """Print the faults that are not noticed, and how many are."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("package", help="such as suave_des/vehicle")
    parser.add_argument("--faults", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "checkout"
        shutil.copytree(ROOT, copy, ignore=LEFT_OUT, symlinks=True)
        tests = str(Path("tests", Path(given.package).name))
        began_s = time.monotonic()
        if not passes(copy, tests, 3600.0):
            raise SystemExit(f"{tests}: the tests fail without any fault")
        limit_s = 60.0 + 5.0 * (time.monotonic() - began_s)
        noticed = made = 0
        for path, fault in islice(chosen(copy / given.package, given.seed), given.faults):
            made += 1
            text = path.read_text(encoding="utf-8")
            path.write_text(fault.put_into(text), encoding="utf-8")
            if passes(copy, tests, limit_s):
                place = f"{path.relative_to(copy)}:{fault.line}"
                print(f"{place}: {fault.before} -> {fault.after or 'nothing'}", flush=True)
            else:
                noticed += 1
            path.write_text(text, encoding="utf-8")
    print(f"{given.package}: {noticed} of {made} faults are noticed")


if __name__ == "__main__":
    main()
