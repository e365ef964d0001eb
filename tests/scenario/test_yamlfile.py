"""YAML files, and tables of signals: what is read, and each way in which a file is refused."""

import hashlib
import json
import string
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from suave_des.errors import InputError
from suave_des.scenario.models import read_table
from suave_des.scenario.yamlfile import YAML_LIMIT_BYTES, read_yaml


def refused(path: Path | str) -> str:
    with pytest.raises(InputError) as caught:
        read_yaml(path)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert "\n" not in message
    return message


def test_a_key_has_at_most_200_characters(write):
    longest = "k" * 200
    assert read_yaml(write("longest.yaml", f"{longest}: 1\n")).data == {longest: 1}
    assert "a key must be short text" in refused(write("longer.yaml", f"k{longest}: 1\n"))


SCALARS = {
    **{
        "1.5": 1.5,
        "1e3": 1000.0,
        "-.5": -0.5,
        "2023": 2023,
        "010": 10,
        "true": True,
        "~": None,
        "": None,
    },
    **{"1:30": "1:30", "2023-02-04": "2023-02-04", "yes": "yes", "'80'": "80"},
}


def test_scalars_follow_the_core_schema(write):
    document = read_yaml(
        write("a.yaml", "".join(f"k{number}: {text}\n" for number, text in enumerate(SCALARS)))
    )
    assert list(document.data.values()) == list(SCALARS.values())
    assert [type(value) for value in document.data.values()] == [
        type(value) for value in SCALARS.values()
    ]


@pytest.mark.parametrize(
    ("keys", "line"),
    [(("a",), 2), (("a", "b"), 3), (("a", "c", 1), 6), (("a", "c", 1, "d"), 6)],
    ids=["a key", "a key within it", "an item", "a key of it"],
)
def test_what_is_in_a_file_has_its_line(write, keys, line):
    content = "# comment\na:\n  b: 1\n  c:\n    - x\n    - {d: 2}\n"
    assert read_yaml(write("a.yaml", content)).place(keys).line == line


def test_a_path_that_is_not_there_has_the_line_of_what_would_hold_it(write):
    assert read_yaml(write("a.yaml", "x: 1\na:\n  b: 1\n")).place(("a", "z", 3)).line == 2


def test_an_alias_gives_the_same_data_again(write):
    assert read_yaml(write("a.yaml", "a: &x [1, 2]\nb: *x\n")).data == {"a": [1, 2], "b": [1, 2]}


@pytest.mark.parametrize(
    ("content", "place", "problem"),
    [
        (b"a: 1\nb: \xff\n", "line 2", "is not UTF-8 text"),
        (b"a: 1\nb: \x00\n", "line 2", r"holds '\x00', which YAML does not allow"),
        ("# only a comment\n", "line 1", "is empty"),
        ("\n- a\n- b\n", "line 2", "not a mapping at its top level"),
        ("a: 1\nb: c: d\n", "line 2", "is not valid YAML: mapping values are not allowed here"),
        ("a: 1\n---\nb: 2\n", "line 2", "found another document"),
        ("a: *nobody\n", "line 1", "undefined alias"),
        ("a: 1\nb: 2\na: 3\n", "line 3, a", "'a' appears twice, first in line 1"),
        ("[a, b]: 1\n", "line 1", "a key must be short text"),
        ("a: !!float abc\n", "line 1, a", "expected !!float, got 'abc'"),
    ],
)
def test_what_is_no_plain_mapping_is_refused_with_its_line(write, content, place, problem):
    message = refused(write("a.yaml", content))
    assert message.startswith(f"a.yaml: {place}: ")
    assert problem in message


@pytest.mark.parametrize(
    "value",
    [
        "!!python/object/apply:os.system ['touch made']",
        "!!python/object:suave_des.errors.InputError {}",
        "!!python/name:os.system",
        "!!python/tuple [1, 2]",
        "!!binary aGVsbG8=",
        "!!timestamp 2023-02-04",
        "!own text",
    ],
)
def test_a_tag_that_would_build_an_object_is_refused(write, value):
    assert refused(write("a.yaml", f"x: 1\na: {value}\n")).startswith(
        "a.yaml: line 2, a: the tag '!"
    )


