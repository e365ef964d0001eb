"""Validation: simulated missions against real ones, by distributions, places of detection and conclusions."""
