"""Whether a model is well-formed TOMASys, by SHACL shapes: the shipped ones, and those that users add."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from rdflib import Graph, Namespace, URIRef
from rdflib.plugins.parsers.notation3 import BadSyntax
from rdflib.term import Node

from suave_des.errors import InputError
from suave_des.knowledge.ontology_file import OntologyFile, without_log
from suave_des.knowledge.vocabulary import local_name
from suave_des.resources import shipped_folder
from suave_des.workbench.findings import Finding, Level, shown_path

_SH: Final = Namespace("http://www.w3.org/ns/shacl#")
_REASON: Final = re.compile(r"Bad syntax \((.*?)\) at \^ in:", re.DOTALL)
_LEVELS: Final = {_SH.Violation: Level.ERROR, _SH.Warning: Level.WARN, _SH.Info: Level.INFO}


def check_shapes(sources: Sequence[OntologyFile], more: Sequence[Path]) -> Iterator[Finding]:
    """What the shapes find, with the file and line of the individual.

    Raises:
        InputError: a file of shapes cannot be read.
    """
    from pyshacl import validate

    shapes = Graph()
    for path in (shipped_folder("ontology") / "tomasys-shapes.ttl", *more):
        shapes += _read(path)
    data = Graph()
    for source in sources:
        data += source.graph
    try:
        _, report, _ = validate(data, shacl_graph=shapes, do_owl_imports=False, meta_shacl=False, inplace=False)
    except Exception as error:  # a shape that is no shape: each kind of it raises another error
        reason = " ".join(str(error).split())
        raise InputError(f"the shapes cannot be used: {reason}", file=", ".join(map(str, more)) or None) from error
    assert isinstance(report, Graph)
    for result in report.subjects(URIRef(f"{_SH}resultSeverity"), None):
        yield _finding(report, result, sources)


def _read(path: Path) -> Graph:
    graph = Graph()
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(
            f"cannot be read: {error.strerror}", file=path, remedy="give SHACL shapes in Turtle"
        ) from error
    try:
        if content.lstrip().startswith((b"<?xml", b"<rdf:RDF")):
            raise InputError("this is XML, not Turtle", file=path, remedy="give SHACL shapes in Turtle")
        with without_log():
            graph.parse(data=content, format="turtle")
    except InputError:
        raise
    except BadSyntax as error:
        reason = _REASON.search(str(error))
        raise InputError(
            f"is no Turtle: {reason.group(1) if reason else 'bad syntax'}",
            file=path,
            place=f"line {error.lines + 1}",
            remedy="give SHACL shapes in Turtle",
        ) from error
    except UnicodeDecodeError as error:
        raise InputError("is not UTF-8 text", file=path, remedy="save it as UTF-8") from error
    except Exception as error:  # of what is cut off, the parser says so in many ways
        said = "it ends too early" if isinstance(error, IndexError) else " ".join(str(error).split())[:200]
        raise InputError(f"is no Turtle: {said}", file=path, remedy="give SHACL shapes in Turtle") from error
    return graph


def _finding(report: Graph, result: Node, sources: Sequence[OntologyFile]) -> Finding:
    def value(name: str) -> str:
        return str(report.value(result, URIRef(_SH + name)) or "")

    severity = report.value(result, URIRef(_SH + "resultSeverity"))
    name = local_name(value("focusNode"))
    path = local_name(value("resultPath")) if value("resultPath") else ""
    found = [(source, source.line_of(name)) for source in sources]
    focus = report.value(result, URIRef(_SH + "focusNode"))
    mentions = next((source for source in sources if focus in source.graph.all_nodes()), None)
    source, line = next(((one, place) for one, place in found if place), (mentions, None))
    said = value("resultMessage")
    return Finding(
        _LEVELS.get(URIRef(str(severity)), Level.ERROR),
        ": ".join(filter(None, (name, path, said))),
        shown_path(source.path) if source else None,
        int(line.removeprefix("line ")) if line else None,
    )
