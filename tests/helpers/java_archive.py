"""Java's archive of classes in the cache folders of tests: that of the user, so that none of them makes its own."""

from __future__ import annotations

import errno
import os
import shutil
from contextlib import suppress
from pathlib import Path

from suave_des.knowledge.pellet.java import archive_path


def share_java_archive(cache: Path, archive: Path | None = None) -> None:
    """Put an archive into a cache folder, that of this process by default; where it is not there, none is made."""
    archive = archive or archive_path()
    if archive is None:
        return
    folder = cache / "java"
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    (folder / archive.name).with_suffix(".tried").touch()
    with suppress(FileNotFoundError, FileExistsError):
        try:
            os.link(archive, folder / archive.name)
        except OSError as error:
            if error.errno != errno.EXDEV:
                raise
            shutil.copy(archive, folder / archive.name)  # to another file system
