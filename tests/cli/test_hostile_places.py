"""Commands where something of the system is missing, damaged, closed, made by somebody else, or
asks to stop.
"""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from suave_des import caches
from suave_des.cli.console import plain
from suave_des.errors import InputError
from suave_des.interrupts import Stopped, exit_status, signals_raised
from suave_des.knowledge.pellet import TimeLimit
from tests.helpers.command import command_here, python

COMMAND = [sys.executable, "-P", "-m", "suave_des"]
CHECKOUT = Path(caches.__file__).parent.parent
ONE_MISSION = ["run", "seams2023", "--manager", "none"]
CAMPAIGN = [
    "campaign",
    "seams2023",
    "--managers",
    "none",
    "--runs",
    "2",
    "--workers",
    "1",
    "--out",
    "out",
]


def run(
    *arguments: str, command: list[str] = COMMAND, **environment: str
) -> subprocess.CompletedProcess[str]:
    """Run a command in the current folder, with the user's caches."""
    kept = {
        name: value
        for name, value in os.environ.items()
        if name not in ("SUAVE_DES_CACHE_DIR", "NUMBA_CACHE_DIR")
    }
    return subprocess.run(
        [*command, *arguments],
        env={**kept, **environment},
        capture_output=True,
        text=True,
        timeout=300,
    )


@pytest.fixture
def small_loop(tmp_path: Path) -> list[str]:
    return small_loop_in(tmp_path)


def small_loop_in(folder: Path) -> list[str]:
    """Return a command that compiles one small function with the package, and prints 55.0."""
    program = folder / "small.py"
    program.write_text(
        "import sys; sys.path[:0] = sys.argv[1:]\nfrom small_loop import total\nprint(total(10.0))\n"
    )
    (folder / "small_loop.py").write_text(
        "from suave_des.compiling import compiled\n\n\n"
        "@compiled\ndef total(n):\n    s = 0.0\n    while n > 0.0:\n"
        "        s += n\n        n -= 1.0\n    return s\n"
    )
    return [sys.executable, str(program), str(folder), str(CHECKOUT)]


@pytest.fixture(scope="module")
def replaced(
    tmp_path_factory: pytest.TempPathFactory,
) -> tuple[subprocess.CompletedProcess[str], Path]:
    """What a command says where the folder cannot be made, and the one in its place."""
    temporary = tmp_path_factory.mktemp("temporary")
    done = run(
        command=small_loop_in(tmp_path_factory.mktemp("program")),
        HOME="/dev/null/home",
        XDG_CACHE_HOME="",
        TMPDIR=str(temporary),
    )
    assert (done.returncode, done.stdout) == (0, "55.0\n")
    (folder,) = temporary.glob("suave-des-*")
    return done, folder


class TestCacheFolder:
    def test_that_cannot_be_made_is_told_once(self, replaced):
        done, _ = replaced
        assert done.stderr.count("the cache folder cannot be used") == 1

    def test_in_its_place_is_for_the_user_alone(self, replaced):
        _, folder = replaced
        assert folder.stat().st_mode & 0o777 == 0o700

    def test_in_its_place_keeps_machine_code(self, replaced):
        _, folder = replaced
        assert list(folder.rglob("*.nbc"))

    @pytest.mark.parametrize(
        "damage",
        ["flip", *(pytest.param(each, marks=pytest.mark.slow) for each in ("cut", "text"))],
    )
    def test_with_damaged_machine_code_is_mended(self, tmp_path, damage, small_loop):
        cache = tmp_path / "cache"
        environment = {**os.environ, "SUAVE_DES_CACHE_DIR": str(cache)}
        environment.pop("NUMBA_CACHE_DIR", None)

        def result() -> str:
            done = subprocess.run(
                small_loop, env=environment, capture_output=True, text=True, timeout=120
            )
            assert done.stderr == ""
            return done.stdout

        assert result() == "55.0\n"
        files = list((cache / "numba").rglob("*.nb*"))
        assert {path.suffix for path in files} == {".nbc"}
        whole = {path: path.read_bytes() for path in files}
        for path, content in whole.items():
            middle = len(content) // 2
            path.write_bytes(
                {
                    "flip": content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :],
                    "cut": content[:middle],
                    "text": b"hello",
                }[damage]
            )
        assert result() == "55.0\n"
        assert {path.read_bytes() for path in files} != {b"hello"}
        assert result() == "55.0\n"

    def test_of_somebody_else_or_behind_a_link_is_not_used(self, tmp_path, monkeypatch, capsys):
        monkeypatch.setenv("SUAVE_DES_CACHE_DIR", str(tmp_path / "cache"))
        (tmp_path / "theirs").mkdir()
        (tmp_path / "cache").mkdir()
        (tmp_path / "cache" / "numba").symlink_to(tmp_path / "theirs")
        monkeypatch.setattr(caches.tempfile, "gettempdir", lambda: str(tmp_path))
        assert caches.private_cache("numba") == tmp_path / f"suave-des-{os.getuid()}" / "numba"
        assert "is used instead" in capsys.readouterr().err
        assert not list((tmp_path / "theirs").iterdir())

    def test_that_others_may_enter_is_closed_to_them(self, tmp_path, monkeypatch):
        monkeypatch.setenv("SUAVE_DES_CACHE_DIR", str(tmp_path))
        (tmp_path / "java").mkdir(mode=0o755)
        assert caches.private_cache("java") == tmp_path / "java"
        assert (tmp_path / "java").stat().st_mode & 0o777 == 0o700


