"""Torques from which the controller took the weight away, as some drivers send them."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from excite_cli.checks.setup import Setup
from excite_cli.checks.setup_check import Alternative, Settings, SetupCheck
from excite_cli.checks.textbook_fit import TextbookFit, TextbookShares
from excite_cli.config.spec import Spec


class GravitySubtracted(SetupCheck):
    """Weight in the torques."""

    name = "gravity left in the torques"
    kind = "no_gravity"
    of_all = True

    def alternatives(
        self, fit: TextbookFit, setup: Setup, explained: TextbookShares
    ) -> Iterator[Alternative]:
        """With the weight of the URDF added."""
        if not (setup.weightless or fit.robot.base_joints):
            yield Alternative(replace(setup, weightless=True))

    def sentence(self, names: Sequence[str], before: Setup, after: Setup) -> str:
        """What is missing."""
        return (
            "gravity seems to be subtracted from torques: they fit the motion where the URDF's "
            "weight is added to them. Record the whole torque; or, if the controller subtracted "
            "the weight of this URDF, have it added again"
        )

    def settings(self, names: Sequence[str], spec: Spec, before: Setup, after: Setup) -> Settings:
        """To be added again."""
        return {"measurement.gravity": "subtracted"}
