"""Files of the cache folder: what is damaged there is left out, and several processes share
them.
"""

import os
import random
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import pytest

from suave_des.caches import SharedEntries

ENTRIES = {
    f"state {number}": [["fg_spiral_high", "fg_status", "str", f"IN_ERROR_{number}"]]
    for number in range(8)
}


@pytest.fixture
def filled(tmp_path: Path) -> Path:
    entries = SharedEntries(tmp_path, "d")
    for key, value in ENTRIES.items():
        entries.add(key, value)
    (file,) = tmp_path.iterdir()
    return file


def test_what_was_added_is_read(filled):
    assert dict(SharedEntries(filled.parent, "d").read()) == ENTRIES
    assert not list(SharedEntries(filled.parent, "e").read())


def test_only_damaged_entries_are_left_out(filled):
    content = (
        filled.read_bytes().replace(b"IN_ERROR_3", b"IN_ERROR_4")
        + b"\xff\x00 trash [\n"
        + b"cut sh"
    )
    filled.write_bytes(content)
    entries = SharedEntries(filled.parent, "d")
    entries.add("new", 1)
    assert dict(entries.read()) == {
        key: value for key, value in ENTRIES.items() if key != "state 3"
    } | {"new": 1}


@pytest.mark.parametrize("content", [b"", b"\x80\x04pickled", b"x" * 24 + b" [[],[]]\n"])
def test_a_file_of_something_else_has_no_entries(filled, content):
    filled.write_bytes(content)
    assert not list(SharedEntries(filled.parent, "d").read())


def test_a_file_of_other_entries_has_none(filled):
    filled.rename(filled.with_name("e.jsonl"))
    assert not list(SharedEntries(filled.parent, "e").read())


def test_random_bytes_are_never_read(filled):
    original = filled.read_bytes()
    draw = random.Random(5)
    kept = 0
    for _ in range(300):
        content = bytearray(original)
        for _ in range(draw.randint(1, 20)):
            content[draw.randrange(len(content))] = draw.randrange(256)
        filled.write_bytes(bytes(content[: draw.randrange(len(content))]))
        read = dict(SharedEntries(filled.parent, "d").read())
        assert read.items() <= ENTRIES.items()
        kept += len(read)
    assert kept > 100  # lines that no byte fell into are read


def _add_many(folder: str, number: int) -> None:
    entries = SharedEntries(Path(folder), "d")
    for count in range(200):
        entries.add(f"{number} {count}", "x" * count)


def test_several_processes_share_a_file(tmp_path):
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        list(pool.map(_add_many, [str(tmp_path)] * 2, range(2)))
    assert len(dict(SharedEntries(tmp_path, "d").read())) == 400


def test_only_the_latest_files_are_kept(tmp_path, monkeypatch):
    monkeypatch.setattr("suave_des.caches.MAX_FILES", 2)
    for number, digest in enumerate("abc"):
        SharedEntries(tmp_path, digest).add("key", digest)
        (tmp_path / f"{digest}.jsonl").touch()
        os.utime(tmp_path / f"{digest}.jsonl", (number, number))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["b.jsonl", "c.jsonl"]


def test_a_file_that_is_full_gets_no_more_entries(filled, monkeypatch):
    monkeypatch.setattr("suave_des.caches.MAX_BYTES", filled.stat().st_size)
    SharedEntries(filled.parent, "d").add("more", 1)
    assert dict(SharedEntries(filled.parent, "d").read()) == ENTRIES


def test_an_entry_that_is_larger_than_a_file_is_not_kept(filled, monkeypatch):
    monkeypatch.setattr("suave_des.caches.MAX_BYTES", filled.stat().st_size + 100)
    entries = SharedEntries(filled.parent, "d")
    entries.add("large", "x" * 100)
    entries.add("small", "x")
    assert dict(entries.read()) == {**ENTRIES, "small": "x"}
