"""A tool or a load on a last link that the description does not have."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from excite_cli.checks.setup import Setup
from excite_cli.checks.setup_check import Alternative, Settings, SetupCheck
from excite_cli.checks.textbook_fit import TextbookFit, TextbookShares
from excite_cli.config.spec import Spec

_PRICE = 2.0  # in L: ten numbers more; a sound UR10 gains 1.9 by them, one with 2 kg more than 3


class Tool(SetupCheck):
    """What a last link carries. It is the robot's own, and never a fault: a fit finds it."""

    name = "tool or load"
    kind = "tool"
    is_physical = True

    def alternatives(
        self, fit: TextbookFit, setup: Setup, explained: TextbookShares
    ) -> Iterator[Alternative]:
        """Nearly any body in place of each last one."""
        parents = set(fit.robot.model.parents)
        for body in range(fit.robot.model.njoints - 1):
            if body + 1 not in parents and body not in setup.loaded:
                loaded = (*setup.loaded, body)
                yield Alternative(replace(setup, loaded=loaded), variant=str(body), price=_PRICE)

    def sentence(self, names: Sequence[str], before: Setup, after: Setup) -> str:
        """That there is one."""
        return (
            "the last link carries what the description does not have: a gripper, a tool, a load. "
            "Put it into the URDF or robot.payload; `excite identify` and `diagnose` find it, too"
        )

    def settings(self, names: Sequence[str], spec: Spec, before: Setup, after: Setup) -> Settings:
        """None: only the person knows what it is."""
        return {}
