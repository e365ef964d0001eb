"""suave-des kb explain: why a fact or a decision follows, as a tree of rules."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

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
)
from suave_des.cli.options import DisabledRules, Ontologies, Reasoner, RuleFiles

if TYPE_CHECKING:
    from suave_des.workbench.derivation import Derivation
    from suave_des.workbench.explain import Explanation


def explain(
    question: Annotated[
        str,
        typer.Argument(
            metavar="QUESTION",
            help='A fact, as a rule atom says it, or "why DESIGN?", "why not DESIGN?"; left out: all that follows.',
        ),
    ] = "",
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
    """Tell why a fact follows in a state, why a design is chosen or not, or why the state contradicts itself."""
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
    explanation = bench.explain(known, question)
    if form is Format.JSON:
        print_json(_as_json(explanation))
        return
    print(explanation)


def _as_json(explanation: Explanation) -> dict[str, Any]:
    from suave_des.workbench.states import state_dict

    return {
        "state": state_dict(explanation.state),
        "facts": [_node(each) for each in explanation.facts],
        "decisions": [
            {
                "function": each.function,
                "answer": each.answer,
                "because": [_node(one) for one in each.because],
                "candidates": [
                    {
                        "design": one.design,
                        "verdict": one.verdict,
                        "reason": one.reason,
                        "because": [_node(node) for node in one.because],
                    }
                    for one in each.candidates
                ],
            }
            for each in explanation.decisions
        ],
        "contradiction": explanation.problem,
        "rules": list(explanation.rules),
        "clashes": [
            {"subject": each.subject, "property": each.property, "sides": [_node(side) for side in each.sides]}
            for each in explanation.clashes
        ],
    }


def _node(derivation: Derivation) -> dict[str, Any]:
    return {
        "fact": str(derivation.fact),
        "source": derivation.source,
        "rule": derivation.rule,
        "bindings": {name: str(value) for name, value in derivation.bindings},
        "axioms": list(derivation.axioms),
        "premises": [_node(each) for each in derivation.premises],
    }
