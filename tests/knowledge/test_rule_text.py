"""Rules as text: what is read, what is refused and where, and that what is written reads back the
same.
"""

import random
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from suave_des.errors import KnowledgeError
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rdf import MROS, SWRLB, TOMASYS, XSD, Lit
from suave_des.knowledge.reasoner import Reasoner
from suave_des.knowledge.rules import (
    Atom,
    Named,
    Place,
    Rule,
    Variable,
    computed,
    full_name,
    naming,
    write_rule,
)
from suave_des.knowledge.rules.files import fatal_problems, looked_up
from suave_des.knowledge.rules.parser import RuleError, parse_rule, parse_rules
from suave_des.knowledge.state import KnowledgeState

RULE = "LowBattery: QAvalue(?q) ^ isQAtype(?q, battery_level) ^ hasValue(?q, ?v) ^ lessThan(?v, 0.25) -> Role(?q)\n"
EVERYTHING = r"""# rules for a test
prefix my: <http://example.org/my#>

LowBattery:
    FunctionGrounding(?fg) ^ hasQAvalue(?fg, ?q), mros:requiredBy(?fg, suave:fd_spiral_low)   # a comment
    ∧ hasValue(?q, ?v) ^ lessThan(?v, -2.5)
    -> fg_status(?fg, "IN \"ERROR\" \u00e9")

disabled "a rule, with: words": -> my:seen(<http://example.org/x>, true) ^ my:seen(my:y, "3"^^xsd:float)
disabled: A(?x) ^ tomasys:b(?x, 1e-3) → B(?x)
ñandú:é(?ü)->fin(?ü,"x"@en-GB)
"""


def rules_with(text: str, tmp_path: Path, **options: object) -> Ontology:
    path = tmp_path / "mine.swrl"
    path.write_text(text, encoding="utf-8")
    return Ontology.load(rules=[path], **options)  # type: ignore[arg-type]


def told(text: str, tmp_path: Path) -> str:
    with pytest.raises(KnowledgeError) as caught:
        rules_with(text, tmp_path)
    return str(caught.value)


def test_every_construct_is_read():
    (low, quoted, disabled, foreign), errors = parse_rules(EVERYTHING)
    assert errors == ()
    assert (low.name, low.enabled, low.line) == ("LowBattery", True, 4)
    assert low.body[1] == Atom("", "hasQAvalue", (Variable("fg"), Variable("q")))
    assert low.body[2] == Atom(
        "", MROS + "requiredBy", (Variable("fg"), Named(full("suave:fd_spiral_low")))
    )
    assert low.body[4].arguments[1] == Lit("-2.5", XSD + "decimal")
    assert low.body[4].places[2] == Place(6, 39)
    assert low.head[0].arguments[1] == Lit('IN "ERROR" é', XSD + "string")
    assert (quoted.name, quoted.enabled, quoted.body) == ("a rule, with: words", False, ())
    assert quoted.head[0] == Atom(
        "",
        "http://example.org/my#seen",
        (Named("http://example.org/x"), Lit("true", XSD + "boolean")),
    )
    assert quoted.head[1].arguments == (Named("http://example.org/my#y"), Lit("3", XSD + "float"))
    assert (disabled.name, disabled.enabled) == ("disabled", True)
    assert disabled.body[1] == Atom("", TOMASYS + "b", (Variable("x"), Lit("1e-3", XSD + "double")))
    assert (foreign.name, foreign.head[0].arguments[1]) == ("ñandú", Lit("x", "@en-GB"))


def full(name: str) -> str:
    return {"suave:fd_spiral_low": "http://www.metacontrol.org/suave#fd_spiral_low"}[name]


