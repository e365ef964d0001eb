"""Helpers that test modules share: stand-ins, files and managers to try things with, commands in processes."""

AWKWARD = "tests.helpers.awkward_managers"
"""Module of managers that misbehave, to be named as f"{AWKWARD}:CLASS"."""
OUTSIDE = "tests.helpers.outside_managers"
"""Module of managers as users write them."""
