"""Fit parameters of scenarios to real missions: the parts of calibrate.py, which other studies use,
too.
"""