def test_it_builds_nothing(write):
    refused(write("a.yaml", "a: !!python/object/apply:os.system ['touch made']\n"))
    assert not Path("made").exists()


def test_a_bomb_of_aliases_is_refused_before_it_is_written_out(write):
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 60)]
    assert "expands to more than 100,000 values" in refused(write("a.yaml", "\n".join(lines)))


@pytest.mark.parametrize(
    "content",
    ["a: " + "[" * 20_000, "a: " + "{a: " * 20_000, "a: &x [1, *x]\n", "a: &x {b: {c: *x}}\n"],
)
def test_what_is_nested_without_end_is_refused(write, content):
    assert "is nested too deep" in refused(write("a.yaml", content))


def test_a_large_file_is_refused(write):
    assert f"is larger than {YAML_LIMIT_BYTES:,} bytes" in refused(
        write("a.yaml", b"a: 1\n#" + b"x" * YAML_LIMIT_BYTES)
    )


PLAIN = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(10**15), 10**15)
    | st.floats(-1e9, 1e9)
    | st.text(string.printable),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.text("abcxyz_", min_size=1), inner, max_size=4)
    ),
    max_leaves=15,
)


@given(
    data=st.dictionaries(st.text("abcxyz_", min_size=1), PLAIN, min_size=1, max_size=5),
    indent=st.sampled_from([None, 0, 2]),
)
def test_json_of_plain_data_is_read_as_it_was(tmp_path_factory, data, indent):
    path = tmp_path_factory.mktemp("yaml") / "a.yaml"
    path.write_text(json.dumps(data, indent=indent), encoding="utf-8")
    assert read_yaml(path).data == data


@given(
    content=st.binary(max_size=200)
    | st.text("ab: -[]{},&*!|>'\"#\n\t0.", max_size=60).map(str.encode)
)
def test_any_bytes_are_read_or_refused_in_one_line(tmp_path_factory, content):
    path = tmp_path_factory.mktemp("yaml") / "a.yaml"
    path.write_bytes(content)
    try:
        document = read_yaml(path)
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert all(isinstance(key, str) for key in document.data)


TABLE = "t_s,value\n0,3.5\n 60 , 1e0\n\n120,-2\n"


def test_a_table_gives_times_with_their_values(write):
    columns, _ = read_table(write("t.csv", TABLE))
    assert columns == ((0.0, 60.0, 120.0), (3.5, 1.0, -2.0))


def test_a_table_gives_the_hash_of_its_file(write):
    _, digest = read_table(write("t.csv", TABLE))
    assert digest == hashlib.sha256(TABLE.encode()).hexdigest()


@pytest.mark.parametrize(
    "content",
    [b"value,t_s\n3.5,0\n1.0,60\n", b"\xef\xbb\xbft_s,value\r\n0,3.5\r\n60,1.0\r\n"],
    ids=["in another order", "by Excel"],
)
def test_a_table_may_be_written(write, content):
    table, _ = read_table(write("t.csv", content))
    assert table == ((0.0, 60.0), (3.5, 1.0))


@pytest.mark.parametrize(
    ("content", "place", "problem"),
    [
        ("", "line 1", "under the first line t_s,value"),
        ("0,3.5\n60,1\n", "line 1", "the columns are '0,3.5'"),
        ("t_s,value\n", "line 1", "has no row under its header"),
        ("t_s,value\n0,1\n60\n", "line 3", "'60' is not two numbers"),
        ("t_s,value\n0,murky\n", "line 2", "'0,murky' is not two numbers"),
        ("t_s,value\n0,nan\n", "line 2", "value nan is out of range"),
        ("t_s,value\n0,1\n60,2\n30,3\n", "line 4", "t_s 30 does not come after 60"),
        ("t_s,value\n1e10,1\n", "line 2", "t_s 1e+10 is out of range"),
        (b"t_s,value\n0,\xff\n", "line 2", "is not UTF-8 text"),
        ('t_s,value\n0,"1\n', "line 2", "is not valid CSV"),
    ],
)
def test_a_wrong_table_is_refused_with_its_line(write, content, place, problem):
    path = write("t.csv", content)
    with pytest.raises(InputError) as caught:
        read_table(path)
    message = str(caught.value)
    assert message.startswith(f"t.csv: {place}: ")
    assert problem in message
    assert caught.value.remedy
