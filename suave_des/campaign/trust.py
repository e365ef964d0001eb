"""Whether the user trusts the code that the folder of a campaign refers to; nothing is imported
before that.
"""

from __future__ import annotations

import hashlib
import json
import shlex
import sys
from collections.abc import Collection
from pathlib import Path

from suave_des.caches import SharedEntries, private_cache
from suave_des.campaign.missions import Campaign
from suave_des.errors import InputError
from suave_des.registry import takes_argument


def check_trusted(
    campaign: Campaign, named: Collection[str], folder: Path, *, confirmed: bool
) -> None:
    """Check that the user trusts the code that a campaign folder refers to; nothing is imported
    before that.

    He does if he has named or confirmed it, if it is imported already, as by a script that resumes
    its own campaign, or if he has begun the campaign himself.

    Raises:
        InputError: a manager or a class is neither.
    """

    def is_imported(name: str) -> bool:
        return ":" in name and not takes_argument(name) and name.partition(":")[0] in sys.modules

    unknown = [name for name in campaign.code() if name not in named and not is_imported(name)]
    begun = dict(_begun().read()) if unknown else {}
    if not confirmed and any(_note(folder, name) not in begun for name in unknown):
        problem = (
            f"the campaign would run the code of {', '.join(unknown)}, which this folder refers to"
        )
        remedy = f"if you trust it, give --managers {shlex.quote(','.join(unknown))} or --yes"
        raise InputError(problem, file=folder, remedy=remedy)


def note_own(campaign: Campaign, folder: Path) -> None:
    """Note, outside of its folder, that this user has begun a campaign with its code, see
    `check_trusted`.
    """
    for name in campaign.code():
        _begun().add(_note(folder, name), True)


def _begun() -> SharedEntries:
    return SharedEntries(private_cache("campaigns"), "begun")


def _note(folder: Path, name: str) -> str:
    """Return the note that this user has run code of this name from here, for this very folder.

    A folder from elsewhere has another number, and cannot bring such a note along.
    """
    found = folder.stat()
    place = json.dumps([str(folder.resolve()), found.st_dev, found.st_ino, str(Path.cwd()), name])
    return hashlib.sha256(place.encode(errors="replace")).hexdigest()
