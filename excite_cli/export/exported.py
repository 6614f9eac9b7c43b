"""What an exporter yields: the file's text, and what it could not hold."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from excite_cli.dynamics.rigid_body import RigidBody
from excite_cli.effects.base import Effect, Signals
from excite_cli.effects.catalogue import straight_friction
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.stored_model import StoredModel
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
    "ros2-package": "_dynamics",
    "randomization": "_randomization.json",
    "isaaclab": "_isaaclab.py",
    "mjlab": "_mjlab.py",
    "bam": "_bam.json",
}
OF_DRIVES = ("isaaclab", "mjlab", "bam")  # of robots that follow set points only


# Friction that a simulator has no form for, as the straight line nearest to it.
#
# A model's own viscous and Coulomb terms are what its other friction (curved over speed, growing
# with load) leaves; alone they are no friction of anything. Where a format cannot hold the
# others, all friction of the joint is replaced by
#
#     b v + c sgn v   nearest to   Σ_e C_e θ_e,    b, c ≥ 0,
#
# over the speeds and loads of the data that the model was made of.

_DRAWN, _SEED = 400, 20170529
_SHARE = 0.5  # of the joints' largest speed, where no data are known


def with_straight_friction(
    stored: StoredModel, model: IdentifiedModel, holds: Callable[[Effect, Array], bool]
) -> tuple[IdentifiedModel, tuple[str, ...]]:
    """`model` with straight friction on joints where the format `holds` not all of it; these."""
    robot = stored.robot
    signals = _states(stored)
    kept: list[tuple[Effect, Array]] = []
    joints: list[str] = []
    of_friction = {
        j: [
            (effect, values)
            for effect, values in model.by_effect
            if effect.friction and effect.joints == (j,) and not effect.runs
            and not (effect.over_time or effect.follows_covariate or effect.of_campaign)
        ]
        for j in range(robot.n)
    }  # fmt: skip
    replaced: set[int] = set()
    for j, own in of_friction.items():
        if own and not all(holds(effect, values) for effect, values in own):
            replaced.add(j)
            joints.append(robot.joint_names[j])
            kept += _line(j, own, signals)
    own_effects = [
        (effect, values)
        for effect, values in model.by_effect
        if not any(effect is each for j in replaced for each, _ in of_friction[j])
    ]
    together = [*own_effects, *kept]
    values = np.concatenate([np.zeros(0), *(each for _, each in together)])
    return IdentifiedModel(model.phi, tuple(e for e, _ in together), values), tuple(joints)


def _line(
    joint: int, own: list[tuple[Effect, Array]], signals: Signals
) -> list[tuple[Effect, Array]]:
    moving = np.abs(signals.v[:, joint]) > 10.0 * _slow(signals.v[:, joint])
    torque = sum(effect.torque(signals, values)[:, joint] for effect, values in own)
    straight = straight_friction(joint)
    columns = np.column_stack([effect.columns(signals)[:, 0, 0] for effect in straight])
    found, _ = nnls(columns[moving], np.asarray(torque)[moving])
    return [(effect, np.array([x])) for effect, x in zip(straight, found, strict=True)]


def _slow(v: Array) -> float:
    return 1e-3 * float(np.abs(v).max(initial=1e-9))


def _states(stored: StoredModel) -> Signals:
    """Speeds and loads of the model's own data; without them random ones."""
    robot = stored.robot
    if stored.traces:
        q, v, load = (
            np.concatenate([getattr(trace, name) for trace in stored.traces])
            for name in ("q", "v", "load")
        )
    else:
        q, v, _ = robot.draw_states(_DRAWN, seed=_SEED)
        v = _SHARE * v
        load = RigidBody(robot, stored.model.phi, q, 0 * v, 0 * v).load
    body = RigidBody(robot, stored.model.phi, q, v, 0 * v)
    return Signals(np.arange(float(len(q))), q, v, 0 * v, load, load, body)