@pytest.mark.parametrize(
    ("text", "place", "problem"),
    [
        ("A: B(?x -> C(?x)", "line 1, column 9", "expected , or )"),
        ("A: B(?x)) -> C(?x)", "line 1, column 9", "expected ^ or ->"),
        ("A: B(?x)\n  C(?x) -> D(?x)", "line 2, column 3", "expected ^ or -> instead of 'C'"),
        ("A B(?x) -> C(?x)", "line 1, column 3", "expected : instead of 'B'"),
        ("A: B(?x) ->", "line 1, column 12", "the text ends here"),
        ('A: B(?x) -> c(?x, "open)', "line 1, column 19", "no closing quote"),
        (r'A: B(?x) -> c(?x, "\q")', "line 1, column 19", r"unknown escape \q"),
        (r'A: B(?x) -> c(?x, "\ud800")', "line 1, column 19", "no file can hold"),
        ("A: B(?x) -> mors:C(?x)", "line 1, column 13", "did you mean mros?"),
        ("A: B(<no iri>) -> C(?x)", "line 1, column 6", "expected an argument"),
        (f"A: B({'9' * 500}) -> C(?x)", "line 1, column 6", "too many digits"),
        (
            'A: B(?x)\n -> c(?x, "1,5"^^xsd:decimal)',
            "line 2, column 11",
            "'1,5' is not an xsd:decimal",
        ),
        (
            'A: c(?x, "2023-13-45"^^xsd:dateTime) -> B(?x)',
            "line 1, column 10",
            "'2023-13-45' is not an xsd:dateTime",
        ),
        ("\x00", "line 1, column 1", "expected a rule's name instead of '\\x00'"),
    ],
)
def test_a_mistake_is_told_with_its_place(text, place, problem, caplog):
    _, (error,) = parse_rules(text)
    assert not caplog.records  # of rdflib
    assert error.place == place
    assert problem in str(error)
    assert "\n" not in str(error)


@pytest.mark.parametrize(
    ("text", "column", "problem"),
    [
        ("A: not B(?x) -> C(?x)", 4, "SWRL has no negation (say what holds instead)"),
        ("A: B(?x) -> not C(?x)", 13, "SWRL has no negation"),
        ("A: B(?x) -> C(?x) or D(?x)", 19, "SWRL has no 'or'"),
        ("A: B(?x) ^ ¬C(?x) -> D(?x)", 12, "SWRL has no negation (say what holds instead)"),
        ("A: B(?x) ∨ C(?x) -> D(?x)", 10, "SWRL has no 'or' (write a rule for each case)"),
        ("A: B(?x) and C(?x) -> D(?x)", 10, "expected ^ or -> instead of 'and'"),
        ("A: B(?x) -> C(?x) and D(?x)", 19, "expected ^ or -> instead of 'and'"),
        (
            "A: B(?x) ^ and C(?x) -> D(?x)",
            12,
            "expected an atom, such as Objective(?o), instead of 'and'",
        ),
        ("A: B(?x) => C(?x)", 10, "expected ^ or -> instead of '=>'"),
        ("A: b(?x, ?v) ^ ?v < 3.5 -> C(?x)", 16, "instead of '?v'"),
        ("A: b(?x, 'FALSE') -> C(?x)", 10, "expected an argument, such as ?o"),
        ("A: B(?x) -> or(?x)", 0, ""),
        ("not: not(?x) -> and(?x)", 0, ""),
    ],
)
def test_what_swrl_does_not_have_or_writes_differently(text, column, problem):
    _, errors = parse_rules(text)
    if column:
        assert str(errors[0]).startswith(f"line 1, column {column}: ") and problem in str(errors[0])
    assert len(errors) == (column > 0)


def test_after_a_mistake_the_other_rules_are_read():
    rules, errors = parse_rules(f"Bad: A(?x -> B(?x)\n{RULE}Worse: )\n    ^ more\n\n{RULE}")
    assert [rule.name for rule in rules] == ["LowBattery", "LowBattery"]
    assert [error.place for error in errors] == ["line 1, column 11", "line 3, column 8"]


