"""Resolve the imports of ontologies to local files. Nothing is ever fetched.

An import is looked for among the files that were given, then among the files beside the importing one, then
among the shipped ones: by the IRI (of the ontology, or xml:base), then by the last part of the IRI, which
for the exemplar's ontologies is the name of the file (tomasys, mros, suave).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

from rdflib import URIRef
from rdflib.namespace import RDF

from suave_des.errors import KnowledgeError
from suave_des.knowledge.ontology_file import OntologyFile, read_ontology, same_iri
from suave_des.knowledge.vocabulary import MROS, local_name
from suave_des.resources import shipped_folder

_ENDINGS: Final = (".owl", ".rdf", ".xml")
#: The shipped tomasys.owl also holds the terms that the exemplar keeps in mros.owl.
_SHIPPED: Final = {"tomasys": "tomasys.owl", "mros": "tomasys.owl", "suave": "suave.owl"}


def collect(given: Sequence[Path]) -> tuple[OntologyFile, ...]:
    """The given files and all that they import, directly or not, each once.

    Raises:
        KnowledgeError: a file cannot be used, two different files supply one ontology, or an import does not
            resolve.
    """
    files: list[OntologyFile] = []
    for path in given:
        _add(files, read_ontology(path))
    for file in files:  # grows while it is read: imports of imports, and cycles end by themselves
        for iri, line in file.imports:
            if _supplier(files, iri) is None:
                found = _beside(file, iri) or _shipped(files, iri)
                if found is not None:
                    _add(files, found)
                elif not _holds_terms_of(files, iri):
                    raise KnowledgeError(
                        f"import {iri} does not resolve to a local file",
                        file=file.path,
                        place=f"line {line}" if line else None,
                        remedy="give the imported ontology's file too, or put it beside this one; "
                        "nothing is fetched from the network",
                    )
    return tuple(files)


def _add(files: list[OntologyFile], new: OntologyFile) -> None:
    for old in files:
        if old.path.resolve() == new.path.resolve() or old.content == new.content:
            return
        if set(map(same_iri, old.iris)) & set(map(same_iri, new.iris)):
            raise KnowledgeError(
                f"supplies the ontology {new.iris[0]}, and so does {old.path}",
                file=new.path,
                remedy="give one of the two",
            )
    files.append(new)


def _name(iri: str) -> str:
    """The name of an ontology by its IRI: its last part without the ending of a file."""
    return Path(local_name(same_iri(iri))).stem


def supplies(file: OntologyFile, iri: str, *, by_name: bool = True) -> bool:
    """Whether a file supplies an imported ontology: by an IRI of its own, or else by name."""
    known = (*file.iris, file.base) if file.base else file.iris
    if same_iri(iri) in map(same_iri, known):
        return True
    return by_name and _name(iri) in {file.path.stem, *map(_name, file.iris)}


def _supplier(files: Sequence[OntologyFile], iri: str) -> OntologyFile | None:
    """The file that supplies an imported ontology: by IRI, else by name."""
    for by_name in (False, True):
        for file in files:
            if supplies(file, iri, by_name=by_name):
                return file
    return None


def _beside(file: OntologyFile, iri: str) -> OntologyFile | None:
    """The file of that name, or else with that IRI, in the folder of the importing file."""
    folder = file.path.parent
    stem = _name(iri)
    for name in (stem + ending for ending in _ENDINGS):
        if (folder / name).is_file() and (folder / name).resolve() != file.path.resolve():
            return read_ontology(folder / name)
    for path in sorted(entry for entry in folder.iterdir() if entry.suffix in _ENDINGS[:2] and entry.is_file()):
        try:
            if _name(iri).encode() not in path.read_bytes():
                continue
            candidate = read_ontology(path)
        except (KnowledgeError, OSError):
            continue  # a stranger that happens to lie in the same folder: nobody asked for it
        if same_iri(iri) in map(same_iri, candidate.iris):
            return candidate
    return None


def _shipped(files: Sequence[OntologyFile], iri: str) -> OntologyFile | None:
    name = _SHIPPED.get(_name(iri))
    if name is None:
        return None
    found = read_ontology(shipped_folder("ontology") / name)
    # A given tomasys ontology is not mixed with the shipped one for the sake of its mros terms.
    return None if any(_supplier(files, known) for known in found.iris) else found


def _holds_terms_of(files: Iterable[OntologyFile], iri: str) -> bool:
    """Whether a file, such as an edited copy of the shipped tomasys.owl, defines the robots' terms itself."""
    return _name(iri) == "mros" and any(
        isinstance(subject, URIRef) and subject.startswith(MROS) and len(set(file.graph.predicates(subject))) > 1
        for file in files
        for subject in file.graph.subjects(RDF.type, None)
    )
