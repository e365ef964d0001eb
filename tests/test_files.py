"""Files from elsewhere: JSON is read as deep as the stack of any Python bears."""

import json

import pytest

from suave_des.files import json_value


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