@pytest.mark.parametrize(
    ("rule", "column", "words"),
    [
        ("Objectiv(?o) -> Role(?o)", 4, "Objectiv is not defined (did you mean Objective?)"),
        ('Objective(?o) -> o_stat(?o, "x")', 21, "o_stat is not defined (did you mean o_status?)"),
        ("hasValue(?q, ?v) ^ swrlb:lessThn(?v, 1) -> Role(?q)", 23, "no builtin lessThn in Pellet"),
        ("hasValue(?q, ?v) ^ lessThan(?w, 1) -> Role(?q)", 32, "?w has no value in lessThan"),
        ("Role(?q) ^ xsd:string(?w) -> Role(?q)", 26, "?w has no value in string"),
        ("Role(?q) ^ booleanNot(?v, true) -> Role(?q)", 26, "?v has no value in booleanNot"),
        ("hasValue(?q, ?v) -> xsd:decimal(?v)", 24, "datatype decimal occurs in the head"),
        (
            "hasValue(?q, ?v) -> Role(?g)",
            29,
            "?g occurs in the head, but the body does not bind it",
        ),
        ("Objective(?o, ?x) -> Role(?o)", 4, "Objective is a class, but is used as a property"),
        ("o_status(?o) -> Role(?o)", 4, "o_status is a data property, but is used as a class"),
        ("solvesO(?f, ?o, ?p) -> Role(?o)", 4, "solvesO takes two arguments, not 3"),
        ('typeFD(?f, "x") -> Role(?f)', 15, "is a value, but an individual is needed"),
        (
            "fg_status(?f, fd_spiral_low) -> Role(?f)",
            18,
            "is an individual where a value is needed",
        ),
        (
            "FunctionGrounding(?f) -> fg_status(?f, false)",
            43,
            "contradicts whatever it is concluded of",
        ),
        (
            "hasValue(?q, ?v) ^ Role(?v) -> Role(?q)",
            28,
            "?v stands for an individual and for a value",
        ),
        ("Role(?x) -> lessThan(1, 2)", 16, "occurs in the head"),
        (
            "isQAtype(?q, turbidity) -> Role(?q)",
            17,
            "declare it: an individual turbidity of QualityAttributeType",
        ),
        (
            "c_status(?c, FALSE) -> Role(?c)",
            17,
            'FALSE is not defined (declare it, or write "FALSE" for a text',
        ),
        (
            "Role(?r) -> fd_realisability(fd_spiral_low, False)",
            48,
            "False is not defined (declare it",
        ),
        (
            "hasValue(?q, ?v) ^ lessThan(?v, 3,5) -> Role(?q)",
            23,
            "not 3 (arguments are separated by",
        ),
        (
            "Role(?q) ^ date(?d, 2020, 1, 15) -> Role(?q)",
            20,
            "?d has no value in date: no other atom binds it",
        ),
        (
            "hasValue(?q, ?v) ^ xsd:decmal(?v) -> Role(?q)",
            23,
            "datatype decmal is not defined (did you mean decimal?)",
        ),
        ('Role(?q) ^ anyURI(?d, "a") -> Role(?q)', 15, "anyURI takes 7 arguments, not 2"),
    ],
)
def test_rules_that_pellet_would_ignore_are_refused(rule, column, words, tmp_path):
    said = told(f"A: {rule}", tmp_path)
    assert f"mine.swrl: line 1, column {column}: " in said
    assert words in said


def test_an_ambiguous_name_may_be_written_in_full(suave_copy, tmp_path):
    twins = "".join(f'<owl:Class rdf:about="http://{one}.org/#Twin"/>' for one in "ab")
    path = tmp_path / "mine.swrl"
    path.write_text("A: <http://a.org/#Twin>(?x) -> Role(?x)", encoding="utf-8")
    assert Ontology.load([suave_copy(twins)], rules=[path]).rules


