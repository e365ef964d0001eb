"""Pellet: in this process, with a cache of its inferences, and in stock owlready2; and the Java that it runs in."""
