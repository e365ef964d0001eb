"""Check the shape of the model in the ontologies (SHACL)."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

from rdflib import RDF, Graph, Literal, Namespace, URIRef
from rdflib.plugins.parsers.notation3 import BadSyntax
from rdflib.term import Node

from suave_des.errors import InputError
from suave_des.files import decode, read_bytes
from suave_des.knowledge.checks.findings import Finding, Level, finding_about
from suave_des.knowledge.ontology_file import OntologyFile, without_log
from suave_des.knowledge.rdf import QA_OPERATOR, local_name
from suave_des.resources import shipped_folder

_SH: Final = Namespace("http://www.w3.org/ns/shacl#")
_REASON: Final = re.compile(r"Bad syntax \((.*?)\) at \^ in:", re.DOTALL)
_LEVELS: Final = {_SH.Violation: Level.ERROR, _SH.Warning: Level.WARN, _SH.Info: Level.INFO}
_TURTLE: Final = "give SHACL shapes in Turtle"
_SHAPES_LIMIT_BYTES: Final = 8 * 2**20


def check_shapes(
    sources: Sequence[OntologyFile], more: Sequence[Path], assumed: Mapping[str, str]
) -> Iterator[Finding]:
    """Check the model against SHACL shapes, the shipped ones and more.

    Args:
        sources: the ontologies.
        more: files of shapes.
        assumed: qa_comparison_operator by the IRI of a quality attribute type, besides what the ontologies say.

    Raises:
        InputError: a file of shapes cannot be read.
    """
    from pyshacl import validate

    shapes = Graph()
    for path in (shipped_folder("ontology") / "tomasys-shapes.ttl", *more):
        shapes += _read_shapes(path)
    data = Graph()
    for source in sources:
        data += source.graph
    for attribute, sign in assumed.items():
        data.add((URIRef(attribute), URIRef(QA_OPERATOR), Literal(sign)))
    try:
        _, report, _ = validate(data, shacl_graph=shapes, do_owl_imports=False, meta_shacl=False, inplace=False)
    except Exception as error:  # each kind of malformed shape raises another error
        reason = " ".join(str(error).split())
        raise InputError(f"the shapes cannot be used: {reason}", file=", ".join(map(str, more)) or None) from error
    assert isinstance(report, Graph)
    for result in report.subjects(_SH.resultSeverity, None):
        if not _is_placeholder(report.value(result, _SH.focusNode), data):
            yield _shape_finding(report, result, sources)


def _is_placeholder(node: Node | None, data: Graph) -> bool:
    """Whether an individual has nothing but a class, and nothing refers to it, so that it has no effect."""
    is_mentioned = any(predicate != RDF.type for predicate in data.predicates(node, None))
    return isinstance(node, URIRef) and not is_mentioned and (None, None, node) not in data


def _read_shapes(path: Path) -> Graph:
    text = decode(path, read_bytes(path, _SHAPES_LIMIT_BYTES))
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


def _shape_finding(report: Graph, result: Node, sources: Sequence[OntologyFile]) -> Finding:
    def value(name: str) -> str:
        return str(report.value(result, _SH[name]) or "")

    name, path = local_name(value("focusNode")), local_name(value("resultPath"))
    level = _LEVELS.get(URIRef(value("resultSeverity")), Level.ERROR)
    focus = report.value(result, _SH.focusNode)
    described = [source for source in sources if source.line_of(name)]
    mentioning = [source for source in sources if focus in source.graph.all_nodes()]
    message = ": ".join(filter(None, (name, path, value("resultMessage"))))
    return finding_about(name, described or mentioning or sources, level, message)