def test_a_file_takes_the_place_of_rules_of_its_names(kb, tmp_path):
    changed = rules_with(
        "disabled QAenergy: Role(?x) -> Role(?x)\ncompRecov: Role(?x) -> Role(?x)\n", tmp_path
    )
    assert len(changed.rules) == len(kb.rules)
    by_name = {rule.name: rule for rule in changed.rules}
    assert not by_name["QAenergy"].enabled
    assert by_name["compRecov"].text == "Role(?x) -> Role(?x)"
    assert by_name["compRecov"].file.name == "mine.swrl"
    assert changed.content_hash != kb.content_hash


def test_rules_are_switched_off_by_name(kb, tmp_path):
    off = rules_with(RULE, tmp_path, disabled_rules=["LowBattery", "S1a"])
    assert [rule.name for rule in off.rules if not rule.enabled] == ["LowBattery", "S1a"]
    assert off.content_hash not in (kb.content_hash, rules_with(RULE, tmp_path).content_hash)


def same(one: Rule, other: Rule) -> bool:
    return (one.name, one.enabled, one.body, one.head) == (
        other.name,
        other.enabled,
        other.body,
        other.head,
    )


@pytest.fixture(scope="module")
def shipped_text(kb) -> str:
    """The shipped rules as text."""
    named = naming(lambda iri: not kb.vocabulary.means_itself(iri))
    return "\n".join(
        write_rule(rule.name, rule.body, rule.head, named, enabled=rule.enabled)
        for rule in kb.rules
    )


def test_the_shipped_rules_are_written_with_short_names(shipped_text):
    assert "<" not in shipped_text.replace("<http", "")


def test_the_shipped_rules_read_back_as_they_were_written(kb, shipped_text, tmp_path):
    again = rules_with(shipped_text, tmp_path)
    assert all(map(same, again.rules, kb.rules))
    builtins = [each.content.n_triples().count("BuiltinAtom") for each in (again, kb)]
    assert builtins[0] == builtins[1]


words = st.from_regex(r"[A-Za-zé_][\w.-]{0,8}", fullmatch=True)
texts = st.text(
    st.characters(exclude_categories=["Cs", "Cc"]) | st.sampled_from('"\\\n\t#'), max_size=12
)
iris = words.filter(lambda word: word[-1] not in ".-").map(
    lambda word: f"http://x.org/{word}#y"
) | st.sampled_from([TOMASYS + "Objective", MROS + "energy", SWRLB + "lessThan", "urn:a:b"])
literals = (
    texts.map(lambda text: Lit(text, XSD + "string"))
    | texts.map(lambda text: Lit(text, "http://x.org/#t"))
    | st.decimals(allow_nan=False, allow_infinity=False).map(
        lambda number: Lit(format(number, "f"), XSD + "decimal")
    )
    | st.integers().map(lambda number: Lit(str(number), XSD + "integer"))
    | st.floats(allow_nan=False, allow_infinity=False).map(
        lambda number: Lit(repr(number), XSD + "double")
    )
    | st.booleans().map(lambda truth: Lit(str(truth).lower(), XSD + "boolean"))
    | texts.map(lambda text: Lit(text, "@en"))
)
terms = literals | iris.map(Named) | st.from_regex(r"\w[\w-]{0,6}", fullmatch=True).map(Variable)
atoms = st.builds(
    lambda name, arguments: Atom("", name, tuple(arguments)), iris, st.lists(terms, max_size=4)
)


@given(
    texts.filter(str.strip) | words.filter(lambda word: word[-1] not in ".-"),
    st.lists(atoms, max_size=4),
    st.lists(atoms, min_size=1, max_size=3),
    st.booleans(),
)
def test_any_rule_that_is_written_reads_back_the_same(name, body, head, enabled):
    rule = parse_rule(write_rule(name, body, head, full_name, enabled=enabled))
    assert (rule.name, rule.body, rule.head, rule.enabled) == (
        name,
        tuple(body),
        tuple(head),
        enabled,
    )


