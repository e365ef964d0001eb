"""Tables of signals from CSV files."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from suave_des.errors import InputError
from suave_des.scenario.physical import read_table


def test_a_table_gives_times_and_values(write):
    (times_s, values), digest = read_table(write("t.csv", "t_s,value\n0,3.5\n 60 , 1e0\n\n120,-2\n"))
    assert times_s == (0.0, 60.0, 120.0)
    assert values == (3.5, 1.0, -2.0)
    assert len(digest) == 64


def test_columns_may_be_in_any_order_and_excel_may_have_written_it(write):
    table, _ = read_table(write("t.csv", b"\xef\xbb\xbfvalue,t_s\r\n3.5,0\r\n1.0,60\r\n"))
    assert table == ((0.0, 60.0), (3.5, 1.0))


@pytest.mark.parametrize(
    ("content", "place", "problem"),
    [
        ("", "line 1", "the first line must be t_s,value"),
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


@given(rows=st.dictionaries(st.floats(-1e9, 1e9), st.floats(-1e12, 1e12), min_size=1))
def test_every_table_is_read_back_exactly(tmp_path_factory, rows):
    path = tmp_path_factory.mktemp("tables") / "t.csv"
    ordered = sorted(rows.items())
    path.write_text("t_s,value\n" + "".join(f"{time_s!r},{value!r}\n" for time_s, value in ordered))
    (times_s, values), _ = read_table(path)
    assert list(zip(times_s, values, strict=True)) == ordered
