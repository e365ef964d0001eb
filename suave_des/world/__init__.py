"""World: pipeline geometry, what is in view of it, the area seen of the sea bed, signals over time."""