@pytest.mark.parametrize("count", [1_000, pytest.param(20_000, marks=pytest.mark.slow)])
def test_mutated_texts_give_rules_or_rule_errors(kb, count):
    draw = random.Random(3)
    alphabet = [
        *"()?,:^->\"\\#<>@{}[]' \n\t\r0129.eE+_x",
        *("->", "∧", "é", "\x00", "\ud800", "\u2028", "𝔘", "prefix ", "^^"),
    ]
    pieces = [*EVERYTHING.splitlines(), RULE, *(f"{rule.name}: {rule.text}" for rule in kb.rules)]
    outcomes = {"rule": 0, "syntax": 0, "meaning": 0}
    for _ in range(count):
        text = list("\n".join(draw.sample(pieces, 2)))
        for _ in range(draw.randint(1, 6)):
            at = draw.randrange(len(text) + 1)
            change = draw.random()
            if change < 0.4:
                text[at : at + draw.randint(1, 12)] = []
            elif change < 0.8:
                text.insert(at, draw.choice(alphabet))
            else:
                begin = draw.randrange(len(text) + 1)
                text[at:at] = text[begin : begin + draw.randint(1, 30)]
        rules, errors = parse_rules("".join(text), Path("fuzz.swrl"))
        outcomes["syntax"] += len(errors)
        for rule in rules:
            try:
                fatal_problems(looked_up(rule, kb.vocabulary), kb.vocabulary)
                outcomes["rule"] += 1
            except RuleError:
                outcomes["meaning"] += 1
    assert min(outcomes.values()) > count / 20


def test_a_rule_of_five_thousand_atoms_is_read_at_once():
    body = " ^ ".join(f"hasValue(?q, ?v{number})" for number in range(5000))
    assert len(parse_rule(f"Long: {body} -> Role(?q)").body) == 5000


@pytest.mark.parametrize(
    "rule",
    [
        "Role(?q) ^ differentFrom(?q, ?w) -> Role(?w)",
        "c_status(?c, false) -> Component(?c)",
        "hasValue(?q, 2) -> Role(?q)",
        "Role(?q) -> <http://x.org/#New>(?q)",
        "Role(?q) -> requiresO(?q, <http://x.org/#nobody>)",
    ],
)
def test_what_pellet_takes_is_read_even_where_it_never_matches(rule, tmp_path):
    """So what `kb rules` prints of an ontology can be given as rules: S2 and S10 of the exemplar."""
    assert "A" in {each.name for each in rules_with(f"A: {rule}", tmp_path).rules}


def test_a_rule_that_asks_for_what_is_the_same_binds_both(suave_copy, tmp_path):
    same = (
        '<rdf:Description rdf:about="http://www.metacontrol.org/suave#c_thruster_1">'
        '<owl:sameAs rdf:resource="http://www.metacontrol.org/suave#c_thruster_2"/></rdf:Description>'
    )
    (tmp_path / "mine.swrl").write_text("A: sameAs(?x, ?y) -> hasNFR(?x, ?y)\n", encoding="utf-8")
    base = Ontology.load([suave_copy(same)], rules=[tmp_path / "mine.swrl"])
    found = set(map(str, Reasoner(base, "pellet").analyze(KnowledgeState()).facts))
    assert "hasNFR(c_thruster_1, c_thruster_2)" in found


def test_a_whole_number_may_be_concluded_where_decimals_are_wanted():
    """As it is one (XML Schema, part 2)."""
    vocabulary = Ontology.load().vocabulary
    rule = looked_up(parse_rule("A: QAvalue(?q) -> hasValue(?q, 2)"), vocabulary)
    assert fatal_problems(rule, vocabulary) == []


@pytest.mark.parametrize(
    ("year", "found"), [(Variable("y"), {"d"}), (Lit("2020", XSD + "integer"), set())]
)
def test_pellet_computes_a_date_from_variables_only(year, found):
    date = Atom("builtin", SWRLB + "date", (Variable("d"), year, Variable("m"), Variable("n")))
    assert computed(date, {"y", "m", "n"}) == found
