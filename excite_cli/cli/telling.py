"""What is worth saying about a problem before work begins."""

from collections import Counter

from excite_cli.cli.console import Terminal
from excite_cli.constraints.base import Constraint
from excite_cli.constraints.mesh_clearance import MeshClearance
from excite_cli.constraints.obstacle_clearance import Surroundings
from excite_cli.constraints.self_collision import SelfCollision
from excite_cli.effects.catalogue import declared_effects
from excite_cli.excitation.problem import Problem
from excite_cli.geometry.collision_pairs import CollisionPairs
from excite_cli.geometry.obstacle_pairs import ObstaclePairs
from excite_cli.geometry.reasons import Why
from excite_cli.geometry.words import dropped_in_words, reason_in_words, why_in_words


def tell_problem(terminal: Terminal, problem: Problem) -> None:
    """Say in two lines what was understood, and what a person must know; the rest is detail."""
    robot = problem.robot
    criterion, weighting = problem.spec.criterion, problem.weighting
    extra = len(problem.extension.names)
    effects = f" and {extra} columns of effects" if extra else ""
    terminal.say(
        f"{robot.name}: {robot.n} joints, {problem.base.rank} base parameters{effects}, "
        f"{problem.variables} variables; criterion: {criterion.kind}"
    )
    names = ", ".join(_counted_name(constraint) for constraint in problem.constraints) or "none"
    terminal.say(f"constraints: {names}")
    terminal.detail(
        f"{len(problem.cost_basis.times)} cost and {len(problem.constraint_basis.times)} "
        f"constraint samples; row weights: {weighting.row_name}, column scaling: "
        f"{weighting.column_name}"
    )
    _tell_effects(terminal, problem)
    _tell_uncertainty(terminal, problem)
    for constraint in problem.constraints:
        if isinstance(constraint, SelfCollision):
            _tell_self_collision(terminal, constraint, _tabled(problem))
        elif isinstance(constraint, Surroundings):
            _tell_surroundings(terminal, constraint)
    around = problem.spec.constraints.surroundings
    if around is not None and not any(isinstance(c, Surroundings) for c in problem.constraints):
        terminal.say("surroundings: no link can come near any of them, so nothing is checked")
    if robot.payload is not None:
        terminal.detail(f"payload: {robot.payload.in_words}, part of the predicted torque")
    for name, words in zip(_symbols(problem), problem.base.in_words(), strict=True):
        terminal.detail(f"  base parameter {name}: {words}")


def _counted_name(constraint: Constraint) -> str:
    """The name of a constraint, with the pairs that it keeps apart."""
    if isinstance(constraint, SelfCollision | Surroundings):
        return f"{constraint.name} ({len(constraint.pairs.checked)} pairs)"
    if isinstance(constraint, MeshClearance):
        return f"{constraint.name} ({len(constraint.labels)} pairs)"
    return constraint.name


def _tell_uncertainty(terminal: Terminal, problem: Problem) -> None:
    spec = problem.spec.uncertainty
    if spec is None:
        return
    held = [c.name for c in problem.constraints if getattr(c, "uncertainty", None) is not None]
    if not held:
        terminal.say(
            "warning: uncertainty bounds nothing: it concerns constraints.torque, balance and "
            "contact, and none of them is asked for"
        )
        return
    known = f", and within {spec.sigmas:g} standard deviations of {spec.fit}" if spec.fit else ""
    terminal.detail(
        f"{', '.join(held)}: for every inertia within {spec.mass:.3g} of the mass, "
        f"{spec.center_of_mass:.3g} m of the centre of mass and {spec.inertia:.3g} of the inertia "
        f"of each body{' (others for some)' if spec.bodies else ''}{known}"
    )


