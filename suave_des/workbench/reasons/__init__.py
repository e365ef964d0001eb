"""Reasons: why a fact follows or a design is chosen, and why a rule does not fire."""
