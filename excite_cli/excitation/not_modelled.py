"""What no constraint of a problem knows of: what a verdict on its motions does not speak of."""

from collections.abc import Sequence

from excite_cli.config.spec import Spec
from excite_cli.constraints.self_collision import SelfCollision
from excite_cli.excitation.problem import Problem
from excite_cli.robot.model import links_by_joint

_LISTED = 4


def not_modelled(problem: Problem) -> tuple[str, ...]:
    """Things that a motion of `problem` may hit, by name, the most obvious first."""
    return not_in_config(
        problem.spec, [*links_without_shapes(problem), *bodies_without_shapes(problem)]
    )


def not_in_config(spec: Spec, bare: Sequence[str]) -> tuple[str, ...]:
    """The same of a config alone; `bare`: its links or joints that have no shapes."""
    asked, found = spec.constraints, []
    around = asked.surroundings
    if around is None:
        found.append("the floor and all else around the robot (constraints.surroundings)")
    elif around.floor is None and spec.robot.base == "fixed":
        found.append("the floor (constraints.surroundings.floor)")
    elif not around.boxes and not around.walls:
        found.append("all around the robot but the floor (constraints.surroundings)")
    if asked.self_collision is None:
        found.append("the robot's own links (constraints.self_collision)")
    if bare:
        more = f" and {len(bare) - _LISTED} more" if len(bare) > _LISTED else ""
        found.append(f"bodies without shapes: {', '.join(bare[:_LISTED])}{more}")
    return (*found, "cables, hoses and tools that are not in the URDF")


def links_without_shapes(problem: Problem) -> list[str]:
    """Links of `without_shapes` that have none indeed."""
    own, guarded = problem.spec.constraints.self_collision, _guarded(problem)
    if own is None or guarded is None:
        return []
    return [link for link in own.without_shapes if link not in guarded]


def bodies_without_shapes(problem: Problem) -> list[str]:
    """Moved joints whose bodies have mass and no shape, where self-collision is asked for."""
    guarded = _guarded(problem)
    if guarded is None:
        return []
    model, links = problem.robot.model, links_by_joint(problem.robot)
    return [
        joint
        for joint in problem.robot.tree.joint_names
        if model.inertias[model.getJointId(joint)].mass > 0 and not guarded & set(links[joint])
    ]


def _guarded(problem: Problem) -> set[str] | None:
    """Links that capsules keep apart; None where self-collision is not asked for."""
    capsules = [c.capsules for c in problem.constraints if isinstance(c, SelfCollision)]
    return {link for of in capsules for one in of for link in one.links} if capsules else None
