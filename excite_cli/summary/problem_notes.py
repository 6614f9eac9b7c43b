"""A problem in words: what is worth saying before work begins, and its tables."""

from collections import Counter
from collections.abc import Iterator
from typing import Any

from excite_cli.checks.bodies import bodies_in_words
from excite_cli.config.spec import Spec
from excite_cli.constraints.base import Constraint
from excite_cli.effects.catalogue import declared_effects
from excite_cli.excitation.problem import Problem
from excite_cli.geometry.reasons import dropped_in_words
from excite_cli.proposal.propose import Proposal
from excite_cli.robot.loops import loops_in_words
from excite_cli.robot.model import Robot
from excite_cli.shown.answer import Answer, Parts, Table, show
from excite_cli.shown.note import Level, Note

# A proposed config in words.


def proposal_answer(found: Proposal, source: str, path: str) -> Answer:
    """What `excite init` answers once the config of the robot `source` is written to `path`."""
    problem = found.settled.problem
    data = {
        "output": path,
        "robot": source,
        "joints": list(found.joints),
        "left_out": {why: list(names) for why, names in found.left_out.items()},
        "base_parameters": problem.base.rank,
        "duration": problem.trajectory.duration,
        "notes": list(found.notes),
    }
    return Answer(
        (*proposal_parts(found), path),
        data,
    )


def proposal_parts(found: Proposal) -> Parts:
    """What moves, and what was chosen and why."""
    return [_in_words(found), *found.notes]


def _in_words(found: Proposal) -> str:
    problem = found.settled.problem
    return (
        f"{problem.robot.name}: moves {len(found.joints)} joints, "
        f"{problem.base.rank} base parameters, {problem.trajectory.duration:.4g} s"
    )


show(Proposal, _in_words, proposal_parts)


def problem_notes(problem: Problem) -> Iterator[Note]:
    """In two lines what was understood, and what a person must know; the rest is detail."""
    robot = problem.robot
    criterion, weighting = problem.spec.criterion, problem.weighting
    extra = len(problem.extension.names)
    effects = f" and {extra} effect column{'s' * (extra > 1)}" if extra else ""
    yield _said(
        f"{robot.name}: {robot.n} joints, {problem.base.rank} {_of(problem)}{effects}, "
        f"{problem.variables} variables; criterion: {criterion.kind}"
    )
    if problem.base.note:
        yield Note(Level.NOTE, problem.base.note)
    moved = set(robot.joint_names)
    cut = [loop for loop in robot.description.loops if moved & set(loop.joints)]
    yield from (_warning(f"{told}.") for told in loops_in_words(cut))
    if bodies := bodies_in_words(robot):
        yield _warning(f"{bodies}.")
    yield from _limits(robot, problem.spec.robot.joints == "all")
    names = ", ".join(_counted_name(constraint) for constraint in problem.constraints) or "none"
    yield _said(f"constraints: {names}")
    yield _detail(
        f"{len(problem.cost_basis.times)} cost and {len(problem.constraint_basis.times)} "
        f"constraint samples; row weights: {weighting.row_name}, column scaling: "
        f"{weighting.column_name}"
    )
    yield from _effects(problem)
    yield from _uncertainty(problem)
    for constraint in problem.constraints:
        yield from _constraint(constraint)
    around = problem.spec.constraints.surroundings
    if around is not None and not any(c.drawing.obstacles for c in problem.constraints):
        yield _said("surroundings: no link can reach them, so nothing is checked")
    if robot.payload is not None:
        yield _detail(f"payload: {robot.payload.in_words}, part of the predicted torque")
    for name, words in zip(_symbols(problem), problem.base.in_words(), strict=True):
        yield _detail(f"  base parameter {name}: {words}")


def spec_parts(spec: Spec) -> Parts:
    """What was given, key by key; everything else is a default."""
    rows = tuple(_given(spec.model_dump(mode="json", exclude_unset=True), ""))
    return [Table("Problem", ("key", "value"), rows, left=("key",), words=("value",))]


