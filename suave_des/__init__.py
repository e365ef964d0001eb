"""SUAVE, the self-adaptive underwater vehicle exemplar, as a discrete-event simulation.

Importing the package starts nothing: no Java, no pandas, no matplotlib until they are needed.
"""

__version__ = "0.1.0"