def test_files_named_like_python_s_own_modules_are_not_run_by_workers(tmp_path):
    for name in ("signal", "types", "re", "random", "numpy", "suave_des"):
        (tmp_path / f"{name}.py").write_text(f"open('ran-{name}', 'w')\nraise RuntimeError\n")
    (tmp_path / "mine.py").write_text(
        "from suave_des.managing.simple import NoManager\n\n\nclass Mine(NoManager):\n    pass\n"
    )
    managers = [
        "campaign",
        "seams2023",
        "--managers",
        "none,mine:Mine",
        "--runs",
        "2",
        "--workers",
        "2",
    ]
    done = run(*managers, "--out", "out", "--quiet")
    assert done.returncode == 0, done.stderr
    assert not list(tmp_path.glob("ran-*"))


class TestStopped:
    @pytest.mark.parametrize(
        ("number", "status"), [("SIGINT", 130), ("SIGTERM", 143), ("SIGHUP", 129)]
    )
    @pytest.mark.parametrize("after_s", [0.1, pytest.param(0.5, marks=pytest.mark.slow)])
    def test_as_it_starts_it_ends_in_one_line(self, tmp_path, number, status, after_s):
        program = (
            "import os, signal, sys, threading, time\n"
            "from suave_des.entry import main\n"
            "signal.signal(signal.SIGHUP, signal.SIG_DFL)\n"  # under nohup it is ignored
            f"threading.Timer({after_s}, os.kill, (os.getpid(), signal.{number})).start()\n"
            "sys.argv[1:] = sys.argv[2:]\n"
            "main()\n"
            "time.sleep(5)\n"
        )
        done = python(
            "-c",
            program,
            "x",
            "campaign",
            "seams2023",
            "--runs",
            "300",
            "--out",
            "out",
            cwd=tmp_path,
        )
        assert done.returncode == status
        assert "Traceback" not in done.stderr
        assert len(done.stderr.splitlines()) == 1

    @pytest.mark.parametrize(("number", "status"), [("SIGINT", 130), ("SIGTERM", 143)])
    def test_while_arguments_are_read_it_ends_in_one_line(self, tmp_path, number, status):
        program = (
            "import os, signal\n"
            "from suave_des.cli import main\n"
            f"main._Commands.parse_args = lambda *_: os.kill(os.getpid(), signal.{number})\n"
            "main.main(['scenarios'])\n"
        )
        done = python("-c", program, cwd=tmp_path)
        assert (done.returncode, done.stderr) == (status, "suave-des: interrupted\n")

    def test_what_the_signal_left_half_made_says_nothing(self):
        program = (
            "import os, signal\n"
            "from suave_des.interrupts import Stopped, signals_raised\n"
            "class HalfMade:\n"
            "    def __del__(self):\n"
            "        raise AttributeError('not there yet')\n"
            "first, second = HalfMade(), HalfMade()\n"
            "try:\n"
            "    with signals_raised():\n"
            "        try:\n"
            "            os.kill(os.getpid(), signal.SIGINT)\n"
            "        finally:\n"
            "            del first\n"
            "except Stopped:\n"
            "    del second\n"
        )
        done = python("-c", program)
        assert (done.returncode, done.stderr) == (0, "")

    def test_an_extension_that_it_stops_as_it_is_imported_says_nothing(self):
        program = (
            "import builtins, os, signal\n"
            "import numpy.random\n"
            "from suave_des.interrupts import signals_raised\n"
            "imported = builtins.__import__\n"
            "def interrupted(name, *rest, **named):\n"
            "    if '_multiarray_umath' in name:\n"
            "        builtins.__import__ = imported\n"
            "        os.kill(os.getpid(), signal.SIGTERM)\n"
            "    return imported(name, *rest, **named)\n"
            "try:\n"
            "    with signals_raised():\n"
            "        builtins.__import__ = interrupted\n"
            "        import numba._helperlib\n"
            "except ImportError as error:\n"
            "    print(error)\n"
        )
        done = python("-c", program)
        assert done.stderr == ""
        assert "failed to import" in done.stdout

    @pytest.mark.slow
    @pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
    def test_at_any_moment_it_ends_without_a_traceback(self, tmp_path, number):
        def started() -> subprocess.Popen[str]:
            silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
            return subprocess.Popen([*COMMAND, *ONE_MISSION], cwd=tmp_path, text=True, **silent)

        assert started().communicate(timeout=60)[1] == ""  # compiles, which takes longer
        start_s = time.monotonic()
        assert started().communicate(timeout=60)[1] == ""
        whole_s = time.monotonic() - start_s
        interrupted = 0
        for place in range(20):
            process = started()
            time.sleep(0.05 + whole_s * place / 20)
            process.send_signal(number)
            _, told = process.communicate(timeout=60)
            # Before Python runs a line of the command, the system ends it, or Python by its own
            # KeyboardInterrupt.
            early = place < 3
            assert process.returncode in (0, 128 + number, -number) or (
                early and number == signal.SIGINT
            )
            assert early or "Traceback" not in told
            interrupted += process.returncode == 128 + number
        assert interrupted > 7  # the others were too early or too late