def _given(tree: dict[str, Any], above: str) -> Iterator[tuple[str, str]]:
    for name, value in tree.items():
        if isinstance(value, dict) and value:
            yield from _given(value, f"{above}{name}.")
        else:
            yield f"{above}{name}", str(value)


def problem_parts(problem: Problem) -> Parts:
    """What was understood, and the base parameters in words."""
    names = ("base parameter", "in words")
    rows = tuple(zip(_symbols(problem), problem.base.in_words(), strict=True))
    return [*_heard(problem), Table("Base parameters", names, rows, names[:1], names[1:])]


def _heard(problem: Problem) -> list[str]:
    notes = problem_notes(problem)
    return [note.sentence for note in notes if note.level.value > Level.DETAIL.value]


def _said(text: str) -> Note:
    return Note(Level.INFO, text)


def _detail(text: str) -> Note:
    return Note(Level.DETAIL, text)


def _warning(text: str) -> Note:
    return Note(Level.WARNING, text)


def _counted_name(constraint: Constraint) -> str:
    """The name of a constraint, with the pairs that it keeps apart."""
    if constraint.left_out is None:
        return constraint.name
    return f"{constraint.name} ({len(constraint.labels)} pairs)"


def _limits(robot: Robot, every: bool) -> Iterator[Note]:
    """What is odd about limits of joints that move, or would; `every`: all were requested."""
    for name, words in robot.description.reversed_limits.items():
        if name in robot.tree.joint_names:
            yield _warning(f"{words}.")
    held = [f"{name} at {robot.locked[name]:g}" for name in robot.held_joints] if every else []
    if held:
        yield _said(f"not moved, held by equal position limits: {', '.join(held)}")


def _uncertainty(problem: Problem) -> Iterator[Note]:
    spec = problem.spec.uncertainty
    if spec is None:
        return
    held = [c.name for c in problem.constraints if c.uncertainty is not None]
    if not held:
        yield _warning(
            "uncertainty bounds nothing: it concerns constraints.torque, balance and "
            "contact, and none of them is configured"
        )
        return
    known = f", and within {spec.sigmas:g} standard deviations of {spec.fit}" if spec.fit else ""
    yield _detail(
        f"{', '.join(held)}: for every inertia within {spec.mass:.3g} of the mass, "
        f"{spec.center_of_mass:.3g} m of the centre of mass and {spec.inertia:.3g} of the inertia "
        f"of each body{' (others for some)' if spec.bodies else ''}{known}"
    )


def _effects(problem: Problem) -> Iterator[Note]:
    extension, spec = problem.extension, problem.spec
    if extension.names:
        counts = Counter(effect.kind for effect in extension.effects)
        listed = ", ".join(f"{kind} ({count})" for kind, count in counts.items())
        yield _detail(
            f"effects in the regressor: {listed}; {len(extension.names)} columns, each scaled to "
            "the size of the median inertial column"
        )
    for reason in extension.left_out:
        yield _said(f"no column of its own in the regressor: {reason}")
    if extension.fine:
        yield _detail("cost samples are those of the constraints: an effect needs time derivatives")
    if spec.effects is None and declared_effects(None, problem.robot):
        yield _said(
            "the friction of the URDF's <dynamics> is not in the regressor; list it under effects "
            "to plan for it"
        )
    for name in extension.names:
        yield _detail(f"  effect column {name}")


def _constraint(constraint: Constraint) -> Iterator[Note]:
    yield from constraint.remarks
    if constraint.left_out is None:
        return
    for label in constraint.labels:
        yield _detail(f"  checked  {label}")
    for pair in constraint.left_out:
        yield _detail(f"  dropped  {dropped_in_words(pair)}")


def _of(problem: Problem) -> str:
    """What the columns are parameters of."""
    load = problem.spec.criterion.of == "load"
    return "parameters of the load" if load else "base parameters"


def _symbols(problem: Problem) -> list[str]:
    return [problem.base.names[index] for index in problem.base.selection]


show(Problem, lambda problem: "; ".join(_heard(problem)[:2]), problem_parts)
show(
    Spec,
    lambda spec: f"{spec.robot.urdf}; {', '.join(sorted(spec.model_fields_set - {'robot'}))}",
    spec_parts,
)
