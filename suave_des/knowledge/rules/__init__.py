"""SWRL rules: their parts, their text form, their RDF form, and checks of what Pellet would ignore."""
