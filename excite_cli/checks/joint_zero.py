"""A joint that counts from another zero than its description: 90° or 180° off, or any angle."""

from collections.abc import Iterator, Sequence

import numpy as np

from excite_cli.checks.setup import Setup
from excite_cli.checks.setup_check import Alternative, Settings, SetupCheck, descended
from excite_cli.checks.textbook_fit import TextbookFit, TextbookShares
from excite_cli.config.spec import Spec

# Of steps of 15° alone, one towards a zero that is less than 7.5° off explains less than none: an
# elbow 6.6° off ranked behind joints that show no zero, and a wrist of parallel axis was moved.
_COARSE = np.radians([5.0, 15.0, 45.0, 90.0, 135.0, 180.0, -135.0, -90.0, -45.0, -15.0, -5.0])
_FINE = np.radians([22.5, 11.2, 5.6, 2.8, 1.4, 0.7, 0.35])  # half steps
# Price, in L, of an angle that is no right one: a payload that is not in the URDF looks like 12°.
_ODD = 1.0
_QUARTER, _NEAR = np.pi / 2, np.radians(10.0)


class JointZero(SetupCheck):
    """Zero of every joint that turns."""

    name = "zero of every joint"
    kind = "zero"

    def alternatives(
        self, fit: TextbookFit, setup: Setup, explained: TextbookShares
    ) -> Iterator[Alternative]:
        """Angles all around."""
        for j in np.flatnonzero(~fit.robot.sliding).tolist():
            for step in _COARSE:
                angle = (setup.zero[j] + step + np.pi) % (2 * np.pi) - np.pi
                yield Alternative(setup.from_zero(j, float(angle)), (j,))

    def refined(self, fit: TextbookFit, found: Alternative) -> Iterator[Alternative]:
        """The angle that explains most, from steps that are halved; a right angle near it."""
        (j,) = found.joints

        def moved(setup: Setup, step: float) -> Setup:
            return setup.from_zero(j, setup.zero[j] + step)

        setup, _ = descended(fit, found.setup, _FINE, moved)
        quarter = round(setup.zero[j] / _QUARTER) * _QUARTER
        yield Alternative(setup, found.joints, price=_ODD)
        if abs(quarter - setup.zero[j]) < _NEAR:
            yield Alternative(setup.from_zero(j, quarter), found.joints, is_plain=True)

    def sentence(self, names: Sequence[str], before: Setup, after: Setup) -> str:
        """Whose zero is where."""
        moved = np.flatnonzero(np.abs(after.zero - before.zero) > 1e-9).tolist()
        told = [f"{names[j]} {np.degrees(after.zero[j] - before.zero[j]):+.3g}°" for j in moved]
        return (
            f"zeros lie elsewhere than the URDF's: positions are to be moved by {', '.join(told)}"
        )

    def settings(self, names: Sequence[str], spec: Spec, before: Setup, after: Setup) -> Settings:
        """What is added to the positions."""
        return offsets(names, spec, before, after)

    def is_declared(self, name: str, spec: Spec) -> bool:
        """Whether its zero is given."""
        return name in spec.measurement.offset


def offsets(names: Sequence[str], spec: Spec, before: Setup, after: Setup) -> Settings:
    """What is added to positions: a sign that is turned turns what was added before, too."""
    old = spec.measurement.offset
    turned = after.q_sign * before.q_sign
    new = {
        name: round(float(old.get(name, 0.0) * turned[j] + after.zero[j] - before.zero[j]), 5)
        for j, name in enumerate(names)
    }
    changed = {name: x for name, x in new.items() if x != round(old.get(name, 0.0), 5)}
    return {"measurement.offset": {**old, **changed}} if changed else {}
