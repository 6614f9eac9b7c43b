"""Positions in another unit: counts of another encoder, degrees of a joint without limits."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from excite_cli.checks.base import Alternative, Settings, SetupCheck
from excite_cli.checks.setup import Setup
from excite_cli.checks.textbook_fit import Explained, TextbookFit
from excite_cli.config.spec import Spec
from excite_cli.measurement.torque import RADIANS

_TRIED = (1 / 16, 1 / 8, 1 / 4, 1 / 2, 2.0, 4.0, 8.0, 16.0, np.pi / 180, 180 / np.pi)


class PositionUnit(SetupCheck):
    """Unit of positions of joints that turn."""

    name = "unit of positions"
    kind = "angle"

    def alternatives(
        self, fit: TextbookFit, setup: Setup, explained: Explained
    ) -> Iterator[Alternative]:
        """Encoders of other numbers of bits, degrees and radians."""
        for factor in _TRIED:
            yield Alternative(replace(setup, turn=setup.turn * factor))

    def sentence(self, names: Sequence[str], before: Setup, after: Setup) -> str:
        """How much too large or small."""
        return (
            f"positions are {before.turn / after.turn:.4g} times what explains the torques: their "
            "unit is another one"
        )

    def settings(self, names: Sequence[str], spec: Spec, before: Setup, after: Setup) -> Settings:
        """Rad in one unit of the file."""
        angle = spec.measurement.angle
        known = RADIANS[angle] if isinstance(angle, str) else angle
        unit = known * after.turn / before.turn
        named = [name for name, x in RADIANS.items() if abs(x / unit - 1.0) < 1e-6]
        return {"measurement.angle": named[0] if named else unit}
