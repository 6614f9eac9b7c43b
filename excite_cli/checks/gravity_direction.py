"""A robot on a wall, under a ceiling, on a leaning table, whose description stands upright.

The weight of bodies φ is linear in gravity, τ_g = G(q, φ) g. So g is fitted together with bodies,
friction, rotors and offsets, at the bodies found so far, in turn; its length is known.
"""

import itertools
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from excite_cli.checks.setup import Setup
from excite_cli.checks.setup_check import Alternative, Settings, SetupCheck
from excite_cli.checks.textbook_fit import TextbookFit, TextbookShares
from excite_cli.config.spec import Spec
from excite_cli.robot.model import Array

_ROUNDS = 6
_SAME = np.radians(0.3)  # a direction nearer than this is the same
_NEAR = np.radians(6.0)  # to a wall, a ceiling, or half way between
_TILT = np.radians(5.0)  # effects are sought that far
_LEANS = 30.0  # deg: more is no table
_DIGITS = 4  # of angles [rad] that are written
# Unit vectors along an axis, or half way between two.
_PLAIN = [
    np.array(way) / np.linalg.norm(way)
    for way in itertools.product((-1.0, 0.0, 1.0), repeat=3)
    if 1 <= np.count_nonzero(way) <= 2
]


class GravityDirection(SetupCheck):
    """Direction of gravity."""

    name = "direction of gravity"
    kind = "mount"
    effect = "base_tilt"

    def alternatives(
        self, fit: TextbookFit, setup: Setup, explained: TextbookShares
    ) -> Iterator[Alternative]:
        """The direction that fits as it is linear; walls, the ceiling, and half way between."""
        held = not (fit.robot.floating or fit.robot.base_joints)
        if not (held and setup.gravity.any() and explained.judged.any()):
            return
        for direction in (fit.gravity(setup), *_PLAIN):
            gravity = direction * _size(setup.gravity)
            if _angle(gravity, setup.gravity) > _SAME:
                yield Alternative(replace(setup, gravity=gravity))

    def refined(self, fit: TextbookFit, found: Alternative) -> Iterator[Alternative]:
        """The direction that explains most, and the plain one next to it, if it is near."""
        setup, best = found.setup, fit(found.setup)
        for _ in range(_ROUNDS):
            gravity = fit.gravity(setup, best.z) * _size(setup.gravity)
            tried = replace(setup, gravity=gravity)
            if (now := fit(tried)).loss >= best.loss:
                break
            setup, best = tried, now
        yield replace(found, setup=setup)
        plain = min(_PLAIN, key=lambda each: _angle(each, setup.gravity))
        if _angle(plain, setup.gravity) < _NEAR:
            turned = replace(setup, gravity=plain * _size(setup.gravity))
            yield replace(found, setup=turned, is_plain=True)

    def sentence(self, names: Sequence[str], before: Setup, after: Setup) -> str:
        """How far the robot is turned."""
        angle = np.degrees(_angle(before.gravity, after.gravity))
        hangs = "leans" if angle < _LEANS else "hangs on a wall, under a ceiling, or leans"
        along = ", ".join(f"{x:.2f}" for x in after.gravity)
        return (
            f"gravity is ({along}) m/s² in the frame of the base, {angle:.3g}° from the config's: "
            f"the robot {hangs}"
        )

    def has_effect(self, before: Setup, after: Setup) -> bool:
        """A base that leans by a few degrees is one."""
        return _angle(before.gravity, after.gravity) < _TILT

    def settings(self, names: Sequence[str], spec: Spec, before: Setup, after: Setup) -> Settings:
        """Roll, pitch, yaw of the base that turn gravity to where it is."""
        turn, _ = Rotation.align_vectors([before.gravity], [after.gravity])
        old = Rotation.from_euler("xyz", spec.robot.base_orientation)
        with warnings.catch_warnings():  # a wall is where roll and yaw are one
            warnings.simplefilter("ignore", UserWarning)
            angles = (turn * old).as_euler("xyz")
        return {"robot.base_orientation": [round(float(x), _DIGITS) + 0.0 for x in angles]}


def _size(gravity: Array) -> float:
    return float(np.linalg.norm(gravity))


def _angle(a: Array, b: Array) -> float:
    cosine = float(a @ b / (np.linalg.norm(a) * np.linalg.norm(b)))
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)))
