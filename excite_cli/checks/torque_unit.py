"""Torques of another unit, of the motor before its gear, or currents; of one joint or of all.

Masses may be wrong by a half, not by a factor of `_FACTOR`. What is found is a number, N·m in a
unit of the file as the masses have it, or the power of ten next to it where that does as well.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from excite_cli.checks.setup import Setup
from excite_cli.checks.setup_check import Alternative, Settings, SetupCheck, descended
from excite_cli.checks.textbook_fit import TextbookFit, TextbookShares
from excite_cli.config.spec import Spec
from excite_cli.measurement.torque_sources.recorded import NEWTON_METERS, torque_units

_FACTOR = 6.0
_TRIED = 10.0 ** np.array([-4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0])
# Bodies must be seen to tell the unit: without their torque, so much in L must be lost.
_WEIGHTLESS, _SEEN, _UNSEEN = 1e3, 0.7, 1.5
_UNKNOWN = 1e6  # N·m in a unit of the file beside which bodies weigh nothing
# Of one joint alone another unit is mN·m, or the motor's side of a gear: hardly ever less than 20.
# Wrists that are mostly friction look like 10 (a UR10's, by a factor of 9).
_GEARS, _RARE = 20.0, 1.0
_FINE = np.log([1.8, 1.35, 1.16, 1.08])  # together half a decade to each side


class TorqueUnit(SetupCheck):
    """Unit of the torques."""

    name = "unit of torques"
    kind = "torque_scale"

    def alternatives(
        self, fit: TextbookFit, setup: Setup, explained: TextbookShares
    ) -> Iterator[Alternative]:
        """Decades, of every joint and of all."""
        n = len(setup.zero)
        groups: list[tuple[int, ...]] = [
            tuple(range(n)),
            *((j,) for j in np.flatnonzero(explained.judged).tolist()),
        ]
        for joints in groups if n > 1 else groups[:1]:
            for factor in _TRIED:
                yield Alternative(_scaled(setup, joints, factor), joints)

    def refined(self, fit: TextbookFit, found: Alternative) -> Iterator[Alternative]:
        """The factor that explains most; and the powers of ten next to it."""

        def moved(setup: Setup, step: float) -> Setup:
            return _scaled(setup, found.joints, float(np.exp(step)))

        setup, loss = descended(fit, found.setup, _FINE, moved)
        unit = setup.unit[found.joints[0]]
        alone = len(found.joints) == 1 < len(setup.unit)
        usual = float(np.median(np.delete(setup.unit, found.joints))) if alone else 1.0
        seen = fit(_scaled(setup, found.joints, _WEIGHTLESS)).loss > loss + _SEEN
        if abs(np.log(unit / usual)) < np.log(_FACTOR):
            return
        if not seen:  # friction alone shows: it is another unit, and nobody knows which
            if len(found.joints) == 1:
                nothing = _scaled(setup, found.joints, _UNKNOWN / unit)
                yield replace(found, setup=nothing, variant="unknown", price=_UNSEEN)
            return
        rare = _RARE if alone and abs(np.log(unit / usual)) < np.log(_GEARS) else 0.0
        yield Alternative(setup, found.joints, price=rare)
        for power in 10.0 ** np.array([np.floor(np.log10(unit)), np.ceil(np.log10(unit))]):
            if power != usual:
                plain = _scaled(setup, found.joints, power / unit)
                yield Alternative(plain, found.joints, price=rare, is_plain=True)

    def sentence(self, names: Sequence[str], before: Setup, after: Setup) -> str:
        """How much too large or small."""
        ratio = before.unit / after.unit
        off = np.flatnonzero(np.abs(np.log(ratio)) > 1e-9).tolist()
        if len(off) == 1 and after.unit[off[0]] >= _UNKNOWN:
            return (
                f"torques of {names[off[0]]} are far smaller than the URDF's bodies require, and "
                "contain only friction: motor-side torque, a wrong unit, or a counterbalance"
            )
        whose = "all joints" if len(off) == len(names) > 1 else ", ".join(names[j] for j in off)
        return (
            f"torques of {whose} are {ratio[off[0]]:.3g} times what bodies like the URDF's ask "
            "for: another unit (mN·m, A, per cent), the motor's torque before its gear "
            "(measurement.torque: motor), or a counterbalance"
        )

    def has_effect(self, before: Setup, after: Setup) -> bool:
        """A torque that holds nothing but friction spoils no effect of other joints."""
        return bool((after.unit >= _UNKNOWN).any())

    def settings(self, names: Sequence[str], spec: Spec, before: Setup, after: Setup) -> Settings:
        """N·m in a unit of the file, of a torque that is declared as of the link."""
        off = np.flatnonzero(np.abs(np.log(after.unit / before.unit)) > 1e-9).tolist()
        if len(off) == 1 and after.unit[off[0]] >= _UNKNOWN:
            left = {*spec.measurement.without_torque, names[off[0]]}
            return {"measurement.without_torque": [name for name in names if name in left]}
        own = torque_units(spec.measurement, tuple(names)) * after.unit / before.unit
        if np.ptp(own) > 1e-9 * own.max():
            return {
                "measurement.torque_unit": {
                    name: float(f"{x:.4g}") for name, x in zip(names, own, strict=True)
                }
            }
        named = [name for name, x in NEWTON_METERS.items() if abs(x / own[0] - 1.0) < 1e-6]
        return {"measurement.torque_unit": named[0] if named else float(f"{own[0]:.4g}")}


def _scaled(setup: Setup, joints: Sequence[int], factor: float) -> Setup:
    unit = setup.unit.copy()
    unit[list(joints)] *= factor
    return replace(setup, unit=unit)