def _tell_effects(terminal: Terminal, problem: Problem) -> None:
    extension, spec = problem.extension, problem.spec
    if extension.names:
        counts = Counter(effect.kind for effect in extension.effects)
        listed = ", ".join(f"{kind} ({count})" for kind, count in counts.items())
        terminal.detail(
            f"effects in the regressor: {listed}; {len(extension.names)} columns, each scaled to "
            "the size of the median inertial column"
        )
    for reason in extension.left_out:
        terminal.say(f"left out of the regressor: {reason}")
    if extension.fine:
        terminal.detail(
            "cost samples are those of the constraints: an effect needs time derivatives"
        )
    if spec.effects is None and declared_effects(None, problem.robot):
        terminal.say(
            "the friction of the URDF's <dynamics> is not in the regressor; list it under effects "
            "to plan for it"
        )
    for name in extension.names:
        terminal.detail(f"  effect column {name}")


def _tabled(problem: Problem) -> tuple[tuple[str, str], ...]:
    """Pairs of links that are kept apart by tables of their meshes' distances."""
    found = next((c.tables for c in problem.constraints if isinstance(c, MeshClearance)), ())
    return tuple((table.first, table.second) for table in found)


def _tell_self_collision(
    terminal: Terminal, constraint: SelfCollision, tabled: tuple[tuple[str, str], ...]
) -> None:
    pairs = constraint.pairs
    terminal.detail(
        f"self-collision: {len(constraint.capsules)} capsules, {len(pairs.checked)} pairs "
        f"checked; not checked: {_reasons(pairs)}"
    )
    if tabled:
        terminal.detail(
            "kept apart by their meshes, since their capsules overlap whatever the posture: "
            f"{'; '.join(map(' – '.join, tabled))}"
        )
    loose = {
        f"{links.first} – {links.second} {links.percent}%"
        for pair in pairs.dropped
        for links in pair.reason.apart
        if links.percent < 100 and (links.first, links.second) not in tabled
    }
    if loose:
        terminal.say(
            "warning: not guarded, since their capsules overlap whatever the posture "
            "(links and the share of postures in which their meshes are apart): "
            f"{'; '.join(sorted(loose))}. Look at these with `excite check`, or give slimmer "
            "capsules under constraints.self_collision.capsules."
        )
    _tell_each(terminal, constraint)


def _tell_surroundings(terminal: Terminal, constraint: Surroundings) -> None:
    pairs = constraint.pairs
    things = ", ".join(obstacle.name for obstacle in constraint.obstacles)
    terminal.detail(
        f"surroundings: {things}; {len(pairs.checked)} pairs of a capsule and a thing checked; not "
        f"checked: {_reasons(pairs)}"
    )
    most = float(pairs.kept.max())
    closer = [
        f"{label} {kept:.3f} m"
        for label, kept in zip(constraint.labels, pairs.kept, strict=True)
        if kept < most
    ]
    if closer:
        terminal.say(
            "these never get far from each other, so half of the farthest is kept instead of "
            f"{most:g} m: {'; '.join(closer)}"
        )
    touching = [
        f"{pair.first} – {pair.second} {reason_in_words(pair.reason)}"
        for pair in pairs.dropped
        if pair.reason.why is Why.ALWAYS_TOUCHING
    ]
    if touching:
        terminal.say(
            f"warning: not guarded, since no motion parts them: {'; '.join(touching)}. Right for a "
            "robot that stands there; else correct constraints.surroundings."
        )
    _tell_each(terminal, constraint)


def _tell_each(terminal: Terminal, constraint: SelfCollision | Surroundings) -> None:
    for label in constraint.labels:
        terminal.detail(f"  checked  {label}")
    for pair in constraint.pairs.dropped:
        terminal.detail(f"  dropped  {dropped_in_words(pair)}")


def _reasons(pairs: CollisionPairs | ObstaclePairs) -> str:
    """How many pairs were dropped for each reason, figures in the reasons left aside."""
    counts = Counter(pair.reason.why for pair in pairs.dropped)
    told = (f"{count} {why_in_words(why)}" for why, count in counts.most_common())
    return ", ".join(told) or "none"


def _symbols(problem: Problem) -> list[str]:
    return [problem.base.names[index] for index in problem.base.selection]
