"""The three ontology files as the exemplar's users have them, made from the shipped ones.

The oldest rules speak of INTERNAL_ERROR, and a recovered component gives its objectives the status
UPDATABLE.
"""

from __future__ import annotations

import re
from pathlib import Path

from rdflib import Graph, Literal, URIRef
from rdflib.namespace import OWL, RDF, RDFS, XSD

from suave_des.resources import shipped_folder

MROS_IMPORT = "https://raw.githubusercontent.com/meta-control/mros_ontology/main/owl/mros.owl"
TOMASYS_IMPORT = "http://raw.githubusercontent.com/meta-control/mc_mdl_tomasys/ros2/owl/tomasys.owl"
SWRL = "http://www.w3.org/2003/11/swrl#"
TOMASYS = "http://metacontrol.org/tomasys#"
OLDEST_STATUS = {"IN_ERROR_NFR": "INTERNAL_ERROR", "IN_ERROR_COMPONENT": "INTERNAL_ERROR"}


def _oldest_forms(graph: Graph) -> None:
    """o_status UPDATABLE instead of o_updatable, INTERNAL_ERROR instead of the IN_ERROR
    statuses.
    """
    for subject, predicate, value in list(graph):
        if isinstance(value, Literal) and str(value) in OLDEST_STATUS:
            graph.remove((subject, predicate, value))
            graph.add((subject, predicate, Literal(OLDEST_STATUS[str(value)])))
    for atom in list(
        graph.subjects(URIRef(SWRL + "propertyPredicate"), URIRef(TOMASYS + "o_updatable"))
    ):
        graph.set((atom, URIRef(SWRL + "propertyPredicate"), URIRef(TOMASYS + "o_status")))
        graph.set((atom, URIRef(SWRL + "argument2"), Literal("UPDATABLE")))


def write_exemplar_files(shipped: Path, folder: Path, *, oldest: bool = False) -> dict[str, Path]:
    """Write the three files; returns them by stem."""
    files = {
        name: Graph().parse(shipped / f"{name}.owl", format="xml")
        for name in ("tomasys", "mros", "suave")
    }
    for ontology, iri, imports in (
        (files["tomasys"], "http://metacontrol.org/tomasys", []),
        (files["mros"], "http://ros/mros", [TOMASYS_IMPORT]),
        (files["suave"], "http://www.metacontrol.org/suave", [TOMASYS_IMPORT, MROS_IMPORT]),
    ):
        ontology.remove((None, OWL.imports, None))
        ontology.add((URIRef(iri), RDF.type, OWL.Ontology))
        for imported in imports:
            ontology.add((URIRef(iri), OWL.imports, URIRef(imported)))
        if oldest:
            _oldest_forms(ontology)
    folder.mkdir(parents=True, exist_ok=True)
    for name, graph in files.items():
        graph.serialize(folder / f"{name}.owl", format="xml")
    return {name: folder / f"{name}.owl" for name in files}


def write_files_of_2023(shipped: Path, folder: Path) -> dict[str, Path]:
    """Write the three files in their oldest form, without the properties that TOMASys got later;
    returns them by stem.

    Statuses are any text there, so that rules that ask for a status of false never match.
    """
    files = write_exemplar_files(shipped, folder, oldest=True)
    for path in files.values():
        graph = Graph().parse(path, format="xml")
        for name in ("o_always_improve", "o_updatable", "qa_comparison_operator"):
            for pattern in (
                (URIRef(TOMASYS + name), None, None),
                (None, URIRef(TOMASYS + name), None),
            ):
                graph.remove(pattern)
        for name in ("b_status", "c_status", "fg_status", "o_status"):
            if (URIRef(TOMASYS + name), RDF.type, None) in graph:
                graph.set((URIRef(TOMASYS + name), RDFS.range, XSD.string))
        graph.serialize(path, format="xml")
    return files


def write_as_owlready2_saves_it(path: Path, placeholder: str = "") -> Path:
    """Write suave.owl as the files of 2023 are: no comparison operators, "xsd:string" for the
    datatype, a placeholder.

    Args:
        path: of the file.
        placeholder: a class of TOMASys, of which there is an individual that says nothing.
    """
    text = (shipped_folder("ontology") / "suave.owl").read_text(encoding="utf-8")
    text = re.sub(r"<tomasys:qa_comparison_operator.*?</tomasys:qa_comparison_operator>", "", text)
    text = text.replace("http://www.w3.org/2001/XMLSchema#", "xsd:")
    text = text.replace('xmlns:xsd="xsd:"', 'xmlns:xsd="http://www.w3.org/2001/XMLSchema#"')
    assert 'rdf:datatype="xsd:' in text
    extra = (
        '<owl:NamedIndividual rdf:about="http://www.metacontrol.org/suave#placeholder">'
        f'<rdf:type rdf:resource="{TOMASYS}{placeholder}"/></owl:NamedIndividual>'
    )
    path.write_text(
        text.replace("</rdf:RDF>", f"{extra if placeholder else ''}</rdf:RDF>"), encoding="utf-8"
    )
    return path
