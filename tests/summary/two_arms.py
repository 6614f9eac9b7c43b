"""A URDF of two arms that face each other, each of seven joints, as two lab robots on a bench."""

from pathlib import Path

_AXES = ("0 0 1", "0 1 0", "0 0 1", "0 -1 0", "0 0 1", "0 1 0", "0 0 1")
_OFFSETS = (0.16, 0.2, 0.2, 0.2, 0.2, 0.2, 0.1)


def two_arms(path: Path, apart: float = 0.8) -> Path:
    """Write the robot to `path`: visual shapes on all links, collision shapes on the last only."""
    parts = ['<robot name="two_arms"><link name="bench"/>']
    for side, y in (("left", apart / 2), ("right", -apart / 2)):
        parent = "bench"
        for k, (axis, offset) in enumerate(zip(_AXES, _OFFSETS, strict=True), start=1):
            link, place = f"{side}_link_{k}", f"0 {y if k == 1 else 0} {offset}"
            shape = (
                '<origin xyz="0 0 0.07"/><geometry><cylinder radius="0.06" length="0.16"/>'
                "</geometry>"
            )
            solid = f"<collision>{shape}</collision>" if k == len(_AXES) else ""
            parts.append(
                f'<link name="{link}"><inertial><mass value="{8 - k}"/><origin xyz="0.01 0 0.07"/>'
                '<inertia ixx="0.05" iyy="0.05" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial>'
                f"<visual>{shape}</visual>{solid}</link>"
                f'<joint name="{side}_{k}" type="revolute"><origin xyz="{place}"/>'
                f'<parent link="{parent}"/><child link="{link}"/><axis xyz="{axis}"/>'
                '<limit lower="-2.1" upper="2.1" effort="100" velocity="2"/></joint>'
            )
            parent = link
    path.write_text("".join([*parts, "</robot>"]), encoding="utf-8")
    return path
