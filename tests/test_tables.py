"""One table in every form of output: aligned, broken where too wide, and with nothing that the form
would obey.
"""

import pytest

from suave_des.tables import Table, broken_name

TABLE = Table(
    ("manager", "n", "mean", "95% interval"),
    [
        ("none", "20", "187.85", "168.0 to 207.7"),
        ("own:Metacontrol_of_mine", "5", "-1.50", "-3e-5 to 1.2"),
    ],
    "search time (s)",
)


def test_text_is_aligned():
    assert TABLE.text().split("\n") == [
        "manager                   n    mean    95% interval",
        "none                     20  187.85  168.0 to 207.7",
        "own:Metacontrol_of_mine   5   -1.50    -3e-5 to 1.2",
    ]


def test_a_text_that_is_too_wide_breaks_names_alone():
    assert TABLE.text(45).split("\n") == [
        "manager            n    mean    95% interval",
        "none              20  187.85  168.0 to 207.7",
        "own:Metacontrol_   5   -1.50    -3e-5 to 1.2",
        "  of_mine",
    ]


def test_a_text_gets_no_narrower_than_its_numbers():
    assert TABLE.text(10) == TABLE.text(40)


def test_a_row_of_one_cell_is_a_heading_of_those_below():
    table = Table(("difference", "p"), [("search time (s)",), ("a - b", "0.02")])
    assert table.text() == "difference     p\nsearch time (s)\na - b       0.02"
    assert table.markdown().split("\n")[2] == "| search time (s) |  |"
    assert r"\multicolumn{2}{l}{search time (s)}" in table.latex()


def test_markdown_shows_names_as_they_are():
    table = Table(("a|b", "n"), [("<b>*_x_*</b>", "1")])
    assert (
        table.markdown()
        == "| a\\|b | n |\n| --- | ---: |\n| &lt;b&gt;\\*\\_x\\_\\*&lt;/b&gt; | 1 |"
    )


def test_latex_is_written_as_it_is_printed():
    table = Table(
        ("Manager", "Mean", "Std", "Mean", "Std"),
        [("a_b & c", "1", "-2", "3e-05", "-1.0 to -0.5")],
        "50%",
    )
    lines = [line.strip() for line in table.latex(("Time (s)", "Way (m)")).split("\n")]
    assert lines == [
        r"\begin{table}",
        r"\centering",
        r"\caption{50\%}",
        r"\begin{tabular}{lrrrr}",
        r"\toprule",
        r"& \multicolumn{2}{c}{Time (s)} & \multicolumn{2}{c}{Way (m)} \\",
        r"\cmidrule(lr){2-3} \cmidrule(lr){4-5}",
        r"Manager & Mean & Std & Mean & Std \\",
        r"\midrule",
        r"a\_b \& c & 1 & $-2$ & $3 \cdot 10^{-5}$ & $-1.0$ to $-0.5$ \\",
        r"\bottomrule",
        r"\end{tabular}",
        r"\end{table}",
    ]


OF_MARKUP = Table(("name", "n"), [('<i>"a", b</i>', "1")], "t & u")


def test_csv_has_cells_as_they_are():
    assert OF_MARKUP.csv() == 'name,n\n"<i>""a"", b</i>",1\n'


def test_a_notebook_shows_the_title_above_the_header():
    assert OF_MARKUP._repr_markdown_().startswith("t & u\n\n| name | n |\n")


def test_a_notebook_shows_markup_as_text():
    assert '| &lt;i&gt;"a", b&lt;/i&gt; | 1 |' in OF_MARKUP._repr_markdown_()


def test_names_break_where_words_end():
    assert broken_name("tests.helpers.own:MyManager", 14) == "tests.helpers.\n  own:My\n  Manager"
    assert broken_name("metacontrol (n = 20)", 14) == "metacontrol\n  (n = 20)"
    assert broken_name("first\n_second", 7) == "first\n_second"


def test_latex_has_a_minus_before_each_negative_number():
    cells = ("-0.82 (-0.90 to -0.70)", "-3.3 points", "", "-1e-05")
    table = Table(("a", "b", "c", "d", "e"), [("x-1 \N{MINUS SIGN} y", *cells)])
    row = r"x-1 $-$ y & $-0.82$ ($-0.90$ to $-0.70$) & $-3.3$ points & & $-1 \cdot 10^{-5}$ \\"
    assert row in table.latex()


@pytest.mark.parametrize(
    ("name_length", "is_small", "columns"),
    [
        (50, False, "{lr}"),
        (66, True, "{lr}"),
        (80, True, r"{>{\raggedright\arraybackslash}p{0.31\linewidth}r}"),
    ],
    ids=["as it is", "in small print", "with names that break"],
)
def test_a_table_fits_the_page_in_latex(name_length, is_small, columns):
    latex = Table(("a", "b"), [("n" * name_length, "1234")]).latex()
    assert (r"\footnotesize" in latex) == is_small
    assert columns in latex
