"""Calibration: fits parameters of a scenario to published runs."""
