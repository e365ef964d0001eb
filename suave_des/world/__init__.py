"""World: pipeline geometry, what is in view of it, signals over time."""
