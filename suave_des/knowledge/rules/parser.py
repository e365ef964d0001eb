"""Parse SWRL rules from text in the usual human-readable syntax.

    # a comment, to the end of the line
    prefix my: <http://example.org/my#>

    LowBattery: FunctionGrounding(?fg) ^ hasQAvalue(?fg, ?q) ^ isQAtype(?q, battery_level)
        ^ hasValue(?q, ?v) ^ lessThan(?v, 0.25) -> fg_status(?fg, "IN_ERROR_NFR")

    disabled "a name with spaces": Component(?c) -> my:seen(?c, true)

A rule ends where its head does. Atoms are joined by ^ or a comma. Names are bare where that is
unambiguous, else prefixed or in angle brackets; names of rules that are not a single word are
quoted.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from suave_des.errors import nearest, shown
from suave_des.knowledge.rdf import (
    BOOLEAN,
    DECIMAL,
    PREFIXES,
    STRING,
    XSD,
    Lit,
    is_well_formed,
    local_name,
)
from suave_des.knowledge.rules import Atom, Named, Place, Rule, RuleError, Term, Variable

if TYPE_CHECKING:
    from lark import Lark, Token

MAX_DIGITS = 400
_WORD = r"[^\W\d][\w.-]*(?<![.-])"
#: What stands for the terminals of which the first is expected, and what would be right; the first
# that fits counts.
_EXPECTED = (
    ("VARIABLE", 'an argument, such as ?o, 2.5, "text", true or an individual,', None),
    ("PREFIXED", "an atom, such as Objective(?o),", None),
    ("DISABLED", "a rule's name", 'write name: body -> head, or "a name": body -> head'),
    ("NAME", "a prefix", "write prefix my: <http://example.org/my#>"),
    ("IRI", "an IRI in angle brackets", "write prefix my: <http://example.org/my#>"),
    ("_ARROW", "^ or ->", "a rule is name: body -> head"),
    ("_RPAR", ", or )", "parentheses must balance"),
    ("_LPAR", "(", None),
    ("_COLON", ":", "a rule is name: body -> head"),
)
#: What SWRL does not have, and what to do without it.
_LACKING = (
    (re.compile(r"\|\|?|∨|(?i:or)\b"), "'or'", "write a rule for each case"),
    (re.compile(r"[¬!~]|(?i:not)\b"), "negation", "say what holds instead"),
)
_HEADER = re.compile(rf'^(?:disabled\s+)?(?:{_WORD}|"[^"\n]*")\s*:(?![:/])|^prefix\s', re.MULTILINE)
_ESCAPE = re.compile(r"\\(?:u([0-9A-Fa-f]{4})|U([0-9A-Fa-f]{8})|(.))", re.DOTALL)
_ESCAPED = {"n": "\n", "t": "\t", "r": "\r", '"': '"', "\\": "\\"}
#: What no text may contain: control characters, and halves of surrogate pairs, which no file can
# encode.
_FORBIDDEN = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\ud800-\udfff\ufffe\uffff]")
#: A word between atoms where a name was read.
_JOINING = re.compile(r"(?<!\S)(?i:and|or|not)\s*\Z")
_FOUND = re.compile(r"=>|\??[^\s\"<>(),^?]+|.", re.DOTALL)
_BLANK = re.compile(r"(?:\s|#[^\n]*)*")
_lock = threading.Lock()


def parse_rules(
    text: str, file: Path | None = None
) -> tuple[tuple[Rule, ...], tuple[RuleError, ...]]:
    """Parse all rules of a text; after an error, parsing continues with the next rule that begins a
    line.

    Returns:
        the rules, in which names are not looked up yet, and an error for each that could not be
        read.
    """
    from lark import TextSlice, UnexpectedInput

    errors: list[RuleError] = []
    with _lock:  # one parser, whose builder collects the rules
        parser, builder = _parser()
        builder.begin(file)
        start: int | None = 0
        while start is not None:
            try:
                parser.parse(TextSlice(text, start, len(text)))
                break
            except RuleError as error:
                errors.append(error)
                at = builder.failed_at
            except UnexpectedInput as error:
                # which knows what is possible after all that was read
                state: Any = error.interactive_parser
                token = getattr(error, "token", None)
                at = len(text)
                if token is None or token.type != "$END":
                    blank = _BLANK.match(text, error.pos_in_stream or 0)
                    at = blank.end()  # type: ignore[union-attr]
                errors.append(_error(text, at, state.accepts(), file))
            line_end = text.find("\n", at)
            header = _HEADER.search(text, line_end + 1) if line_end >= 0 else None
            start = header.start() if header else None
        return tuple(builder.rules), tuple(errors)


def parse_rule(text: str, file: Path | None = None) -> Rule:
    """Parse one rule, as it is given on a command line.

    Raises:
        RuleError: there is none, there are several, or it cannot be read.
    """
    rules, errors = parse_rules(text, file)
    if errors:
        raise errors[0]
    if len(rules) != 1:
        raise RuleError(
            f"{len(rules)} rules instead of one", file=file, remedy='write "name: body -> head"'
        )
    return rules[0]


@lru_cache(maxsize=1)
def _parser() -> tuple[Lark, _Builder]:
    from lark import Lark

    builder = _Builder()
    return Lark.open(
        "grammar.lark", rel_to=__file__, parser="lalr", lexer="contextual", transformer=builder
    ), builder


def _error(text: str, at: int, accepted: set[str], file: Path | None) -> RuleError:
    """Describe the token that was found, and those that were expected."""
    word = _JOINING.search(text, 0, at)
    if word and accepted <= {"_COLON", "_LPAR"}:
        at = word.start()  # it was taken for the name of a rule or of a predicate
        accepted = {"_ARROW"} if "_COLON" in accepted else {"PREFIXED"}
    problem, remedy = _problem(text, at, accepted)
    place = str(Place(text.count("\n", 0, at) + 1, at - text.rfind("\n", 0, at)))
    return RuleError(problem, file=file, place=place, remedy=remedy)


def _problem(text: str, at: int, accepted: set[str]) -> tuple[str, str | None]:
    """What is wrong at a place of a text, and what would be right."""
    for word, lacking, remedy in _LACKING:
        if word.match(text, at):
            return f"SWRL has no {lacking}", remedy
    if text.startswith('"', at) and "STRING" in accepted:
        return "this text has no closing quote on its line", None
    expected, right = next((words, right) for name, words, right in _EXPECTED if name in accepted)
    found = _FOUND.match(text, at)
    instead = f"instead of {shown(found.group(), 32)}" if found else "but the text ends here"
    return f"expected {expected} {instead}", right


class _Builder:
    """Builds rules while lark parses: each method gets the parts of what it is named after in the
    grammar.
    """

    def begin(self, file: Path | None) -> None:
        self.rules: list[Rule] = []
        self.failed_at = 0
        self._file = file
        self._prefixes = dict(PREFIXES)

    def prefix(self, parts: Sequence[Token]) -> None:
        self._prefixes[parts[1]] = self._iri(parts[2], "a prefix needs an IRI in angle brackets")

    def rule(self, parts: Sequence[Any]) -> None:
        disabled, (place, name), body, head = parts  # no body: a rule that always holds
        begins = self._place(disabled) if disabled else place
        self.rules.append(
            Rule(name, body or (), head, not disabled, self._file or Path(), begins.line)
        )

    def rule_name(self, parts: Sequence[Token]) -> tuple[Place, str]:
        """A word, or a text that is not blank."""
        (token,) = parts
        name = self._text(token) if token.type == "STRING" else str(token)
        if not name.strip():
            raise self._wrong(token, "a rule's name is blank", 'write "a name": body -> head')
        return self._place(token), name

    def atoms(self, parts: Sequence[Atom]) -> tuple[Atom, ...]:
        """One side of a rule."""
        return tuple(parts)

    def atom(self, parts: Sequence[Any]) -> Atom:
        (place, predicate), *terms = parts
        return Atom(
            "", predicate, tuple(term for _, term in terms), (place, *(where for where, _ in terms))
        )

    def name(self, parts: Sequence[Token]) -> tuple[Place, str]:
        """A bare name as it is, a prefixed name or one in angle brackets as IRI."""
        (token,) = parts
        if token.type == "NAME":
            return self._place(token), str(token)
        if token.type == "IRI":
            return self._place(token), self._iri(token, f"{token} is not an absolute IRI")
        prefix, _, local = token.partition(":")
        if prefix not in self._prefixes:
            remedy = nearest(prefix, self._prefixes) or f"declare it: prefix {prefix}: <...>"
            raise self._wrong(token, f"unknown prefix {prefix}:", remedy)
        return self._place(token), self._prefixes[prefix] + local

    def term(self, parts: Sequence[Any]) -> tuple[Place, Term]:
        """A variable, a literal, or an individual."""
        first = parts[0]
        if isinstance(first, tuple):
            place, name = first
            return place, Lit(name, BOOLEAN) if name in ("true", "false") else Named(name)
        is_variable = first.type == "VARIABLE"
        term = Variable(first[1:]) if is_variable else self._literal(first, parts[1:])
        return self._place(first), term

    def _literal(self, token: Token, more: Sequence[Any]) -> Lit:
        if token.type == "NUMBER":
            if len(token) > MAX_DIGITS:
                raise self._wrong(token, "a number of too many digits", f"at most {MAX_DIGITS}")
            if "e" in token.lower():
                kind = XSD + "double"
            elif "." in token:
                kind = DECIMAL
            else:
                kind = XSD + "integer"
            return Lit(str(token), kind)
        text = self._text(token)
        if not more:
            return Lit(text, STRING)
        if not isinstance(more[0], tuple):
            return Lit(text, str(more[0]))
        datatype = more[0][1]
        if ":" not in datatype:
            raise self._wrong(
                token, f"datatype {datatype} without a prefix", f"write xsd:{datatype}"
            )
        literal = Lit(text, datatype)
        if not is_well_formed(literal):
            raise self._wrong(token, f"{text!r} is not an xsd:{local_name(datatype)}")
        return literal

    def _place(self, token: Token) -> Place:
        return Place(token.line or 0, token.column or 0)

    def _wrong(self, token: Token, problem: str, remedy: str | None = None) -> RuleError:
        self.failed_at = token.start_pos or 0
        return RuleError(problem, file=self._file, place=str(self._place(token)), remedy=remedy)

    def _iri(self, token: Token, problem: str) -> str:
        if ":" not in token:
            raise self._wrong(token, problem)
        return self._clean(token[1:-1], token)

    def _text(self, token: Token) -> str:
        def unescape(escape: re.Match[str]) -> str:
            short, long, single = escape.groups()
            if single is None:
                code = int(short or long, 16)
                return chr(code) if code <= 0x10FFFF else "\ud800"
            if single not in _ESCAPED:
                raise self._wrong(
                    token, f"unknown escape \\{single}", r"one of \" \\ \n \t \r \uXXXX"
                )
            return _ESCAPED[single]

        return self._clean(_ESCAPE.sub(unescape, token[1:-1]), token)

    def _clean(self, text: str, token: Token) -> str:
        if _FORBIDDEN.search(text):
            raise self._wrong(
                token, "a character that no file can hold", "leave out control characters"
            )
        return text
