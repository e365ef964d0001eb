"""Java's archives, of the Java in this process and of stock owlready2's: made before the tests, if they are not there.

Otherwise a process of the lowest priority makes each of them later, and gets no time while tests keep the machine busy;
until then a process with Java takes 0.7 s of CPU time more.
"""

import os

import owlready2.reasoning

from suave_des.knowledge import java_archive
from suave_des.knowledge.pellet.java import SHORT_LIVED

if __name__ == "__main__":
    class_path = owlready2.reasoning._PELLET_CLASSPATH.split(os.pathsep)
    for reasoner, archive in (
        ("pellet", java_archive.archive_path()),
        ("owlready2", java_archive.archive_path(class_path, SHORT_LIVED)),
    ):
        if archive is not None and not archive.exists():
            java_archive.make(archive, reasoner)
