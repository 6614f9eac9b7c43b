"""Motors that drive joints together (`robot.transmissions`).

With θ the positions of the motors, in the order of the joints that they stand for,

    q = T θ,        and, by virtual work,        τ_motor = Tᵀ τ,

T being the identity but for the blocks of the transmissions. Where a channel is recorded at the
motors, a column of a motor takes the place of its joint's until it is converted.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.config.robot_spec import JointLimits, TransmissionSpec
from excite_cli.errors import ConfigError, nearest
from excite_cli.measurement.dataset import Array, Run
from excite_cli.measurement.reader import RawRun
from excite_cli.measurement.torque_sources.catalogue import torque_source

_SINGULAR = 1e8


@dataclass(frozen=True)
class Motors:
    """What drives the n moved joints `joints`: `names` (n,), a joint's own where it is its motor.

    `matrix` T (n, n); `limits` of motors by name.
    """

    joints: tuple[str, ...]
    names: tuple[str, ...]
    matrix: Array
    limits: Mapping[str, JointLimits]

    @property
    def places(self) -> dict[str, str]:
        """The joint that each motor of a transmission stands for."""
        pairs = zip(self.names, self.joints, strict=True)
        return {name: joint for name, joint in pairs if name != joint}

    def bounds(self, key: str) -> Array:
        """Limits (n,) of the motors by their key, `velocity` to `effort`; infinite without."""
        given = (getattr(self.limits.get(name), key, None) for name in self.names)
        return np.array([np.inf if value is None else float(value) for value in given])

    def ranges(self) -> tuple[Array, Array]:
        """Lower and upper positions (n,) of the motors; infinite where none are given."""
        given = [getattr(self.limits.get(name), "position", None) for name in self.names]
        lower = np.array([-np.inf if value is None else value[0] for value in given])
        return lower, np.array([np.inf if value is None else value[1] for value in given])

    def renamed(self, raw: RawRun, spec: MeasurementSpec) -> RawRun:
        """The recording with motors' columns in the places of their joints, where they are meant.

        What the joint's own column holds in such a channel stays under `…_of_the_joint`.
        """
        places = self.places
        columns: dict[str, Mapping[str, Array]] = {}
        for channel, own in raw.columns.items():
            given = {spec.names.get(name, name): values for name, values in own.items()}
            motors = {places[name]: given[name] for name in given if name in places}
            if not motors or not at_motors(channel, spec):
                columns[channel] = own
                continue
            kept = {
                f"{name}_of_the_joint" if name in motors else name: values
                for name, values in given.items()
                if name not in places
            }
            columns[channel] = {**kept, **motors}
        return replace(raw, columns=columns)

    def positions(self, theta: Array) -> Array:
        """Positions or speeds of the joints (T, n) from those of the motors."""
        return _combined(theta, self.matrix)

    def at_joints(self, run: Run, spec: MeasurementSpec) -> Run:
        """Torques of the joints in place of those of the motors, valid where all of them are."""
        if not at_motors("tau", spec):
            return run
        back: Array = np.asarray(np.linalg.inv(self.matrix).T, dtype=float)
        valid = run.valid
        if valid is not None:
            valid = _combined(np.where(valid, 0.0, 1.0), np.abs(back)) == 0.0
        return replace(run, tau=_combined(run.tau, back), valid=valid)


def motors_of(transmissions: Sequence[TransmissionSpec], joints: tuple[str, ...]) -> Motors | None:
    """The motors of a robot that moves `joints`; None where each joint is its own.

    Transmissions of which no joint moves are left out.

    Raises
    ------
    ConfigError
        Names do not fit, or a matrix cannot be inverted.
    """
    matrix, names, limits = np.eye(len(joints)), list(joints), dict[str, JointLimits]()
    driven = Counter(joint for each in transmissions for joint in each.joints)
    called = Counter(motor for each in transmissions for motor in each.motors)
    for k, each in enumerate(transmissions):
        where = f"robot.transmissions[{k}]"
        moved = [joint for joint in each.joints if joint in joints]
        if not moved:
            continue
        for joint in each.joints:
            if joint not in joints:
                raise ConfigError(
                    f"{where}.joints: '{joint}' is not a moved joint.{nearest(joint, joints)} The "
                    f"motors move all of {', '.join(each.joints)}: move all of them, or none. "
                    f"Moved joints: {', '.join(joints)}."
                )
            if driven[joint] > 1:
                raise ConfigError(f"{where}.joints: '{joint}' is driven twice; name it once.")
        for motor in each.motors:
            if called[motor] > 1 or motor in joints:
                raise ConfigError(
                    f"{where}.motors: '{motor}' is another motor or joint already; give every "
                    "motor a name of its own."
                )
        block = np.array(each.matrix)
        if np.linalg.cond(block) > _SINGULAR:
            raise ConfigError(
                f"{where}.matrix cannot be inverted: some motion of {', '.join(each.motors)} would "
                "move no joint. Joint positions are matrix · motor positions."
            )
        at = [joints.index(joint) for joint in each.joints]
        matrix[np.ix_(at, at)] = block
        for place, motor in zip(at, each.motors, strict=True):
            names[place] = motor
        limits.update(each.limits)
    if names == list(joints):
        return None
    return Motors(joints, tuple(names), matrix, limits)


def at_motors(channel: str, spec: MeasurementSpec) -> bool:
    """Whether a channel is recorded at the motors; whether samples count goes with the torque."""
    if channel in ("q", "dq"):
        return spec.position == "motor"
    return torque_source(spec).at_motor


def _combined(x: Array, matrix: Array) -> Array:
    """x·matrixᵀ (T, n); what is missing in one column spoils only those that it has a part in."""
    found = np.zeros_like(x)
    for j, k in np.argwhere(matrix):
        found[:, j] += matrix[j, k] * x[:, k]
    return found
