"""Torques of motors that turn coupled joints, taken for torques of the joints."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from excite_cli.checks.setup import Coupling, Setup
from excite_cli.checks.setup_check import Alternative, Settings, SetupCheck
from excite_cli.checks.textbook_fit import TextbookFit, TextbookShares
from excite_cli.config.spec import Spec

_PRICE = 0.5  # in L: few robots have such wrists; a TX40 gains 1.3, and needs 0.5 (`CLEAR`) more
# Share of the shaft's friction in the other joint's torque from which it is in both: then these are
# torques of joints, and friction of coupled gears is what `diagnose` names.
_IN_BOTH = 0.3


class CoupledMotors(SetupCheck):
    """A motor that turns with v_k ± v_j, in the torque of which alone its friction shows."""

    name = "coupling of motors"
    kind = "coupling"
    is_physical = True

    def alternatives(
        self, fit: TextbookFit, setup: Setup, explained: TextbookShares
    ) -> Iterator[Alternative]:
        """Either motor of a joint and the one that it carries turns with both."""
        first = fit.robot.base_joints
        pairs = [(j, k) for k, j in enumerate(fit.robot.parents) if j >= first]
        judged = [pair for pair in pairs if explained.judged[list(pair)].all()]
        either = [each for j, k in judged for each in ((j, k), (k, j))]
        if setup.coupled is None:
            for (other, own), way in product(either, (1.0, -1.0)):
                coupled = replace(setup, coupled=Coupling(other, own, way))
                yield Alternative(coupled, (other, own), price=_PRICE)

    def refined(self, fit: TextbookFit, found: Alternative) -> Iterator[Alternative]:
        """Itself, unless the shaft's friction is in both torques."""
        coupled, explained = found.setup.coupled, fit(found.setup)
        assert coupled is not None
        if not explained.judged[[coupled.other, coupled.own]].all():
            return
        at = fit.counted(found.setup)[:, [coupled.other, coupled.own]].all(axis=1)
        columns = fit.passive(found.setup)
        shaft = coupled.way * columns[coupled.own][at] @ explained.passive[coupled.own]
        others = columns[coupled.other][at]
        shaft -= others @ np.linalg.lstsq(others, shaft, rcond=None)[0]
        left = fit.left(found.setup, explained)[at, coupled.other]
        if left @ shaft < _IN_BOTH * (shaft @ shaft):
            yield found

    def has_effect(self, before: Setup, after: Setup) -> bool:
        """No effect undoes it."""
        return False

    def sentence(self, names: Sequence[str], before: Setup, after: Setup) -> str:
        """Whose torques they seem to be."""
        assert after.coupled is not None
        other, own = names[after.coupled.other], names[after.coupled.own]
        return (
            f"the torques of {other} and {own} are those of their motors: the friction of {own} "
            f"follows the speed of {other} too, and shows in its own torque alone"
        )

    def settings(self, names: Sequence[str], spec: Spec, before: Setup, after: Setup) -> Settings:
        """The share of the coupled motor's torque that the other joint has."""
        assert after.coupled is not None
        other, own = names[after.coupled.other], names[after.coupled.own]
        given = spec.measurement.coupling
        return {
            "measurement.coupling": {
                **given,
                other: {**given.get(other, {}), own: after.coupled.way},
            }
        }

    def is_declared(self, name: str, spec: Spec) -> bool:
        """Whether its motor, or the share of another one, is described."""
        shares = spec.measurement.coupling
        driven = [joint for each in spec.robot.transmissions for joint in each.joints]
        return name in (*driven, *shares, *(own for each in shares.values() for own in each))
