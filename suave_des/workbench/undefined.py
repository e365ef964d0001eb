"""Names that ontologies use and nowhere define: most are misspelt, and no reasoner says a word of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from suave_des.knowledge.content import Content
from suave_des.knowledge.model import Model
from suave_des.knowledge.rules.names import Vocabulary
from suave_des.knowledge.vocabulary import LANGUAGE_NAMESPACES, RDF_TYPE, local_name, namespace, nearest

_PROPERTIES: Final = frozenset(("object property", "data property", "annotation property"))


@dataclass(frozen=True)
class Undefined:
    """A name that is not defined.

    Attributes:
        subject: IRI of the individual of which it is said.
        message: what is wrong.
        remedy: what was perhaps meant.
        is_ours: whether the ontologies define other names of its namespace, so that it should be one of them.
    """

    subject: str
    message: str
    remedy: str | None
    is_ours: bool


def undefined_names(content: Content, model: Model | None, vocabulary: Vocabulary) -> Iterator[Undefined]:
    """What individuals are said to be, to have or to refer to, while nothing says what that is."""
    groups = (model.objectives, model.groundings, model.measurements) if model is not None else ()
    described = {subject for subject, _, _ in content.triples}
    described |= {individual.iri for group in groups for individual in group.values()}
    namespaces = {namespace(iri) for iri in described}

    def undefined(subject: str, said: str, name: str, *kinds: str) -> Undefined:
        bare = local_name(name)
        known = [iri for iri in described if vocabulary.kinds.get(iri, frozenset()) & {*kinds}]
        same = sorted(iri for iri in known if local_name(iri) == bare)
        remedy = f"did you mean {' or '.join(same)}?" if same else nearest(bare, set(map(local_name, known)))
        return Undefined(
            subject, f"{local_name(subject)}: {said} is not defined", remedy, namespace(name) in namespaces
        )

    for subject, predicate, value in content.triples:
        own_value = isinstance(value, str) and not value.startswith(LANGUAGE_NAMESPACES)
        if predicate == RDF_TYPE:
            if own_value and "class" not in vocabulary.kinds.get(str(value), ()):
                yield undefined(subject, f"class {local_name(str(value))}", str(value), "class")
        elif not predicate.startswith(LANGUAGE_NAMESPACES):
            if predicate not in described:
                yield undefined(subject, f"property {local_name(predicate)}", predicate, *_PROPERTIES)
            elif own_value and value not in described and "object property" in vocabulary.kinds.get(predicate, ()):
                said = f"{local_name(predicate)} {local_name(str(value))}"
                yield undefined(subject, said, str(value), "individual")
