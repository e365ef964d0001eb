"""States of the SUAVE knowledge base in the tests' words."""

from __future__ import annotations

from collections.abc import Mapping

from suave_des.knowledge.state import KnowledgeState, NumberLike, ObjectiveState

MOTION = "f_maintain_motion"
SEARCH = "f_generate_search_path"
FOLLOW = "f_follow_pipeline"


def searching(
    design: str | None = None,
    visibility: NumberLike | None = None,
    *,
    status: str | None = None,
    motion: str | None = None,
    components: Mapping[str, str] | None = None,
    always_improve: bool = False,
) -> KnowledgeState:
    """The search objective, with the motion objective where its grounding is given."""
    objectives = [ObjectiveState(SEARCH, status, always_improve)]
    groundings = {SEARCH: design} if design else {}
    if motion:
        objectives.append(ObjectiveState(MOTION))
        groundings[MOTION] = motion
    return KnowledgeState.of(
        objectives,
        groundings=groundings,
        components=components,
        measurements={} if visibility is None else {"water_visibility": visibility},
    )


#: Values of a scenario: the designs' performance keeps its order, in numbers that the ontology has
# anyway, so that : there are 8 ranges of measured values in place of 16, and half as many states of
# a policy.
FEWER_NUMBERS = {
    "knowledge.values": {
        "qa_performance_low": 1.25,
        **{f"qa_performance_{name}": 2.25 for name in ("medium", "recover_thrusters")},
        **{f"qa_performance_{name}": 3.25 for name in ("high", "all_thrusters", "follow_pipeline")},
    }
}
