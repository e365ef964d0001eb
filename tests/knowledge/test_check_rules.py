"""kb check: every mistake in a rule that Pellet is silent about is a finding with its place."""

from pathlib import Path

import pytest

from suave_des.errors import Level, has_level
from suave_des.scenario_knowledge import REPORTED_STATUSES
from tests.helpers.checks import (
    OWL,
    SUAVE,
    SWRL,
    TOMASYS,
    errors,
    found,
    found_by_pellet,
    only,
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One for all tests, which are about rules: shapes of the same file are checked once."""
    return tmp_path_factory.mktemp("checked")


DECLARE = "declare it as {} property in the ontology"


#: What Pellet drops or ignores (the table of its silent cases), each as a rule on one line.
SILENT = {
    "unknown builtin": (
        "A: hasValue(?q, ?v) ^ swrlb:lessThn(?v, 1) -> Role(?q)",
        23,
        "did you mean lessThan?",
    ),
    "undeclared class": ("A: <http://x.org/#Rol>(?q) -> Role(?q)", 4, "did you mean Role?"),
    "head literal outside the range": ("A: Role(?q) -> fg_status(?q, 1)", 30, "a value of string"),
    "syntax": ("A: Role(?q -> Role(?q)", 12, "parentheses must balance"),
}


@pytest.mark.parametrize("case", SILENT)
def test_what_pellet_is_silent_about_is_an_error_with_its_place(case, folder):
    rule, column, remedy = SILENT[case]
    (error,) = errors(found(folder, f"# first line\n{rule}\n"))
    assert (error.file, error.line, error.column) == (str(folder / "mine.swrl"), 2, column)
    assert error.rule == ("A" if case != "syntax" else None)
    assert error.remedy == remedy


OWL_RULE = f"""
    <swrl:Variable xmlns:swrl="{SWRL}" rdf:about="urn:swrl:var#x"/>
    <swrl:Variable xmlns:swrl="{SWRL}" rdf:about="urn:swrl:var#y"/>
    <swrl:Variable xmlns:swrl="{SWRL}" rdf:about="urn:swrl:var#z"/>
    <rdf:Description><rdfs:label>mine</rdfs:label><rdf:type rdf:resource="{SWRL}Imp"/>
      <swrl:body rdf:parseType="Collection"><swrl:IndividualPropertyAtom>
        <swrl:propertyPredicate rdf:resource="{TOMASYS}fg_status"/>
        <swrl:argument1 rdf:resource="urn:swrl:var#x"/><swrl:argument2 rdf:resource="urn:swrl:var#y"/>
      </swrl:IndividualPropertyAtom></swrl:body>
      <swrl:head rdf:parseType="Collection"><swrl:ClassAtom>
        <swrl:classPredicate rdf:resource="{TOMASYS}Roel"/><swrl:argument1 rdf:resource="urn:swrl:var#z"/>
      </swrl:ClassAtom></swrl:head></rdf:Description>
"""


def test_rules_of_ontologies_are_checked_likewise(folder):
    findings = errors(found(folder, extra=OWL_RULE))
    text = (folder / "suave.owl").read_text(encoding="utf-8")
    line = text[: text.index("mine</rdfs:label>")].count("\n") + 1
    assert {(one.file, one.line, one.rule) for one in findings} == {
        (str(folder / "suave.owl"), line, "mine")
    }
    assert sorted(one.message for one in findings) == [
        "?z occurs in the head, but the body does not bind it",
        "fg_status is a data property, but is used as an object property",
    ]


def test_a_literal_of_an_ontologys_rule_that_is_none_of_its_datatype(folder):
    decimal = "http://www.w3.org/2001/XMLSchema#decimal"
    atom = (
        f'<swrl:DatavaluedPropertyAtom><swrl:propertyPredicate rdf:resource="{TOMASYS}hasValue"/>'
        '<swrl:argument1 rdf:resource="urn:swrl:var#z"/>'
        f'<swrl:argument2 rdf:datatype="{decimal}">1,5</swrl:argument2></swrl:DatavaluedPropertyAtom></swrl:body>'
    )
    rule = OWL_RULE.replace("</swrl:body>", atom).replace("Roel", "Role")
    error = only(found(folder, extra=rule), "'1,5' is not an xsd:decimal")
    assert (error.level, error.rule) == (Level.ERROR, "mine")


def test_all_mistakes_of_a_file_are_reported_at_once(folder):
    rules = "A: Rle(?x) -> Role(?x)\nB: Role(?x -> Role(?x)\ndisabled C: Role(?x) -> Role(?y)\n"
    assert [one.line for one in errors(found(folder, rules))] == [1, 2]


TWO_FAILED = (
    'two: c_status(?a, "FALSE") ^ c_status(?b, "FALSE") ^ differentFrom(?a, ?b) -> Role(?a)\n'
)


def test_different_names_alone_do_not_make_individuals_different(folder):
    warning = only(found(folder, TWO_FAILED), "differentFrom(?a, ?b)")
    assert (warning.level, warning.rule, warning.column) == (Level.WARN, "two", 54)
    assert "owl:AllDifferent" in str(warning.remedy)


@pytest.mark.parametrize(
    "axiom",
    [
        f'''<rdf:Description><rdf:type rdf:resource="{OWL}AllDifferent"/>
        <owl:distinctMembers rdf:parseType="Collection"><rdf:Description rdf:about="{SUAVE}c_thruster_1"/>
        <rdf:Description rdf:about="{SUAVE}c_thruster_2"/></owl:distinctMembers></rdf:Description>''',
        f'''<rdf:Description rdf:about="{SUAVE}c_thruster_1">
        <owl:differentFrom rdf:resource="{SUAVE}c_thruster_2"/></rdf:Description>''',
        f'''<rdf:Description rdf:about="{TOMASYS}Component">
        <owl:disjointWith rdf:resource="{TOMASYS}FunctionDesign"/></rdf:Description>''',
    ],
    ids=["all different", "different from", "disjoint classes"],
)
def test_individuals_that_are_declared_different(folder, axiom):
    assert not [
        each for each in found(folder, TWO_FAILED, axiom) if "differentFrom" in each.message
    ]


def test_a_rule_may_conclude_that_individuals_are_different(folder):
    concluding = (
        'other: c_status(?a, "FALSE") ^ c_status(?b, "RECOVERED") -> differentFrom(?a, ?b)\n'
    )
    assert not [
        each for each in found(folder, TWO_FAILED + concluding) if "declare" in str(each.remedy)
    ]


def test_a_rule_that_never_fires(folder):
    rules = "A: requiresO(?g, ?o) -> Role(?g)\nB: Role(?g) -> Binding(?g)\n"
    rules += 'C: c_status(?c, "ANYTHING") -> Binding(?c)\n'
    findings = [one for one in found(folder, rules) if one.file and one.file.endswith("mine.swrl")]
    assert [(one.level, one.rule, one.column) for one in findings] == [
        (Level.WARN, "A", 4),
        (Level.WARN, "B", 4),
    ]


def test_a_rule_on_an_attribute_that_no_grounding_has_a_value_of(folder):
    rule = "A: hasQAvalue(?g, ?q) ^ isQAtype(?q, {}) ^ hasValue(?q, ?v) ^ lessThan(?v, 0.3) -> Role(?g)"
    finding = only(
        found(folder, rule.format("battery_level")),
        "no function design has an estimate of battery_level",
    )
    assert (finding.level, finding.rule, finding.column) == (Level.WARN, "A", 25)
    assert not has_level(found(folder, rule.format("water_visibility")), Level.WARN)
    given = "\nB: FunctionGrounding(?g) ^ isQAtype(?q, battery_level) -> hasQAvalue(?g, ?q)"
    assert not has_level(found(folder, rule.format("battery_level") + given), Level.WARN)


@pytest.mark.parametrize(
    ("status", "level", "remedy"),
    [
        ("FALSE", None, ""),
        ("LEAK", None, ""),
        ("WORN", None, ""),  # concluded by another rule
        ("False", Level.WARN, 'did you mean "FALSE"?'),
        ("RECOVERD", Level.WARN, 'did you mean "RECOVERED"?'),
        ("stuck", None, ""),  # a function of the user's may report it
    ],
)
def test_a_component_status_that_nothing_reports(folder, status, level, remedy):
    rules = f'A: c_status(?c, "{status}") -> Role(?c)\nB: Role(?c) -> c_status(?c, "WORN")\n'
    findings = found(folder, rules, reported=REPORTED_STATUSES)
    named = [
        (one.level, one.rule, one.column, one.remedy)
        for one in findings
        if "reports c_status" in one.message
    ]
    assert named == ([] if level is None else [(level, "A", 17, remedy)])


def test_a_rule_as_text_that_takes_the_place_of_another_is_reported(folder):
    finding = only(found(folder, "S1a: Role(?q) -> Role(?q)"), "replaces the rule of this name in")
    assert (finding.level, finding.rule, finding.line) == (Level.WARN, "S1a", 1)
    assert finding.message.endswith("mros.owl")
    same = 'S1a: FunctionGrounding(?fg) ^ fg_status(?fg, "IN_ERROR_COMPONENT") ^ solvesO(?fg, ?o)'
    findings = found(folder, f'{same} -> o_status(?o, "IN_ERROR_COMPONENT")')
    assert not [one for one in findings if "replaces the rule of this name" in one.message]


def warned(folder: Path, rule: str, **options: object) -> list[tuple[int | None, str, str | None]]:
    """Column, message and remedy of the warnings about a rule."""
    findings = found(folder, rule, reported=REPORTED_STATUSES, **options)  # type: ignore[arg-type]
    return [
        (one.column, one.message, one.remedy)
        for one in findings
        if one.rule == "A" and one.level is Level.WARN
    ]


WITHOUT_FIRING = {
    "two values asked": (
        'A: c_status(?c, "FALSE") ^ c_status(?c, "LEAK") -> Role(?c)',
        (28, 'c_status(?c, "LEAK"): nothing has two values of c_status, so the rule never fires'),
    ),
    "value replaced": (
        "A: isQAtype(?q, water_visibility) ^ hasValue(?q, ?v) ^ lessThan(?v, 1.0) -> hasValue(?q, 1.0)",
        (77, "hasValue(?q, 1.0) contradicts hasValue in the body, which holds as well"),
    ),
    "realisable": (
        "A: hasValue(?q, ?v) ^ greaterThan(?v, 3.5) -> fd_realisability(fd_spiral_high, true)",
        (
            47,
            "fd_realisability true has no effect: a design counts as realisable unless it is false",
        ),
    ),
    "another capital": (
        "A: hasQAvalue(?g, ?q) ^ isQAtype(?Q, water_visibility) ^ hasValue(?Q, ?v) -> Role(?g)",
        (19, "?q occurs only here, and is another variable than ?Q"),
    ),
    "unmeasured": (
        "A: hasQAvalue(?g, ?q) ^ isQAtype(?q, performance) -> Role(?g)",
        (
            25,
            "can never fire: missions do not measure performance, so no grounding has a value of it",
        ),
    ),
    "no value": (
        "A: isQAtype(?q, battery_level) ^ hasValue(?q, ?v) -> Role(?q)",
        (
            4,
            "can never fire: missions do not measure battery_level, and no ontology has a value of it",
        ),
    ),
    "misspelt variable": (
        "A: hasQAvalue(?g, ?q) ^ hasValue(?q, ?vlaue) ^ hasValue(?other, ?value) ^ lessThan(?value, 2) -> Role(?q)",
        (38, "?vlaue occurs only here, and is another variable than ?value"),
    ),
    "excluded text": (
        'A: c_status(?c, ?s) ^ notEqual(?s, "False") -> Role(?c)',
        (36, 'nothing in the simulation reports c_status "False"'),
    ),
}


@pytest.mark.parametrize("case", WITHOUT_FIRING)
def test_a_rule_that_cannot_do_what_it_should(case, folder):
    rule, finding = WITHOUT_FIRING[case]
    assert [one[:2] for one in warned(folder, rule, measured=["water_visibility"])] == [finding]


@pytest.mark.parametrize(
    "rule",
    [
        'A: c_status(?c, "FALSE") ^ c_status(?d, "RECOVERED") -> Role(?c)',
        "A: hasValue(?q, 2.0) ^ hasValue(?q, 2.00) -> Role(?q)",
        'A: o_status(?o, "UNGROUNDED") -> o_status(?o, "UNGROUNDED")',
        'A: fg_status(?g, ?s) ^ equal(?s, "IN_ERROR_NFR") -> fg_status(?g, "IN_ERROR_NFR")',
        'A: fg_status(?g, "IN_ERROR_NFR") ^ solvesO(?g, ?o) -> o_status(?o, "IN_ERROR_NFR")',
        "A: hasValue(?q, ?v) ^ hasValue(?r, ?w) ^ lessThan(?v, ?w) -> Role(?q)",
        "A: requiredBy(?c, ?d) -> fd_realisability(?d, true)\nB: fd_realisability(?d, true) -> Role(?d)",
        'A: Component(?c) ^ c_status(?c, "RECOVERED") ^ Objective(?o) -> o_updatable(?o, true)',
        "A: hasQAvalue(?g, ?q) ^ hasQAvalue(?h, ?q) ^ typeFD(?g, fd_spiral_low) -> Role(?h)",
        "A: hasQAvalue(?g, ?q) ^ isQAtype(?q, water_visibility) -> Role(?g)",
        "A: isQAtype(?q, performance) ^ hasValue(?q, ?v) -> Role(?q)",
        "A: isQAtype(?q, battery_level) -> Role(?q)\nB: Role(?q) -> isQAtype(?q, battery_level)",
        "A: hasValue(?q, ?v) ^ hasValue(?Q, ?V) ^ isQAtype(?q, ?t) ^ isQAtype(?Q, ?t) ^ lessThan(?v, ?V) -> Role(?q)",
        'A: o_status(?o, ?s) ^ equal(?s, "UNGROUNDED") -> Role(?o)',
        'A: c_status(?c, ?s) ^ equal("LEAK", ?s) -> Role(?c)',
        'A: c_status(?c, ?s) ^ notEqual(?s, "TRUE") -> Role(?c)',
        "A: hasValue(?q, ?v) ^ equal(?v, 2) ^ lessThanOrEqual(?v, 2) -> QAvalue(?q)",
        "A: solvesO(?g, ?o) ^ typeFD(?g, fd_spiral_low) ^ solvesO(?h, ?p) ^ o_updatable(?p, true) -> Role(?h)",
    ],
)
def test_a_rule_that_can(rule, folder):
    assert not warned(folder, rule, measured=["water_visibility"])


@pytest.mark.parametrize(
    ("rule", "level", "column", "consequence"),
    [
        (
            'A: FunctionGrounding(?g) -> fg_status(?g, "IN_EROR_NFR")',
            Level.ERROR,
            43,
            "contradicts whatever it is concluded of",
        ),
        (
            'A: o_status(?o, "IN_EROR_NFR") -> o_updatable(?o, true)',
            Level.WARN,
            17,
            "never matches",
        ),
    ],
)
def test_a_status_outside_its_range_is_reported(rule, level, column, consequence, folder):
    finding = only(found(folder, rule), "is not among the values of")
    assert (finding.level, finding.column) == (level, column)
    assert finding.message.endswith(consequence)
    assert finding.remedy == "did you mean IN_ERROR_NFR?"


def test_what_a_rule_concludes_that_nobody_declared_is_a_warning(folder):
    rule = 'A: Role(?q) -> <http://x.org/#p>(?q, "x")'
    finding = only(found(folder, rule), "p is not defined")
    assert (finding.level, finding.column) == (Level.WARN, 16)
    assert finding.remedy == DECLARE.format("data")


def test_a_variable_that_is_not_declared_is_a_warning_where_pellet_takes_it_for_one(folder):
    undeclared = OWL_RULE.replace(
        '<swrl:Variable xmlns:swrl="{SWRL}" rdf:about="urn:swrl:var#y"/>'.replace("{SWRL}", SWRL),
        "",
    )
    value = (
        undeclared.replace("IndividualPropertyAtom", "DatavaluedPropertyAtom")
        .replace("Roel", "Role")
        .replace("var#z", "var#x")
    )
    finding = only(found(folder, extra=value), "?y is not declared as a variable")
    assert (finding.level, finding.rule) == (Level.WARN, "mine")


def test_a_rule_that_another_file_switches_off_is_reported(folder):
    same = 'S1a: FunctionGrounding(?fg) ^ fg_status(?fg, "IN_ERROR_COMPONENT") ^ solvesO(?fg, ?o)'
    text = f'disabled {same} -> o_status(?o, "IN_ERROR_COMPONENT")'
    finding = only(found(folder, text), "replaces the rule of this name in")
    assert (finding.level, finding.rule) == (Level.WARN, "S1a")


def test_a_component_status_that_is_no_text_is_not_taken_for_a_misspelt_one(folder):
    rules = "A: c_status(?c, ?s) ^ equal(?s, false) -> Role(?c)"
    findings = found(folder, rules, reported=REPORTED_STATUSES)
    assert not [one for one in findings if "reports c_status" in one.message]


@pytest.mark.parametrize(
    ("rule", "column"),
    [
        ('A: hasValue(?q, ?v) ^ lessThan(?v, "3") -> Role(?q)', 36),
        ('A: c_status(?c, "FALSE") ^ greaterThan("x", 2) -> Role(?c)', 40),
        ("A: hasValue(?q, ?v) ^ equal(true, ?v) -> Role(?q)", 29),
    ],
)
def test_a_number_that_is_compared_with_a_text_is_reported(folder, rule, column):
    finding = only(found(folder, rule), "never compares with")
    assert (finding.level, finding.column) == (Level.WARN, column)


def test_a_pattern_that_java_does_not_take_is_reported(folder):
    rules = 'A: c_status(?c, ?s) ^ matches(?s, "[F") -> Role(?c)\nB: c_status(?c, ?s) ^ matches(?s, "\\\\p{Lu}+") -> Role(?c)\n'
    finding = only(found_by_pellet(folder, rules), "is not a pattern")
    assert (finding.level, finding.rule, finding.column) == (Level.WARN, "A", 35)


def test_an_ill_formed_literal_in_a_class_expression_is_an_error(folder):
    expression = f"""<owl:Class rdf:about="{SUAVE}Deep"><owl:equivalentClass><owl:Restriction>
    <owl:onProperty rdf:resource="{TOMASYS}hasValue"/>
    <owl:hasValue rdf:datatype="http://www.w3.org/2001/XMLSchema#decimal">1,5</owl:hasValue></owl:Restriction>
    </owl:equivalentClass></owl:Class>"""
    error = only(found(folder, extra=expression), "'1,5', which is not an xsd:decimal")
    assert error.level is Level.ERROR


def test_a_rule_that_asks_for_the_same_with_nothing_but_names_is_reported(folder):
    """isQAtype is a functional object property, by which types can become the same: so not here."""
    rule = "A: Component(?c) ^ sameAs(?c, ?d) -> Role(?d)"
    assert not [one for one in found(folder, rule) if "sameAs" in one.message]
