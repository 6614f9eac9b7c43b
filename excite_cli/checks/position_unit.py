"""Positions in another unit: counts of another encoder, degrees of joints without limits."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from excite_cli.checks.setup import Setup
from excite_cli.checks.setup_check import Alternative, Settings, SetupCheck
from excite_cli.checks.textbook_fit import TextbookFit, TextbookShares
from excite_cli.config.spec import Spec
from excite_cli.measurement.torque import RADIANS, angle_units

_OF_ANGLES = (np.pi / 180, 180 / np.pi)
_TRIED = (1 / 16, 1 / 8, 1 / 4, 1 / 2, 2.0, 4.0, 8.0, 16.0, *_OF_ANGLES)
_ALONE = 1.0  # price, in L, of one joint in degrees among others in radians: hardly anybody does it


class PositionUnit(SetupCheck):
    """Unit of positions of joints that turn."""

    name = "unit of positions"
    kind = "angle"

    def alternatives(
        self, fit: TextbookFit, setup: Setup, explained: TextbookShares
    ) -> Iterator[Alternative]:
        """Encoders of other numbers of bits; degrees and radians, of each joint too."""
        for factor in _TRIED:
            yield Alternative(replace(setup, turn=setup.turn * factor))
        turning = np.flatnonzero(~fit.robot.sliding).tolist()
        for j in turning if len(turning) > 1 else ():
            for factor in _OF_ANGLES:
                turn = setup.turn * np.where(np.arange(len(setup.turn)) == j, factor, 1.0)
                yield Alternative(replace(setup, turn=turn), (j,), price=_ALONE)

    def sentence(self, names: Sequence[str], before: Setup, after: Setup) -> str:
        """How much too large or small."""
        ratio = before.turn / after.turn
        off = np.flatnonzero(np.abs(np.log(ratio)) > 1e-9).tolist()
        whose = "" if len(off) == len(names) else f" of {', '.join(names[j] for j in off)}"
        return (
            f"positions{whose} are {ratio[off[0]]:.4g} times what explains the torques: their unit "
            "is another one"
        )

    def settings(self, names: Sequence[str], spec: Spec, before: Setup, after: Setup) -> Settings:
        """Rad in one unit of the file."""
        units = angle_units(spec.measurement, tuple(names)) * after.turn / before.turn
        told = [
            next((name for name, x in RADIANS.items() if abs(x / unit - 1.0) < 1e-6), float(unit))
            for unit in units
        ]
        if len({*told}) == 1:
            return {"measurement.angle": told[0]}
        own = {name: unit for name, unit in zip(names, told, strict=True) if unit != "rad"}
        return {"measurement.angle": own}
