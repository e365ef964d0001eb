"""The knowledge base of Metacontrol: ontologies, SWRL rules, reasoners and the planner.

States and plans are in suave_des.knowledge.state, which imports nothing; Java starts with the first
reasoner.
"""
