"""The shipped ontologies hold the exemplar's vocabulary and model under its names, as Protégé
writes them.
"""

from decimal import Decimal
from pathlib import Path
from xml.etree import ElementTree

import pytest
from rdflib import Graph, URIRef
from rdflib.namespace import OWL, RDF, RDFS
from rdflib.term import Node

from suave_des.resources import shipped_folder

TOMASYS = "http://metacontrol.org/tomasys#"
MROS = "http://ros/mros#"
SWRL = "http://www.w3.org/2003/11/swrl#"
CLASSES = (
    "Component ComponentState ComponentSpecification ComponentClass Role Binding Function FunctionDesign Objective "
    "FunctionGrounding QualityAttributeType QAvalue"
)
OBJECT_PROPERTIES = {
    "solvesF": ("FunctionDesign", "Function"),
    "typeF": ("Objective", "Function"),
    "typeFD": ("FunctionGrounding", "FunctionDesign"),
    "solvesO": ("FunctionGrounding", "Objective"),
    "requiresO": ("FunctionGrounding", "Objective"),
    "hasNFR": ("Objective", "QAvalue"),
    "hasQAestimation": ("FunctionDesign", "QAvalue"),
    "hasQAvalue": ("FunctionGrounding", "QAvalue"),
    "isQAtype": ("QAvalue", "QualityAttributeType"),
    "fd_error_log": ("FunctionDesign", "Objective"),
}
DATA_PROPERTIES = (
    "c_status fg_status o_status fd_realisability o_updatable o_always_improve hasValue qa_comparison_operator "
    "qa_critical fd_efficacy b_status cc_unique cc_availability cspec_availability"
)
FUNCTIONAL = "solvesF typeF typeFD solvesO isQAtype c_status fg_status o_status fd_realisability hasValue qa_comparison_operator"


@pytest.fixture(scope="module")
def tomasys(shipped: Path) -> Graph:
    return Graph().parse(shipped / "tomasys.owl", format="xml")


@pytest.fixture(scope="module")
def mros(shipped: Path) -> Graph:
    return Graph().parse(shipped / "mros.owl", format="xml")


def names(graph: Graph, kind: URIRef) -> set[str]:
    return {str(term).removeprefix(TOMASYS) for term in graph.subjects(RDF.type, kind)}


def test_the_vocabulary_is_complete(tomasys):
    assert names(tomasys, OWL.Class) == set(CLASSES.split())
    others = {
        "roles",
        "roleDef",
        "typeC",
        "hasBindings",
        "binding_role",
        "binding_component",
    }
    assert names(tomasys, OWL.ObjectProperty) == others | set(OBJECT_PROPERTIES)
    assert names(tomasys, OWL.DatatypeProperty) == set(DATA_PROPERTIES.split())
    assert names(tomasys, OWL.FunctionalProperty) == set(FUNCTIONAL.split())
    for name, (domain, value_range) in OBJECT_PROPERTIES.items():
        assert tomasys.value(URIRef(TOMASYS + name), RDFS.domain) == URIRef(TOMASYS + domain)
        assert tomasys.value(URIRef(TOMASYS + name), RDFS.range) == URIRef(TOMASYS + value_range)


def test_the_terms_for_robots_are_in_a_file_of_their_own(tomasys, mros):
    named = {str(term) for term in mros.subjects(RDF.type, OWL.NamedIndividual)}
    assert named == {MROS + "energy", MROS + "performance", MROS + "safety"}
    assert set(mros.subjects(RDF.type, OWL.ObjectProperty)) == {URIRef(MROS + "requiredBy")}
    assert not [term for term in tomasys.all_nodes() if str(term).startswith(MROS)]


@pytest.fixture(
    scope="module",
    params=sorted(shipped_folder("ontology").glob("*.owl")),
    ids=lambda path: path.stem,
)
def terms(request: pytest.FixtureRequest) -> tuple[Graph, set[Node]]:
    """An ontology, with its terms and rules."""
    graph = Graph().parse(request.param, format="xml")
    kinds = [
        OWL.Class,
        OWL.ObjectProperty,
        OWL.DatatypeProperty,
        OWL.NamedIndividual,
        URIRef(SWRL + "Imp"),
    ]
    return graph, {term for kind in kinds for term in graph.subjects(RDF.type, kind)}


@pytest.mark.parametrize("annotation", [RDFS.label, RDFS.comment], ids=["label", "comment"])
def test_every_term_or_rule_is_annotated(terms, annotation):
    graph, annotated = terms
    assert annotated
    assert [term for term in annotated if not graph.value(term, annotation)] == []


def test_the_functions_have_the_exemplars_names(kb):
    assert kb.functions == ("f_follow_pipeline", "f_generate_search_path", "f_maintain_motion")


def test_the_components_have_the_exemplars_names(kb):
    assert tuple(kb.model.components) == tuple(f"c_thruster_{n}" for n in range(1, 7))


def test_the_quality_attributes_have_the_exemplars_names(kb):
    assert set(kb.model.attributes) == {
        "water_visibility",
        "battery_level",
        "performance",
        "energy",
        "safety",
    }


def test_the_expected_visibilities_are_the_deployed_ones(kb):
    visibility = {
        d: kb.expected(d)["water_visibility"] for d in kb.designs("f_generate_search_path")
    }
    assert visibility == {
        "fd_spiral_high": Decimal("3.25"),
        "fd_spiral_low": Decimal("1.25"),
        "fd_spiral_medium": Decimal("2.25"),
    }


def test_the_expected_performances_are_the_deployed_ones(kb):
    performance = {d: kb.expected(d)["performance"] for f in kb.functions for d in kb.designs(f)}
    assert performance == {
        "fd_all_thrusters": Decimal(1),
        "fd_recover_thrusters": Decimal("0.75"),
        "fd_spiral_low": Decimal("0.25"),
        "fd_spiral_medium": Decimal("0.5"),
        "fd_spiral_high": Decimal(1),
        "fd_follow_pipeline": Decimal(1),
    }


def test_the_model_has_all_that_missions_need(kb):
    kb.check(kb.functions)


def test_proteges_catalogue_leads_each_import_to_a_shipped_file(shipped):
    catalogue = ElementTree.parse(shipped / "catalog-v001.xml").getroot()
    leads = {entry.attrib["name"]: entry.attrib["uri"] for entry in catalogue}
    for path in shipped.glob("*.owl"):
        for imported in Graph().parse(path, format="xml").objects(None, OWL.imports):
            assert (shipped / leads[str(imported)]).is_file()
