"""Positions or torques that count the other way round."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from excite_cli.checks.joint_zero import offsets
from excite_cli.checks.setup import Setup
from excite_cli.checks.setup_check import Alternative, Settings, SetupCheck
from excite_cli.checks.textbook_fit import TextbookFit, TextbookShares
from excite_cli.config.spec import Spec


class _Sign(SetupCheck):
    field: str
    key: str
    word: str

    def alternatives(
        self, fit: TextbookFit, setup: Setup, explained: TextbookShares
    ) -> Iterator[Alternative]:
        """Every joint turned round, and all of them."""
        n = len(setup.zero)
        for j in range(n):
            yield Alternative(setup.turned(self.field, j), (j,))
        if n > 1:
            sign = getattr(setup, self.field)
            turned: dict[str, Any] = {self.field: -sign}
            yield Alternative(replace(setup, **turned), tuple(range(n)))

    def sentence(self, names: Sequence[str], before: Setup, after: Setup) -> str:
        """Of which joints."""
        turned = self._turned(before, after)
        every = len(turned) == len(names) > 1
        whose = "every joint" if every else ", ".join(names[j] for j in turned)
        return f"the {self.word} of {whose} has the opposite sign"

    def settings(self, names: Sequence[str], spec: Spec, before: Setup, after: Setup) -> Settings:
        """The sign of each."""
        old = getattr(spec.measurement, self.key)
        turned = [names[j] for j in self._turned(before, after)]
        found = {f"measurement.{self.key}": {**old, **{n: -old.get(n, 1) for n in turned}}}
        if self.field == "q_sign":  # speeds are the positions' own, which was seen to before
            speeds = spec.measurement.velocity_sign
            new = {name: -speeds.get(name, 1) for name in turned}
            found["measurement.velocity_sign"] = {**speeds, **new}
            found |= offsets(names, spec, before, after)
        return found

    def trusted(self, names: Sequence[str], spec: Spec, joints: Sequence[int]) -> Settings:
        """The signs as they are."""
        old = getattr(spec.measurement, self.key)
        return {f"measurement.{self.key}": {names[j]: old.get(names[j], 1) for j in joints}}

    def is_declared(self, name: str, spec: Spec) -> bool:
        """Whether its sign is given."""
        return name in getattr(spec.measurement, self.key)

    def _turned(self, before: Setup, after: Setup) -> list[int]:
        changed = getattr(before, self.field) != getattr(after, self.field)
        return [int(j) for j in np.flatnonzero(changed)]


class PositionSign(_Sign):
    """Signs of positions."""

    name, kind = "signs of positions", "position_sign"
    field, key, word = "q_sign", "position_sign", "position"


class TorqueSign(_Sign):
    """Signs of torques."""

    name, kind = "signs of torques", "torque_sign"
    field, key, word = "tau_sign", "sign", "torque"
