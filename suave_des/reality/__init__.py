"""Real missions: what simulated ones are compared with, and what they assist."""
