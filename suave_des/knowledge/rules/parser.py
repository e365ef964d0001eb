"""Read SWRL rules from text in the usual human-readable syntax.

    # a comment, to the end of the line
    prefix my: <http://example.org/my#>

    LowBattery: FunctionGrounding(?fg) ^ hasQAvalue(?fg, ?q) ^ isQAtype(?q, battery_level)
        ^ hasValue(?q, ?v) ^ lessThan(?v, 0.25) -> fg_status(?fg, "IN_ERROR_NFR")

    disabled "a name with spaces": Component(?c) -> my:seen(?c, true)

A rule ends where its head does. Atoms are joined by ^ or a comma. Names are bare where that is unambiguous, else
prefixed or in angle brackets; names of rules that are no single word stand in quotes.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final

from suave_des.knowledge.rdf import Lit
from suave_des.knowledge.rules.syntax import Atom, Named, ParsedRule, Place, RuleError, Term, Variable
from suave_des.knowledge.vocabulary import MROS, OWL, RDF, RDFS, SUAVE, SWRL, SWRLA, SWRLB, TOMASYS, XSD, nearest

#: Prefixes that need not be declared.
PREFIXES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "mros": MROS,
        "owl": OWL,
        "rdf": RDF,
        "rdfs": RDFS,
        "suave": SUAVE,
        "swrl": SWRL,
        "swrla": SWRLA,
        "swrlb": SWRLB,
        "tomasys": TOMASYS,
        "xsd": XSD,
    }
)
MAX_DIGITS: Final = 400
_WORD: Final = r"[^\W\d][\w.-]*(?<![.-])"
_SPACE: Final = re.compile(r"(?:\s|#[^\n]*)*")
_NAME: Final = re.compile(_WORD)
_PREFIXED: Final = re.compile(rf"({_WORD})?:((?!\d)[\w.-]*(?<![.-]))")
_IRI: Final = re.compile(r"<([^<>\"{}|\\^`\s\x00-\x20]+)>")
_VARIABLE: Final = re.compile(r"\?([\w-]+)")
_NUMBER: Final = re.compile(r"[+-]?(?:[0-9]+(\.[0-9]*)?|(\.[0-9]+))([eE][+-]?[0-9]{1,4})?(?![\w.])")
_STRING: Final = re.compile(r'"((?:[^"\\\n]|\\.)*)"')
_LANGUAGE: Final = re.compile(r"@([A-Za-z]+(?:-[A-Za-z0-9]+)*)")
_ESCAPE: Final = re.compile(r"\\(?:u([0-9A-Fa-f]{4})|U([0-9A-Fa-f]{8})|(.))", re.DOTALL)
_ESCAPED: Final = {"n": "\n", "t": "\t", "r": "\r", '"': '"', "\\": "\\"}
_ARROW: Final = re.compile(r"->|→")
_AND: Final = re.compile(r"\^|∧|,")
_HEADER: Final = re.compile(rf'^(?:disabled\s+)?(?:{_WORD}|"[^"\n]*")\s*:(?![:/])|^prefix\s', re.MULTILINE)
#: What no text may contain: control characters, and halves of surrogate pairs, which no file can encode.
_FORBIDDEN: Final = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\ud800-\udfff\ufffe\uffff]")


@dataclass(frozen=True)
class ParsedRules:
    """The rules of a text, and what is wrong with those that could not be read."""

    rules: tuple[ParsedRule, ...]
    errors: tuple[RuleError, ...]


def parse_rules(text: str, file: Path | str | None = None) -> ParsedRules:
    """Read all rules of a text; after a mistake reading goes on with the next rule that begins a line."""
    rules: list[ParsedRule] = []
    errors: list[RuleError] = []
    parser = _Parser(text, file)
    while not parser.at_end():
        try:
            rule = parser.entry()
            if rule is not None:
                rules.append(rule)
        except RuleError as error:
            errors.append(error)
            parser.recover()
    return ParsedRules(tuple(rules), tuple(errors))


def parse_rule(text: str, file: Path | str | None = None) -> ParsedRule:
    """Read one rule, as it is given on a command line.

    Raises:
        RuleError: there is none, there are several, or it cannot be read.
    """
    parsed = parse_rules(text, file)
    if parsed.errors:
        raise parsed.errors[0]
    if len(parsed.rules) != 1:
        raise RuleError(f"{len(parsed.rules)} rules instead of one", file=file, remedy='write "name: body -> head"')
    return parsed.rules[0]


class _Parser:
    """Recursive descent over one text; the methods read what they are named after."""

    def __init__(self, text: str, file: Path | str | None) -> None:
        self._text = text
        self._file = file
        self._at = 0
        self._line = 1
        self._line_start = 0
        self._counted = 0
        self._prefixes = dict(PREFIXES)

    def place(self, at: int | None = None) -> Place:
        """Line and column of an offset that is not before the last one asked for."""
        position = self._at if at is None else at
        if position < self._counted:
            self._line, self._line_start, self._counted = 1, 0, 0
        breaks = self._text.count("\n", self._counted, position)
        if breaks:
            self._line += breaks
            self._line_start = self._text.rindex("\n", self._counted, position) + 1
        self._counted = position
        return Place(self._line, position - self._line_start + 1)

    def error(self, problem: str, remedy: str | None = None, at: int | None = None) -> RuleError:
        line, column = self.place(at)
        return RuleError(problem, file=self._file, place=f"line {line}, column {column}", remedy=remedy)

    def at_end(self) -> bool:
        self._skip()
        return self._at >= len(self._text)

    def recover(self) -> None:
        """Go on with the next line that looks like the beginning of a rule."""
        following = self._text.find("\n", self._at)
        found = _HEADER.search(self._text, following + 1) if following >= 0 else None
        self._at = found.start() if found else len(self._text)

    def entry(self) -> ParsedRule | None:
        """A rule, or a declaration of a prefix (which gives None)."""
        start = self._at
        word = _NAME.match(self._text, self._at)
        if word is not None and word.group() in ("prefix", "disabled"):
            self._at = word.end()
            self._skip()
            if not self._text.startswith(":", self._at):
                if word.group() == "prefix":
                    self._prefix()
                    return None
                return self._rule(self.place(start), enabled=False)
            self._at = start
        return self._rule(self.place(start), enabled=True)

    def _prefix(self) -> None:
        name = _NAME.match(self._text, self._at)
        if name is None:
            raise self.error("a prefix without a name", "write prefix my: <http://example.org/my#>")
        self._at = name.end()
        self._expect(":", "after the prefix")
        self._skip()
        iri = _IRI.match(self._text, self._at)
        if iri is None or ":" not in iri.group(1):
            raise self.error("a prefix needs an IRI in angle brackets", "write prefix my: <http://example.org/my#>")
        self._at = iri.end()
        self._prefixes[name.group()] = self._clean(iri.group(1), iri.start())

    def _rule(self, place: Place, *, enabled: bool) -> ParsedRule:
        name = self._rule_name()
        self._expect(":", f"after the rule's name {name}")
        self._skip()
        body = () if _ARROW.match(self._text, self._at) else self._atoms()
        self._skip()
        arrow = _ARROW.match(self._text, self._at)
        if arrow is None:
            raise self.error(f"expected ^ or -> {self._instead()}", "a rule is name: body -> head")
        self._at = arrow.end()
        return ParsedRule(name, body, self._atoms(), enabled, place)

    def _rule_name(self) -> str:
        word = _NAME.match(self._text, self._at)
        if word is not None:
            self._at = word.end()
            return word.group()
        if self._text.startswith('"', self._at):
            name = self._string()
            if name.strip():
                return name
        raise self.error(
            f"expected a rule's name {self._instead()}", 'write name: body -> head, or "a name": body -> head'
        )

    def _atoms(self) -> tuple[Atom, ...]:
        atoms = [self._atom()]
        while True:
            self._skip()
            joint = _AND.match(self._text, self._at)
            if joint is None:
                return tuple(atoms)
            self._at = joint.end()
            atoms.append(self._atom())

    def _atom(self) -> Atom:
        self._skip()
        places = [self.place()]
        predicate = self._name("an atom, such as Objective(?o)")
        self._expect("(", f"after {predicate}")
        arguments: list[Term] = []
        self._skip()
        if self._text.startswith(")", self._at):
            self._at += 1
            return Atom("", predicate, (), tuple(places))
        while True:
            self._skip()
            places.append(self.place())
            arguments.append(self._term())
            self._skip()
            if self._text.startswith(")", self._at):
                self._at += 1
                return Atom("", predicate, tuple(arguments), tuple(places))
            if not self._text.startswith(",", self._at):
                raise self.error(f"expected , or ) {self._instead()}", "parentheses must balance")
            self._at += 1

    def _name(self, wanted: str) -> str:
        """A bare name as it is, a prefixed name or one in angle brackets as IRI."""
        start = self._at
        iri = _IRI.match(self._text, start)
        if iri is not None:
            self._at = iri.end()
            if ":" not in iri.group(1):
                raise self.error(f"<{iri.group(1)}> is not an absolute IRI", at=start)
            return self._clean(iri.group(1), start)
        prefixed = _PREFIXED.match(self._text, start)
        if prefixed is not None and prefixed.group(2):
            prefix = prefixed.group(1) or ""
            if prefix not in self._prefixes:
                remedy = f"declare it: prefix {prefix}: <...>; known: {', '.join(sorted(self._prefixes))}"
                raise self.error(f"unknown prefix {prefix}:", nearest(prefix, self._prefixes) or remedy)
            self._at = prefixed.end()
            return self._prefixes[prefix] + prefixed.group(2)
        bare = _NAME.match(self._text, start)
        if bare is None:
            raise self.error(f"expected {wanted}, {self._instead()}")
        self._at = bare.end()
        return bare.group()

    def _term(self) -> Term:
        start = self._at
        variable = _VARIABLE.match(self._text, start)
        if variable is not None:
            self._at = variable.end()
            return Variable(variable.group(1))
        number = _NUMBER.match(self._text, start)
        if number is not None:
            self._at = number.end()
            if len(number.group()) > MAX_DIGITS:
                raise self.error("a number of too many digits", f"at most {MAX_DIGITS}", at=start)
            point, exponent = number.group(1) or number.group(2), number.group(3)
            return Lit(number.group(), XSD + ("double" if exponent else "decimal" if point else "integer"))
        if self._text.startswith('"', start):
            return self._literal()
        name = self._name('an argument, such as ?o, 2.5, "text", true or an individual')
        return Lit(name, XSD + "boolean") if name in ("true", "false") else Named(name)

    def _literal(self) -> Lit:
        text = self._string()
        if self._text.startswith("^^", self._at):
            self._at += 2
            start = self._at
            datatype = self._name("a datatype, such as xsd:decimal")
            if ":" not in datatype:
                raise self.error(f"datatype {datatype} without a prefix", f"write xsd:{datatype}", at=start)
            return Lit(text, datatype)
        language = _LANGUAGE.match(self._text, self._at)
        if language is not None:
            self._at = language.end()
            return Lit(text, f"@{language.group(1)}")
        return Lit(text, XSD + "string")

    def _string(self) -> str:
        start = self._at
        found = _STRING.match(self._text, start)
        if found is None:
            raise self.error("this text has no closing quote on its line")
        self._at = found.end()

        def unescape(escape: re.Match[str]) -> str:
            short, long, single = escape.groups()
            if single is None:
                code = int(short or long, 16)
                return chr(code) if code <= 0x10FFFF else "\ud800"
            if single not in _ESCAPED:
                raise self.error(f"unknown escape \\{single}", r"one of \" \\ \n \t \r \uXXXX", at=start)
            return _ESCAPED[single]

        return self._clean(_ESCAPE.sub(unescape, found.group(1)), start)

    def _clean(self, text: str, at: int) -> str:
        if _FORBIDDEN.search(text):
            raise self.error("a character that no file can hold", "leave out control characters", at=at)
        return text

    def _expect(self, mark: str, where: str) -> None:
        self._skip()
        if not self._text.startswith(mark, self._at):
            raise self.error(f"expected {mark} {where}, {self._instead()}")
        self._at += 1

    def _instead(self) -> str:
        found = re.compile(r"[^\s\"<>(),^?]+|.", re.DOTALL).match(self._text, self._at)
        if found is None:
            return "but the text ends here"
        shown = found.group() if len(found.group()) <= 30 else found.group()[:27] + "..."
        return f"instead of {shown if shown.isprintable() else ascii(shown)}"

    def _skip(self) -> None:
        found = _SPACE.match(self._text, self._at)
        if found is not None:
            self._at = found.end()