@pytest.fixture(scope="module")
def unread(tmp_path_factory: pytest.TempPathFactory) -> tuple[int, bytes, Path]:
    """Exit status of a campaign whose output nobody reads, its errors, and its folder."""
    folder = tmp_path_factory.mktemp("unread")
    process = subprocess.Popen(
        [*COMMAND, *CAMPAIGN, "--quiet"],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    process.stdout.close()
    told = process.stderr.read()
    return process.wait(300), told, folder


class TestOutput:
    def test_in_ascii_has_other_characters(self, tmp_path):
        done = run(*CAMPAIGN, PYTHONIOENCODING="ascii")
        assert done.returncode == 0
        assert " ? " in done.stdout and done.stdout.isascii()

    def test_that_nobody_reads_is_no_error(self, unread):
        status, told, _ = unread
        assert (status, told) == (128 + signal.SIGPIPE, b"")

    def test_that_nobody_reads_costs_no_results(self, unread):
        _, _, folder = unread
        assert (folder / "out" / "runs.csv").is_file()

    def test_has_no_control_characters_of_others(self, command):
        assert "\x1b" not in command("run", "\x1b]0;owned\x07\x1b[31mred.yaml").err
        assert plain("a\x1b[31m\u202eb ± é\n") == "a\\x1b[31m\\u202eb ± é\n"


@pytest.fixture(scope="module")
def ended(
    tmp_path_factory: pytest.TempPathFactory,
) -> tuple[subprocess.CompletedProcess[str], Path]:
    """A command that starts it with options that it does not know, and its temporary folder."""
    folder = tmp_path_factory.mktemp("java")
    options = {
        "JAVA_TOOL_OPTIONS": "-Xmx1k -XX:+NoSuchOption",
        "_JAVA_OPTIONS": "-XX:+NoSuchOption",
    }
    arguments = ["kb", "infer", "--reasoner", "pellet", "--at", "water_visibility=1"]
    return run(*arguments, TMPDIR=str(folder), **options), folder


class TestJava:
    def test_takes_no_options_from_the_environment(self, ended):
        done, _ = ended
        assert (done.returncode, done.stderr) == (0, "")

    def test_leaves_nothing_in_the_temporary_folder(self, ended):
        _, folder = ended
        assert not list(folder.glob(".java_pid*"))


class TestLimits:
    @pytest.mark.parametrize("seconds", [float("inf"), float("nan"), 0.0, -1.0, 1e300])
    def test_that_cannot_be_waited_for_are_refused(self, seconds):
        with pytest.raises(InputError, match=r"--time-limit: .* is out of range"):
            TimeLimit(seconds, "--time-limit")

    CATASTROPHIC = 'SELECT ?x WHERE { ?x a ?c . FILTER(REGEX("' + "a" * 44 + '", "(a+)+b")) }'

    def test_of_a_query_holds_within_a_regular_expression(self, tmp_path):
        done = run("kb", "query", "--time-limit", "1", self.CATASTROPHIC)
        assert done.returncode == 2
        assert (
            done.stderr
            == "suave-des: answering the query: not done after 1 s (allow more with --time-limit)\n"
        )

    def test_sigterm_ends_such_a_query(self, tmp_path):
        process = subprocess.Popen(
            [*COMMAND, "kb", "query", self.CATASTROPHIC],
            cwd=tmp_path,
            stderr=subprocess.PIPE,
            text=True,
        )
        time.sleep(3)
        process.terminate()
        assert process.communicate(timeout=30)[1] == "suave-des: interrupted\n"
        assert process.returncode == 143

    def test_of_open_files_is_reported(self, tmp_path):
        import resource

        arguments = [
            "campaign",
            "seams2023",
            "--managers",
            "none",
            "--runs",
            "9",
            "--workers",
            "2",
            "--out",
            "out",
        ]
        done = subprocess.run(
            [*COMMAND, *arguments],
            cwd=tmp_path,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (10, 10)),
            capture_output=True,
            text=True,
            timeout=120,
        )
        assert done.returncode in (2, 3)
        assert "Traceback" not in done.stderr and "Too many open files" in done.stderr


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full, which Linux has")
@pytest.mark.parametrize("command", [["--help"], ["kb", "rules"], ONE_MISSION])
def test_output_to_a_full_disk_is_told_in_one_line(command, tmp_path):
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [*COMMAND, *command], cwd=tmp_path, stdout=full, stderr=subprocess.PIPE, text=True
        )
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "the output cannot be written: No space left on device" in done.stderr


