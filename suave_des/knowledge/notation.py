"""How ontology files are written: their characters, and the IRIs in them."""

from __future__ import annotations

import re
from urllib.parse import urlsplit

_DECLARED_ENCODING = re.compile(rb"\s*<\?xml[^>]*\bencoding\s*=\s*[\"']([\w.-]+)[\"']")
TURTLE_ENDINGS = (".ttl", ".nt")
#: Characters that no IRI may contain (RFC 3987) and that would break the N-Triples given to a
# reasoner.
_NOT_IN_IRI = frozenset('<>"{}|\\^`') | {chr(code) for code in range(0x21)}
#: Stands for the folder of a file without xml:base, and reveals nothing of this machine's folders.
#: As deep as a path may climb by "../".
RELATIVE_TO = "http://ontology.invalid/a/a/a/a/a/a/a/a/"


def text_of(content: bytes, errors: str = "strict") -> str:
    """Decode a file by its byte order mark or XML declaration, else as UTF-8."""
    encoding = "utf-8-sig"
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        encoding = "utf-16"
    elif declared := _DECLARED_ENCODING.match(content, 0, 200):
        encoding = declared[1].decode()
    try:
        return content.decode(encoding, errors)
    except UnicodeDecodeError:
        raise
    except (LookupError, UnicodeError):  # no encoding of characters, or none that is known
        return content.decode("utf-8", errors)


def is_iri(text: str) -> bool:
    """Return whether a text can be an IRI, as far as readers depend on it."""
    try:
        urlsplit(text)  # an address in brackets
    except ValueError:
        return False
    return _NOT_IN_IRI.isdisjoint(text)
