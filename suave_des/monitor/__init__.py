"""Monitors: the diagnostics bus and what publishes on it."""
