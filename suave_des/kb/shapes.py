"""Check the shape of the model in the ontologies (SHACL)."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Final

from rdflib import RDF, Graph, Literal, Namespace, URIRef
from rdflib.plugins.parsers.notation3 import BadSyntax
from rdflib.term import Node

from suave_des.caches import private_cache, read_checked, remove_oldest, with_checksum
from suave_des.errors import InputError
from suave_des.files import decode, read_bytes
from suave_des.findings import Finding, Level
from suave_des.knowledge.ontology_file import OntologyFile, place_of
from suave_des.knowledge.rdf import HAS_VALUE, local_name, without_log
from suave_des.knowledge.state import measurement_name
from suave_des.resources import shipped_folder

_SH: Final = Namespace("http://www.w3.org/ns/shacl#")
_REASON: Final = re.compile(r"Bad syntax \((.*?)\) at \^ in:", re.DOTALL)
_LEVELS: Final = {_SH.Violation: Level.ERROR, _SH.Warning: Level.WARN, _SH.Info: Level.INFO}
_TURTLE: Final = "give SHACL shapes in Turtle"
_SHAPES_LIMIT_BYTES: Final = 8 * 2**20


def check_shapes(sources: Sequence[OntologyFile], more: Sequence[Path] = ()) -> list[Finding]:
    """Check the model against SHACL shapes, the shipped ones and more; the same files are checked once, then cached.

    Args:
        sources: the ontologies.
        more: files of shapes.

    Raises:
        InputError: a file of shapes cannot be read.
    """
    files = (shipped_folder("ontology") / "tomasys-shapes.ttl", *more)
    texts = [decode(path, read_bytes(path, _SHAPES_LIMIT_BYTES)) for path in files]
    total = hashlib.sha256(f"{version('pyshacl')}{Path(__file__).read_bytes()!r}{texts}".encode())
    for source in sources:
        total.update(str(source.path).encode() + hashlib.sha256(source.content).digest())
    folder = private_cache("findings")
    path = None if folder is None else folder / total.hexdigest()
    if path is not None and (content := read_checked(path)) is not None:
        return [Finding(**each | {"level": Level(each["level"])}) for each in json.loads(content)]
    shapes = Graph()
    for file, text in zip(files, texts, strict=True):
        shapes += _read_shapes(file, text)
    found = list(_validate(sources, shapes, more))
    if path is not None:
        path.write_bytes(with_checksum(json.dumps([asdict(each) for each in found]).encode()))
        remove_oldest(path.parent, "*")
    return found


def _validate(sources: Sequence[OntologyFile], shapes: Graph, files: Sequence[Path]) -> Iterator[Finding]:
    from pyshacl import validate

    data = Graph()
    for source in sources:
        data += source.graph
    try:
        _, report, _ = validate(data, shacl_graph=shapes, do_owl_imports=False, meta_shacl=False, inplace=False)
        if not isinstance(report, Graph):
            raise ValueError(getattr(report, "message", report))
    except Exception as error:  # each kind of malformed shape raises another error
        reason = " ".join(str(error).split())
        raise InputError(f"the shapes cannot be used: {reason}", file=", ".join(map(str, files)) or None) from error
    for result in report.subjects(_SH.resultSeverity, None):
        # A query (SPARQL) is about the value that it gives, other constraints are about their focus.
        is_query = report.value(result, _SH.sourceConstraintComponent) == _SH.SPARQLConstraintComponent
        thing = (report.value(result, _SH.value) if is_query else None) or report.value(result, _SH.focusNode)
        if is_query or not _is_placeholder(thing, data):
            yield _finding(report, result, thing, sources)


def _is_placeholder(node: Node | None, data: Graph) -> bool:
    """Whether an individual has nothing but a class, and nothing refers to it, so that it has no effect."""
    is_mentioned = any(predicate != RDF.type for predicate in data.predicates(node, None))
    return isinstance(node, URIRef) and not is_mentioned and (None, None, node) not in data


def _read_shapes(path: Path, text: str) -> Graph:
    if text.lstrip().startswith(("<?xml", "<rdf:RDF")):
        raise InputError("this is XML, not Turtle", file=path, remedy=_TURTLE)
    place = None
    try:
        with without_log():
            return Graph().parse(data=text, format="turtle")
    except BadSyntax as error:
        found = _REASON.search(str(error))
        reason, place = found.group(1) if found else "bad syntax", f"line {error.lines + 1}"
    except Exception as error:  # the parser meets the end of a truncated file in many ways
        reason = "it ends too early" if isinstance(error, IndexError) else " ".join(str(error).split())[:200]
    raise InputError(f"is not Turtle: {reason}", file=path, place=place, remedy=_TURTLE)


def _finding(report: Graph, result: Node, thing: Node | None, sources: Sequence[OntologyFile]) -> Finding:
    name, path = local_name(str(thing)), report.value(result, _SH.resultPath)
    level = _LEVELS.get(URIRef(str(report.value(result, _SH.resultSeverity))), Level.ERROR)
    words = [name, local_name(str(path or "")), str(report.value(result, _SH.resultMessage) or "")]
    value = report.value(result, _SH.value)
    if isinstance(value, Literal):
        datatype = local_name(str(value.datatype)) if value.datatype else "text"
        words[-1] += f", and {str(value)!r} is of datatype {datatype}"
    message = ": ".join(filter(None, words))
    has_value = any((thing, URIRef(HAS_VALUE), None) in source.graph for source in sources)
    if path == URIRef(HAS_VALUE) and name.startswith(measurement_name("")) and not has_value:
        level, message = Level.INFO, f"{name} has no hasValue: missions give it the measured one"
    described = [source for source in sources if source.line_of(name)]
    mentioning = [source for source in sources if thing in source.graph.all_nodes()]
    file, line = place_of(name, described or mentioning or sources)
    return Finding(level, message, str(file), line)