def test_commands_use_a_folder_whose_name_is_no_utf_8(tmp_path):
    out = tmp_path / os.fsdecode(b"L\xe4ufe")
    try:
        out.mkdir()
    except OSError:
        pytest.skip("this file system has names in UTF-8 only")
    out.rmdir()
    # says the name: bytes
    done = subprocess.run([*COMMAND, *CAMPAIGN[:-1], out], cwd=tmp_path, capture_output=True)
    assert done.returncode == 0, done.stderr
    for command in (
        ["campaign", "--resume", str(out), "--runs", "3", "--quiet"],
        ["report", str(out)],
    ):
        assert command_here(*command, cwd=tmp_path).returncode == 0
    assert (out / "report.html").is_file()


class Deaf:
    """What is raised as it is forgotten, nobody hears; nor in Python code that compiled code
    calls.
    """

    def __init__(self, number: int) -> None:
        self.number = number

    def __del__(self) -> None:
        signal.raise_signal(self.number)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_where_an_exception_is_lost_it_is_asked_again(number, capsys):
    with signals_raised():
        with pytest.raises(Stopped):
            Deaf(number)
            time.sleep(20.0)
        assert exit_status() == 128 + number
    assert capsys.readouterr().err == ""


def test_what_else_is_lost_is_told_as_ever(monkeypatch):
    class Clumsy:
        def __del__(self) -> None:
            raise ValueError

    told = []
    monkeypatch.setattr("sys.unraisablehook", lambda lost: told.append(lost.exc_type))
    with signals_raised():
        Clumsy()
    assert told == [ValueError]


def test_when_the_command_has_ended_nothing_is_asked_any_more(monkeypatch):
    heard = []
    before = signal.signal(signal.SIGTERM, lambda number, frame: heard.append(number))
    try:
        with signals_raised():
            Deaf(signal.SIGTERM)
        time.sleep(0.3)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert heard == []


def test_what_the_process_was_started_to_ignore_does_not_end_a_query():
    code = (
        "import signal\n"
        "from suave_des.interrupts import ends_at_once\n"
        "signal.signal(signal.SIGHUP, signal.SIG_IGN)\n"
        "with ends_at_once(10.0, 'late'):\n    signal.raise_signal(signal.SIGHUP)\n"
        "print('done')\n"
    )
    ended = python("-c", code)
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "done\n", "")


def test_settings_of_matplotlib_that_are_no_utf_8_are_named(tmp_path):
    (tmp_path / "matplotlibrc").write_bytes(b"axes.grid: \xff\n")
    command = [*COMMAND, "figure", "out", "--out", "a.png"]  # a process that has no matplotlib yet
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert "suave-des: matplotlibrc: cannot be read: 'utf-8' codec" in done.stderr
