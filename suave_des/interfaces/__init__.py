"""Missions and managers for other programs: step by step, as a Gymnasium environment, over HTTP, in
other languages; and campaigns on a cluster.
"""
