"""A URDF of two arms that face each other, each of seven joints, as two lab robots on a bench."""

from pathlib import Path

from tests.urdf_elements import joint, link, robot_text

_AXES = ("0 0 1", "0 1 0", "0 0 1", "0 -1 0", "0 0 1", "0 1 0", "0 0 1")
_OFFSETS = (0.16, 0.2, 0.2, 0.2, 0.2, 0.2, 0.1)
_LIMITS = 'lower="-2.1" upper="2.1" velocity="2" effort="100"'


def two_arms(path: Path, apart: float = 0.8) -> Path:
    """Write the robot to `path`: visual shapes on all links, collision shapes on the last only."""
    parts = ['<link name="bench"/>']
    for side, y in (("left", apart / 2), ("right", -apart / 2)):
        parent = "bench"
        for k, (axis, offset) in enumerate(zip(_AXES, _OFFSETS, strict=True), start=1):
            name, place = f"{side}_link_{k}", f"0 {y if k == 1 else 0} {offset}"
            shape = (
                '<origin xyz="0 0 0.07"/><geometry><cylinder radius="0.06" length="0.16"/>'
                "</geometry>"
            )
            solid = f"<collision>{shape}</collision>" if k == len(_AXES) else ""
            shapes = f"<visual>{shape}</visual>{solid}"
            parts += [
                link(name, 8 - k, "0.05 0.05 0.03", "0.01 0 0.07", shapes),
                joint(f"{side}_{k}", (parent, name), place, axis, _LIMITS),
            ]
            parent = name
    path.write_text(robot_text("two_arms", *parts), encoding="utf-8")
    return path
