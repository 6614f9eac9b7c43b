"""Which pairs of bodies a verdict speaks of, and which it leaves out."""

from typing import Any

from excite_cli.constraints.self_collision import SelfCollision
from excite_cli.excitation.problem import Problem
from excite_cli.geometry.reasons import DroppedPair, Why
from excite_cli.geometry.words import dropped_in_words, reason_in_words
from excite_cli.robot.model import links_by_joint

# Reasons that leave a pair to chance; the others say that nothing can happen.
UNJUDGED = (Why.UNGUARDED, Why.ALWAYS_TOUCHING, Why.ALWAYS_NEAR, Why.IGNORED)
_TOLD = 6


def unjudged(problem: Problem) -> list[DroppedPair]:
    """Pairs that nothing keeps apart."""
    return [
        pair
        for constraint in problem.constraints
        for pair in constraint.left_out or ()
        if pair.reason.why in UNJUDGED
    ]


def not_guarded(problem: Problem) -> list[str]:
    """Moved joints whose bodies have mass and no shape, where self-collision is asked for."""
    capsules = [c.capsules for c in problem.constraints if isinstance(c, SelfCollision)]
    if not capsules:
        return []
    guarded = {link for of in capsules for capsule in of for link in capsule.links}
    model, links = problem.robot.model, links_by_joint(problem.robot)
    return [
        joint
        for joint in problem.robot.joint_names
        if model.inertias[model.getJointId(joint)].mass > 0 and not guarded & set(links[joint])
    ]


def kept_apart(problem: Problem) -> int:
    """Number of pairs of capsules, meshes and surroundings that are kept apart."""
    return sum(len(c.labels) for c in problem.constraints if c.left_out is not None)


def pairs_in_words(problem: Problem) -> list[str]:
    """A sentence on the pairs, where any are judged or left out."""
    kept, left, bare = kept_apart(problem), unjudged(problem), not_guarded(problem)
    alarms = []
    if bare:
        links = links_by_joint(problem.robot)
        told = ", ".join(f"{joint} ({', '.join(links[joint])})" for joint in bare)
        alarms = [
            f"NOT GUARDED: what moves with {told} has no collision geometry, so no verdict speaks "
            "of it. Add <collision> to the URDF, or capsules of your own "
            "(constraints.self_collision.capsules)."
        ]
    if not kept and not left:
        return alarms
    words = f"Verdicts speak of {kept} of {kept + len(left)} pairs of bodies"
    if not left:
        return [*alarms, f"{words}, all that could come near each other."]
    told = "; ".join(dropped_in_words(pair) for pair in left[:_TOLD])
    more = f"; and {len(left) - _TOLD} more (--json has all)" if len(left) > _TOLD else ""
    return [*alarms, f"{words}. Not kept apart: {told}{more}."]


def pairs_data(problem: Problem) -> dict[str, Any]:
    """The same for `--json`."""
    return {
        "kept_apart": kept_apart(problem),
        "not_guarded": not_guarded(problem),
        "not_kept_apart": [
            {
                "pair": [pair.first, pair.second],
                "why": pair.reason.why.value,
                "reason": reason_in_words(pair.reason),
                "distance": pair.reason.distance,
            }
            for pair in unjudged(problem)
        ],
    }
