"""Which pairs of bodies a verdict speaks of, and which it leaves out."""

from collections.abc import Sequence
from typing import Any

from excite_cli.constraints.obstacle_clearance import Surroundings
from excite_cli.excitation.inspection import (
    bodies_without_shapes,
    links_without_shapes,
    not_modelled,
)
from excite_cli.excitation.motion import Doubt, Motion
from excite_cli.excitation.problem import Problem
from excite_cli.fields import data_of
from excite_cli.geometry.reasons import DroppedPair, Why, dropped_in_words, reason_in_words
from excite_cli.proof.certificate import Worst
from excite_cli.robot.model import links_by_joint


def worst_data(worst: Worst) -> dict[str, Any]:
    """A worst margin for `--json`."""
    return {
        **data_of(worst, "margin", "share", "unit", "time", "violations"),
        "where": worst.label,
    }


def doubts_in_words(motions: Sequence[Motion]) -> list[str]:
    """For each reason that there is: `motion 1 is not proved: …`, without a full stop."""
    found: dict[Doubt, list[str]] = {}
    for motion in motions:
        if motion.doubt:
            found.setdefault(motion.doubt, []).append(str(motion.index))
    return [
        f"motion {which[0]} is not proved: {why}"
        if len(which) == 1
        else f"motions {', '.join(which)} are not proved: each {why}"
        for why, which in found.items()
    ]


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


def kept_apart(problem: Problem) -> int:
    """Number of pairs of capsules, meshes and surroundings that are kept apart."""
    return sum(len(c.labels) for c in problem.constraints if c.left_out is not None)


def not_modelled_in_words(missing: Problem | Sequence[str]) -> str:
    """What the verdict does not speak of: of a problem, or things by name."""
    things = not_modelled(missing) if isinstance(missing, Problem) else missing
    return f"Not modelled: {'; '.join(things)}."


def pairs_in_words(problem: Problem) -> list[str]:
    """Sentences on the pairs, where any are judged or left out, and on bodies without shapes."""
    left = unjudged(problem)
    told = "; ".join(dropped_in_words(pair) for pair in left[:_TOLD])
    more = f"; and {len(left) - _TOLD} more (--json has all)" if len(left) > _TOLD else ""
    names = f" Not checked: {told}{more}." if left else ""
    return [*unguarded_in_words(problem), *(f"{each}{names}" for each in counted_pairs(problem))]


def counted_pairs(problem: Problem) -> list[str]:
    """How many pairs are checked, in one sentence; empty where there are none."""
    kept, left = kept_apart(problem), len(unjudged(problem))
    if not kept and not left:
        return []
    around = any(isinstance(each, Surroundings) for each in problem.constraints)
    what = "Collision: {} pairs" if around else "Self-collision: {} link pairs"
    bare = bodies_without_shapes(problem) or links_without_shapes(problem)
    shaped = " with collision shapes" if bare else ""
    many = f"{kept} of {kept + left} relevant" if left or kept == 1 else f"all {kept} relevant"
    return [f"{what.format(many)}{shaped} checked."]


def unguarded_in_words(problem: Problem) -> list[str]:
    """A sentence on the bodies that have no shapes; empty where all have."""
    links, without = links_by_joint(problem.robot), links_without_shapes(problem)
    bare = [
        joint for joint in bodies_without_shapes(problem) if not set(without) & set(links[joint])
    ]
    told = ", ".join(f"{joint} ({', '.join(links[joint])})" for joint in bare)
    sentences = []
    if bare:
        sentences.append(
            f"NOT GUARDED: what moves with {told} has no collision geometry and is not "
            "checked. Add <collision> to the URDF, take the links' visual shapes "
            "(constraints.self_collision.shapes: visual), or give capsules of your own "
            "(constraints.self_collision.capsules)."
        )
    if without:
        sentences.append(
            f"NOT GUARDED: the meshes of {', '.join(without)} are missing or cannot be read "
            "(constraints.self_collision.without_shapes), so these links are not checked. "
            "Give the folder of their package under robot.package_dirs, or capsules of your own "
            "(constraints.self_collision.capsules)."
        )
    return sentences


def pairs_data(problem: Problem) -> dict[str, Any]:
    """The same for `--json`."""
    return {
        "kept_apart": kept_apart(problem),
        "not_guarded": bodies_without_shapes(problem),
        "links_without_shapes": links_without_shapes(problem),
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
