"""Find the local file that supplies each import of ontology files. Nothing is ever fetched.

In this order, as Protégé and owlready2 find them, with the shipped files last:

1. a file that was given, or imported already, whose ontology has the imported IRI;
2. the file that Protégé's catalog-v001.xml beside the importing file names for the IRI;
3. the file that the IRI itself names: a file: URL, or a path relative to the importing file;
4. a file beside the importing one whose ontology has the IRI;
5. a file that was given, by its name: the last part of the IRI;
6. a file of that name beside the importing one;
7. a shipped file, by the IRI or by the name.

A file never supplies what it imports itself. Two IRIs are the same if they differ in no more than
their scheme and their last mark, '#' or '/'.
"""

from __future__ import annotations

import posixpath
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from urllib.parse import unquote, urldefrag, urljoin, urlsplit

from lxml import etree

from suave_des.errors import InputError, KnowledgeError
from suave_des.files import read_bytes
from suave_des.knowledge.notation import RELATIVE_TO, TURTLE_ENDINGS, is_iri
from suave_des.knowledge.ontology_file import ONTOLOGY_LIMIT_BYTES, OntologyFile, read_ontology
from suave_des.knowledge.rdf import MROS, TOMASYS, local_name
from suave_des.resources import shipped_folder

_ENDINGS = (".owl", ".rdf", ".xml", *TURTLE_ENDINGS)
_CATALOG = "catalog-v001.xml"
_CATALOG_ENTRY = "{urn:oasis:names:tc:entity:xmlns:xml:catalog}uri"
_SHIPPED = ("tomasys", "mros", "suave", "suave_extended")


@dataclass(frozen=True)
class Supply:
    """Which file supplies an import, and why that one.

    Attributes:
        importing: the file with the import.
        iri: of the imported ontology.
        file: that supplies it.
        reason: how the file was found, for users.
    """

    importing: Path
    iri: str
    file: Path
    reason: str


@dataclass(frozen=True)
class Sources:
    """Ontology files with all that they import, directly or not.

    Attributes:
        files: each once; those that were given come first.
        supplies: which file supplies each import.
    """

    files: tuple[OntologyFile, ...]
    supplies: tuple[Supply, ...]


def collect(given: Sequence[Path]) -> Sources:
    """Read the given files, or the shipped suave.owl, and all that they import, directly or not.

    Raises:
        KnowledgeError: a file cannot be used, two different files supply one ontology, or an import
            does not resolve.
    """
    files: list[OntologyFile] = []
    supplies: list[Supply] = []
    for path in given or [shipped_folder("ontology") / "suave.owl"]:
        _add(files, read_ontology(path))
    # The user's files first, so that the order of imports does not matter.
    for find in (_own_files_for, _all_files_for):
        for file in files:  # grows meanwhile, by imports of imports
            for iri, _ in file.imports:
                if any(each.importing == file.path and each.iri == iri for each in supplies):
                    continue
                found = next(find(file, iri, files), None)
                if found is not None:
                    source, reason = found
                    supplies.append(Supply(file.path, iri, source.path, reason))
                    _add(files, source)
    _add_mros_if_used(files, supplies)
    return Sources(tuple(files), tuple(supplies))


def is_shipped(file: OntologyFile) -> bool:
    """Return whether a file is one of those that come with the program."""
    return file.path.parent == shipped_folder("ontology")


def is_metamodel(file: OntologyFile) -> bool:
    """Return whether a file is TOMASys or mros, whose rules are for any model."""
    return any(has_iri(file, iri) or has_name(file.path, iri) for iri in (TOMASYS, MROS))


def as_written(iri: str) -> str:
    """Return an imported IRI as its file writes it: a relative one without the made-up base."""
    if not _is_relative(iri):
        return iri
    mark = iri[len(urldefrag(iri)[0]) :]
    return posixpath.relpath(urlsplit(iri).path, urlsplit(RELATIVE_TO).path) + mark


def _is_relative(iri: str) -> bool:
    return urlsplit(iri).netloc == urlsplit(RELATIVE_TO).netloc


def _own_files_for(
    file: OntologyFile, iri: str, files: Sequence[OntologyFile]
) -> Iterator[tuple[OntologyFile, str]]:
    """Yield the files of the user's that can supply an import, the one that does first, and how
    they were found.
    """
    others = [each for each in files if each is not file and not is_shipped(each)]
    yield from ((other, "by its IRI") for other in others if has_iri(other, iri))
    yield from _where_the_file_says(file, iri)
    yield from ((other, "by its name") for other in others if has_name(other.path, iri))
    for path in _beside(file):
        if has_name(path, iri):
            yield read_ontology(path), "by its name, beside the importing file"


def _where_the_file_says(file: OntologyFile, iri: str) -> Iterator[tuple[OntologyFile, str]]:
    """Yield the files that a catalog, the IRI itself or an IRI beside the importing file names."""
    catalogued = _in_catalog(file, iri)
    if catalogued is not None and catalogued.parent != shipped_folder("ontology"):
        yield read_ontology(catalogued), f"by {_CATALOG}"
    named = _path_of(file, iri)
    if named is not None and _is_file(named):
        yield read_ontology(named), "by its path"
    for path in _beside(file):
        if _may_have_iri(path, iri) and has_iri(read_ontology(path), iri):
            yield read_ontology(path), "by its IRI, beside the importing file"


