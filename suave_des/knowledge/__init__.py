"""The knowledge base of Metacontrol: ontologies, SWRL rules, reasoners and the planner.

Only the types of states and plans are imported here; a knowledge base and its reasoners are in
suave_des.knowledge.ontology and suave_des.knowledge.reasoner, and Java starts with the first reasoner.
"""

from suave_des.knowledge.state import (
    Decision,
    Fact,
    Inference,
    KnowledgeState,
    ObjectiveState,
    Plan,
    Rejection,
    Value,
)

__all__ = ["Decision", "Fact", "Inference", "KnowledgeState", "ObjectiveState", "Plan", "Rejection", "Value"]
