"""What is observed of a mission: its metrics, and the record of its events, trajectory and states
of knowledge.
"""
