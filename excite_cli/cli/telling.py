"""What is worth saying about a problem before work begins."""

from collections import Counter

from excite_cli.cli.console import Terminal
from excite_cli.constraints.base import Constraint
from excite_cli.effects.catalogue import declared_effects
from excite_cli.excitation.problem import Problem
from excite_cli.geometry.words import dropped_in_words


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
        _tell_constraint(terminal, constraint)
    around = problem.spec.constraints.surroundings
    if around is not None and not any(c.drawing.obstacles for c in problem.constraints):
        terminal.say("surroundings: no link can come near any of them, so nothing is checked")
    if robot.payload is not None:
        terminal.detail(f"payload: {robot.payload.in_words}, part of the predicted torque")
    for name, words in zip(_symbols(problem), problem.base.in_words(), strict=True):
        terminal.detail(f"  base parameter {name}: {words}")


def _counted_name(constraint: Constraint) -> str:
    """The name of a constraint, with the pairs that it keeps apart."""
    if constraint.left_out is None:
        return constraint.name
    return f"{constraint.name} ({len(constraint.labels)} pairs)"


def _tell_uncertainty(terminal: Terminal, problem: Problem) -> None:
    spec = problem.spec.uncertainty
    if spec is None:
        return
    held = [c.name for c in problem.constraints if c.uncertainty is not None]
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


def _tell_constraint(terminal: Terminal, constraint: Constraint) -> None:
    for remark in constraint.remarks:
        (terminal.say if remark.important else terminal.detail)(remark.words)
    if constraint.left_out is None:
        return
    for label in constraint.labels:
        terminal.detail(f"  checked  {label}")
    for pair in constraint.left_out:
        terminal.detail(f"  dropped  {dropped_in_words(pair)}")


def _symbols(problem: Problem) -> list[str]:
    return [problem.base.names[index] for index in problem.base.selection]
