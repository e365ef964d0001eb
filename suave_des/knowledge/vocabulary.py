"""IRIs of the vocabularies: TOMASys, its terms for robots (mros), SUAVE's model, OWL and SWRL.

Source: the exemplar's three ontologies (repository kas-lab/suave), whose names and namespaces are kept so
that either side's files work with the other's.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import Final

TOMASYS: Final = "http://metacontrol.org/tomasys#"
MROS: Final = "http://ros/mros#"
SUAVE: Final = "http://www.metacontrol.org/suave#"

RDF: Final = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
RDFS: Final = "http://www.w3.org/2000/01/rdf-schema#"
OWL: Final = "http://www.w3.org/2002/07/owl#"
XSD: Final = "http://www.w3.org/2001/XMLSchema#"
SWRL: Final = "http://www.w3.org/2003/11/swrl#"
SWRLB: Final = "http://www.w3.org/2003/11/swrlb#"
SWRLA: Final = "http://swrl.stanford.edu/ontologies/3.3/swrla.owl#"

#: Namespaces of OWL, RDF and SWRL: their terms describe no fact of the system.
LANGUAGE_NAMESPACES: Final = (RDF, RDFS, OWL, XSD, SWRL, SWRLB, SWRLA)

RDF_TYPE: Final = RDF + "type"
HAS_VALUE: Final = TOMASYS + "hasValue"

#: What the planner and the loop read, whether or not a rule can conclude it.
DECISION_PROPERTIES: Final = tuple(
    TOMASYS + name
    for name in (
        "fd_error_log",
        "fd_realisability",
        "fg_status",
        "hasNFR",
        "hasQAestimation",
        "hasQAvalue",
        "hasValue",
        "isQAtype",
        "o_always_improve",
        "o_status",
        "o_updatable",
        "qa_comparison_operator",
        "solvesF",
        "solvesO",
        "typeF",
        "typeFD",
    )
)

#: The quality attribute that the planner maximises.
PERFORMANCE: Final = MROS + "performance"


def local_name(iri: str) -> str:
    """Last part of an IRI: after '#', or after the last '/' or ':' where there is none."""
    for separator in ("#", "/", ":"):
        head, found, tail = iri.rpartition(separator)
        if found and tail:
            return tail
        if found:
            iri = head
    return iri


def namespace(iri: str) -> str:
    """The part of an IRI before the local name, with the separator."""
    return iri[: len(iri) - len(local_name(iri))]


def _swap_prefix(name: str, old: str, new: str) -> str:
    return new + (name.removeprefix(old) if name.startswith(old) else name)


def objective_name(function: str) -> str:
    """Name of the objective of a function: o_generate_search_path for f_generate_search_path."""
    return _swap_prefix(function, "f_", "o_")


def grounding_name(design: str) -> str:
    """Name of the grounding of a function design: fg_spiral_high for fd_spiral_high."""
    return _swap_prefix(design, "fd_", "fg_")


def measurement_name(attribute: str) -> str:
    """Name of the measured value of a quality attribute type: obs_water_visibility for water_visibility."""
    return f"obs_{attribute}"


def nearest(word: str, known: Iterable[str]) -> str | None:
    """Suggest the known name most similar to a word, as a question; None when none is similar."""
    found = difflib.get_close_matches(word, sorted(known), n=1, cutoff=0.6)
    return f"did you mean {found[0]}?" if found else None