def _all_files_for(
    file: OntologyFile, iri: str, files: Sequence[OntologyFile]
) -> Iterator[tuple[OntologyFile, str]]:
    """Yield the files that can supply an import, as _own_files_for does, and then shipped ones.

    Raises:
        KnowledgeError: there is no further one.
    """
    yield from _own_files_for(file, iri, files)
    for name in _SHIPPED:
        source = read_ontology(shipped_folder("ontology") / f"{name}.owl")
        if has_iri(source, iri) or has_name(source.path, iri):
            yield source, "shipped"
    line = dict(file.imports)[iri]
    raise KnowledgeError(
        f"import {as_written(iri)} does not resolve to a local file",
        file=file.path,
        place=f"line {line}" if line else None,
        remedy="give the imported ontology's file too, or put it beside this one",
    )


def _add_mros_if_used(files: list[OntologyFile], supplies: list[Supply]) -> None:
    """Add the shipped mros.owl for files that use its terms without any that describes them.

    Until mros.owl was shipped, its terms stood in the shipped tomasys.owl.
    """
    subjects = (triple[0] for file in files for triple in file.triples)
    if any(has_iri(file, MROS) for file in files) or _mentions_mros(subjects):
        return
    for file in files:
        if _mentions_mros(chain.from_iterable(file.triples)):
            source = read_ontology(shipped_folder("ontology") / "mros.owl")
            reason = "shipped: its terms are used without an import"
            supplies.append(Supply(file.path, MROS, source.path, reason))
            files.append(source)
            return


def _mentions_mros(terms: Iterable[object]) -> bool:
    return any(isinstance(term, str) and term.startswith(MROS) for term in terms)


def _add(files: list[OntologyFile], new: OntologyFile) -> None:
    for old in files:
        if old.path.resolve() == new.path.resolve() or old.content == new.content:
            return
        if set(map(_comparable, old.iris)) & set(map(_comparable, new.iris)):
            problem = f"supplies the ontology {new.iris[0]}, and so does {old.path}"
            raise KnowledgeError(problem, file=new.path, remedy="give one of the two")
    files.append(new)


def has_iri(file: OntologyFile, iri: str) -> bool:
    """Return whether a file's ontology has an IRI; an anonymous one has that of xml:base."""
    known = file.iris or filter(None, [file.base])
    return _comparable(iri) in map(_comparable, known)


def has_name(path: Path, iri: str) -> bool:
    """Return whether a file has the name of an ontology: the last part of its IRI."""
    last = local_name(_comparable(iri))
    names = {last, *map(last.removesuffix, _ENDINGS)}
    return _without_ending(path.name) in set(map(_without_ending, names))


def _without_ending(name: str) -> str:
    for ending in _ENDINGS:
        if name.endswith(ending):
            return name.removesuffix(ending)
    return name


def _comparable(iri: str) -> str:
    """Return an IRI without scheme and last mark: those of one ontology are equal in this form."""
    return urldefrag(iri)[0].partition("://")[2].rstrip("/") or iri


def _beside(file: OntologyFile) -> Iterator[Path]:
    """Yield the other ontology files in the folder of a file, unless that is shipped, by name."""
    if is_shipped(file):
        return
    for path in sorted(file.path.parent.iterdir()):
        is_ontology = path.suffix in _ENDINGS and path.name != _CATALOG and path.is_file()
        if is_ontology and path.resolve() != file.path.resolve():
            yield path


def _may_have_iri(path: Path, iri: str) -> bool:
    """Return whether a file has the text of an IRI, and can be read as an ontology."""
    try:
        if _comparable(iri).encode() not in read_bytes(path, ONTOLOGY_LIMIT_BYTES):
            return False
        read_ontology(path)
    except InputError:  # a file that happens to lie there is nobody's input
        return False
    return True


def _path_of(file: OntologyFile, iri: str) -> Path | None:
    """Return the path that an import itself names; None if it names none."""
    parts = urlsplit(urldefrag(as_written(iri))[0])
    if _is_relative(iri) or parts.scheme == "file":
        return file.path.parent / unquote(parts.path)
    return None


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # too long a name
        return False


def _in_catalog(file: OntologyFile, iri: str) -> Path | None:
    """Return the file that Protégé's catalog in the folder names for an import, if it is there.

    Raises:
        KnowledgeError: the catalog is no XML.
    """
    catalog = file.path.parent / _CATALOG
    if not catalog.is_file():
        return None
    parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False)
    try:
        root = etree.fromstring(read_bytes(catalog, ONTOLOGY_LIMIT_BYTES), parser)
    except etree.XMLSyntaxError as error:
        raise KnowledgeError(
            f"not well-formed XML: {error.msg}", file=catalog, remedy="remove it, or correct it"
        ) from error
    for entry in root.iter(_CATALOG_ENTRY):
        name = entry.get("name", "")
        uri = entry.get("uri", "")
        if is_iri(name) and is_iri(uri) and _comparable(name) == _comparable(iri):
            path = catalog.parent / unquote(urlsplit(urljoin(entry.base or "", uri)).path)
            if _is_file(path):
                return path
    return None
