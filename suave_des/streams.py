"""Named random streams: each use of chance has its own, so that adding one changes no other."""

from __future__ import annotations

import hashlib
import random


class Streams:
    """The random streams of one run of a campaign.

    A stream depends on the campaign's seed, the run's number and its own name, and on nothing else: not on the manager,
    so the same run gives every manager the same sea, and not on which other streams exist or in which order they are
    asked for.
    """

    def __init__(self, seed: int, run: int) -> None:
        self._key = f"{seed}/{run}/"

    def stream(self, name: str) -> random.Random:
        """A fresh generator for a name; asking twice gives two that draw the same values."""
        digest = hashlib.blake2b((self._key + name).encode(), digest_size=16).digest()
        return random.Random(int.from_bytes(digest, "big"))
