"""Files from elsewhere: JSON is read as deep as the stack of any Python bears."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from suave_des.files import LISTED, json_value, own_files, write_files


@pytest.mark.parametrize("content", ["[" * 201, '{"a":' * 201, "[[]," * 201, b"[" * 100_000])
def test_json_that_is_nested_deeper_than_200_is_refused(content):
    with pytest.raises(ValueError, match="nested more than 200 deep"):
        json_value(content)


def test_what_is_nested_200_deep_is_read():
    assert json_value("[" * 200 + "]" * 200)


def test_brackets_beside_one_another_or_in_texts_are_not_deep():
    texts = ["[" * 300, '"[\\' * 300, "\udc80"]
    lists = [[number] for number in range(1000)]
    assert json_value(json.dumps([texts, lists])) == [texts, lists]
    assert json_value(json.dumps([texts, lists]).encode()) == [texts, lists]


class Killed(BaseException):
    """In place of a signal that ends the process."""


def _killed_before(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have the process end before its n-th change of finished files."""
    left = iter(range(number - 1, -1, -1))

    def counted(change: Callable[..., object]) -> Callable[..., object]:
        def changed(path: Path, *arguments: object, **options: object) -> object:
            is_finished = arguments or not path.name.endswith(".part")
            if is_finished and next(left) == 0:
                raise Killed
            return change(path, *arguments, **options)

        return changed

    monkeypatch.setattr(Path, "replace", counted(Path.replace))
    monkeypatch.setattr(Path, "unlink", counted(Path.unlink))


@pytest.mark.parametrize("number", range(1, 7))
def test_a_kill_never_leaves_files_of_two_generations(tmp_path, monkeypatch, number):
    """Nor any that the next one would take for the user's."""

    def listing(hashes):
        return json.dumps({LISTED: dict(hashes)})

    def write(text, *names):
        files = {name: f"{name} {text}" for name in names}
        write_files(
            tmp_path, {**files, "mission.json": listing}, stale=own_files(tmp_path, "mission.json")
        )

    write("old", "events.csv", "trajectory.csv", "knowledge.jsonl")
    with monkeypatch.context() as patched, pytest.raises(Killed):
        _killed_before(number, patched)
        write("new", "events.csv", "trajectory.csv")
    there = [path.name for path in tmp_path.iterdir() if path.name != "mission.json"]
    assert own_files(tmp_path, "mission.json").keys() == {*there}
    assert len({(tmp_path / name).read_text().split()[1] for name in there}) <= 1
