"""Simulation: wires one mission, scenario + manager + run + seed, into a SimPy environment."""
