"""What must stay the same while the code changes: result files to the byte, statistics and
decisions to the digit.

`python -m tests.golden.golden` makes golden.json anew: after a change that is meant to change
results, which CHANGELOG.md then names.
"""

import hashlib
import json
import re
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

from tests.helpers.command import command_here

FILE = Path(__file__).with_name("golden.json")
MANAGERS = {
    "seams2023": "none,random,metacontrol,bt,threshold,oracle,fixed:fd_spiral_medium",
    "planta_exp1": "none,random,metacontrol,bt",
    "release15": "none,random,metacontrol,bt",
    "extended": "none,random,metacontrol,bt,bt_extended",
}
RUNS, MANY_RUNS, RECORDED_RUNS = 20, 200, (1, 2, 7)


def run(*arguments: str, cwd: Path) -> str:
    """Run a command, and return what it prints."""
    done = command_here(*arguments, cwd=cwd)
    assert done.returncode in (0, 1), done.stderr
    return done.stdout


def digest(path: Path) -> str:
    """A short hash of a file's bytes."""
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def campaign(scenario: str, runs: int, folder: Path) -> str:
    """The hash of runs.csv of all managers."""
    run(
        "campaign",
        scenario,
        "--managers",
        MANAGERS[scenario],
        "--runs",
        str(runs),
        "--out",
        "c",
        cwd=folder,
    )
    return digest(folder / "c" / "runs.csv")


def mission(scenario: str, manager: str, number: int, folder: Path) -> str:
    """The hashes of what one recorded mission writes as CSV."""
    run(
        "run",
        scenario,
        "--manager",
        manager,
        "--run",
        str(number),
        "--out",
        "m",
        "--overwrite",
        cwd=folder,
    )
    return " ".join(digest(folder / "m" / name) for name in ("events.csv", "trajectory.csv"))


def numbers(text: str) -> str:
    """The numbers in a text, in their order."""
    return " ".join(re.findall(r"-?\d+(?:\.\d+)?(?:e-?\d+)?", text))


def missions(scenario: str, manager: str, folder: Path) -> list[str]:
    """The hashes of some recorded missions."""
    return [mission(scenario, manager, number, folder) for number in RECORDED_RUNS]


def compared(scenario: str, folder: Path) -> str:
    """The numbers that compare prints for a campaign."""
    run(
        "campaign",
        scenario,
        "--managers",
        MANAGERS[scenario],
        "--runs",
        "100",
        "--out",
        "c",
        cwd=folder,
    )
    return numbers(run("compare", "c", "--format", "csv", cwd=folder))


def validated(folder: Path) -> str:
    """The numbers that validate prints."""
    shown = run(
        "validate",
        "--runs",
        "100",
        "--out",
        "v",
        "--managers",
        "none,random,metacontrol",
        cwd=folder,
    )
    return numbers(shown.partition("Files")[0])


def policy(scenario: str, max_failed: int, folder: Path) -> str:
    """The hash of kb policy's table."""
    run(
        "kb",
        "policy",
        "--scenario",
        scenario,
        "--max-failed",
        str(max_failed),
        "--csv",
        "p.csv",
        cwd=folder,
    )
    return digest(folder / "p.csv")


def rule_tests(folder: Path) -> str:
    """How many tests of rules kb test counts, and states."""
    return numbers(run("kb", "test", cwd=folder).splitlines()[-1].partition(" in ")[0])


QUICK: dict[str, Callable[[Path], object]] = {
    **{f"campaign {scenario}": partial(campaign, scenario, RUNS) for scenario in MANAGERS},
    **{
        f"missions {scenario} {manager}": partial(missions, scenario, manager)
        for scenario, managers in MANAGERS.items()
        for manager in managers.split(",")
    },
    "kb policy seams2023": partial(policy, "seams2023", 2),
    "kb test": rule_tests,
}
SLOW: dict[str, Callable[[Path], object]] = {
    **{
        f"many missions {scenario}": partial(campaign, scenario, MANY_RUNS) for scenario in MANAGERS
    },
    **{
        f"compare {scenario}": partial(compared, scenario)
        for scenario in ("seams2023", "planta_exp1")
    },
    "kb policy extended": partial(policy, "extended", 1),
    "validate": validated,
}


def made(make: Callable[[Path], object]) -> object:
    """What one of these gives, in a folder of its own."""
    with tempfile.TemporaryDirectory() as folder:
        return make(Path(folder))


if __name__ == "__main__":
    found = {name: made(make) for name, make in (QUICK | SLOW).items()}
    FILE.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
