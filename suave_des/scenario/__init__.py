"""Scenario: the validated description of a mission, and its files."""
