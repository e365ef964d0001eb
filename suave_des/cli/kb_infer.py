"""suave-des kb infer: what the reasoner adds to a state, and the plan that follows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from suave_des.cli.kb_options import (
    Components,
    Format,
    Formats,
    Groundings,
    Measured,
    Objectives,
    ScenarioOption,
    StateFile,
    TimeLimitS,
    print_json,
    state_lines,
)
from suave_des.cli.options import DisabledRules, Ontologies, Reasoner, RuleFiles

if TYPE_CHECKING:
    from suave_des.knowledge.deliberation import Conclusion


def infer(
    ontology: Ontologies = None,
    scenario: ScenarioOption = "seams2023",
    rules: RuleFiles = None,
    disable_rule: DisabledRules = None,
    reasoner: Reasoner = None,
    state: StateFile = None,
    measured: Measured = None,
    component: Components = None,
    ground: Groundings = None,
    objective: Objectives = None,
    time_limit: TimeLimitS = 60.0,
    form: Formats = Format.TEXT,
) -> None:
    """Tell what the reasoner infers in a state, and what Metacontrol would do."""
    from suave_des.workbench import KnowledgeBase
    from suave_des.workbench.states import state_from

    bench = KnowledgeBase.load(
        ontology or (),
        scenario=scenario,
        reasoner=reasoner,
        rules=rules or (),
        disabled_rules=disable_rule or (),
        time_limit_s=time_limit,
    )
    known = state_from(
        bench.base,
        bench.loop,
        state,
        measured=measured or (),
        components=component or (),
        groundings=ground or (),
        objectives=objective or (),
    )
    conclusion = bench.infer(known)
    if form is Format.JSON:
        print_json(_as_json(conclusion))
        return
    _print(conclusion)


def _print(conclusion: Conclusion) -> None:
    print("state")
    for line in state_lines(conclusion.inference.state):
        print(f"  {line}")
    print("inferred")
    for fact in sorted(map(str, conclusion.inference.facts)) or ["nothing"]:
        print(f"  {fact}")
    print("plan")
    if not conclusion.plan.decisions:
        print("  nothing to adapt")
    for decision in conclusion.plan.decisions:
        print(f"  {decision.function}: {decision.design or 'no design left'}  ({decision.reason})")
        for rejection in decision.rejected:
            print(f"    not {rejection.design}: {rejection.reason}")


def _as_json(conclusion: Conclusion) -> dict[str, Any]:
    from suave_des.workbench.states import state_dict

    return {
        "state": state_dict(conclusion.inference.state),
        "inferred": sorted(map(str, conclusion.inference.facts)),
        "plan": [
            {
                "function": decision.function,
                "design": decision.design,
                "reason": decision.reason,
                "rejected": {rejection.design: rejection.reason for rejection in decision.rejected},
            }
            for decision in conclusion.plan.decisions
        ],
    }
