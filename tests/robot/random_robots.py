"""Random robots for property tests, built the way a user builds his: URDF text, then a spec."""

import tempfile
from pathlib import Path
from typing import Literal

import numpy as np

from excite_cli.config.robot_spec import RobotSpec
from excite_cli.robot.model import Array, Robot, build_robot
from tests.urdf_elements import joint, link, robot_text

Rows = tuple[Literal["joints", "base"], ...]
ROW_CHOICES: tuple[Rows, ...] = (("base", "joints"), ("base",), ("joints",))


def random_robot(
    seed: int,
    joints: int = 5,
    floating: bool = False,
    branches: bool = True,
    prismatic: bool = True,
    rows: Rows | None = None,
    folder: Path | None = None,
) -> Robot:
    """A robot with `joints` moved joints, the same for the same arguments.

    Without `branches` it is a chain, without `prismatic` all joints turn. `rows` are drawn for a
    floating base if they are not given. The URDF stays in `folder`; without one it is forgotten
    once it is loaded.
    """
    if folder is None:
        with tempfile.TemporaryDirectory() as temporary:
            return random_robot(seed, joints, floating, branches, prismatic, rows, Path(temporary))
    rng = np.random.default_rng(seed)
    path = folder / f"random_{seed}.urdf"
    path.write_text(random_urdf(rng, joints, branches, prismatic), encoding="utf-8")
    if rows is None:
        rows = ROW_CHOICES[rng.integers(len(ROW_CHOICES))] if floating else ("joints",)
    roll, pitch, yaw = (float(angle) for angle in rng.uniform(-1.5, 1.5, 3))
    spec = RobotSpec(
        urdf=path.name,
        base="floating" if floating else "fixed",
        base_orientation=(roll, pitch, yaw),
        rows=rows,
    )
    return build_robot(spec, relative_to=folder)


def random_urdf(
    rng: np.random.Generator, joints: int, branches: bool = True, prismatic: bool = True
) -> str:
    """URDF text of a tree of `joints` + 1 links named link_0 …; joint_k carries link_k."""
    parts = [_link(rng, 0)]
    for k in range(1, joints + 1):
        parent = int(rng.integers(k)) if branches else k - 1
        kind = "prismatic" if prismatic and rng.random() < 0.3 else "revolute"
        axis = rng.normal(size=3) if rng.random() < 0.5 else np.eye(3)[rng.integers(3)]
        lower, upper = -rng.uniform(0.3, 2.5), rng.uniform(0.3, 2.5)
        parts.append(_link(rng, k))
        place, turn = _text(rng.uniform(-0.5, 0.5, 3)), _text(rng.uniform(-3, 3, 3))
        limits = (
            f'lower="{lower}" upper="{upper}" velocity="{rng.uniform(0.5, 4)}" '
            f'effort="{rng.uniform(10, 200)}"'
        )
        ends, along = (f"link_{parent}", f"link_{k}"), _text(axis / np.linalg.norm(axis))
        parts.append(joint(f"joint_{k}", ends, place, along, limits, kind, turn))
    return robot_text("random", *parts)


def _link(rng: np.random.Generator, k: int) -> str:
    """A link whose inertia is that of some mass distribution: I = tr(Σ) 1 − Σ with Σ ≥ 0."""
    mass = rng.uniform(0.2, 8.0)
    root = rng.normal(size=(3, 3)) * 0.1
    second_moments = mass * root @ root.T
    inertia = np.trace(second_moments) * np.eye(3) - second_moments
    moments = _text(inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])
    center, turn = _text(rng.uniform(-0.3, 0.3, 3)), _text(rng.uniform(-3, 3, 3))
    return link(f"link_{k}", mass, moments, center, turn=turn)


def _text(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)
