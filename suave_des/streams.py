"""Named random streams: each random quantity has its own, so that adding one changes no other."""

from __future__ import annotations

import hashlib
import random


class Streams:
    """The random streams of one run of a campaign.

    A stream depends on the campaign's seed, the run's number and its own name only: not on the manager, so that runs
    with the same number use common random numbers, and not on which other streams exist or in which order they are
    created.

        visibility = Streams(seed=1, run=7).stream("visibility")
    """

    def __init__(self, seed: int, run: int) -> None:
        self._key = f"{seed}/{run}/"

    def stream(self, name: str) -> random.Random:
        """Create the generator of a name; two of the same name draw the same values."""
        digest = hashlib.blake2b((self._key + name).encode(), digest_size=16).digest()
        return random.Random(int.from_bytes(digest, "big"))
