"""What an exporter yields: the file's text, and what it could not hold."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from excite_cli.effects.base import Effect
from excite_cli.robot.model import Array


@dataclass(frozen=True)
class ModelText:
    """`text` of the file; `notes`, sentences for the person who uses it."""

    text: str
    notes: tuple[str, ...] = ()


def in_words(effects: Sequence[Effect], joint_names: Sequence[str]) -> str:
    """`spring at axis_2; armature at axis_1, axis_3`."""
    places: dict[str, list[str]] = {}
    for effect in effects:
        at = " and ".join(joint_names[j] for j in effect.joints)
        places.setdefault(effect.kind, []).append(at)
    return "; ".join(f"{kind} at {', '.join(at)}" for kind, at in places.items())


def ten_as_body(ten: Array) -> tuple[float, Array, Array]:
    """Mass [kg], centre of mass (3,) [m] and inertia about it (3, 3) [kg·m²] of ten parameters."""
    mass = float(ten[0])
    center = np.asarray(ten[1:4]) / mass if mass != 0.0 else np.zeros(3)
    ixx, ixy, iyy, ixz, iyz, izz = ten[4:]
    about_origin = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
    lever = center @ center * np.eye(3) - np.outer(center, center)
    return mass, center, about_origin - mass * lever


def number(value: float) -> str:
    """All digits, so that reading gives the same number."""
    return repr(float(value) + 0.0)


def vector(values: Array) -> str:
    """Numbers with spaces between them."""
    return " ".join(number(value) for value in values)


MODEL_FORMATS = {
    "urdf": ".urdf",
    "mjcf": ".xml",
    "yaml": ".yaml",
    "c": ".c",
    "randomization": "_randomization.json",
    "isaaclab": "_isaaclab.py",
    "mjlab": "_mjlab.py",
    "bam": "_bam.json",
}
OF_DRIVES = ("isaaclab", "mjlab", "bam")  # of robots that follow set points only
