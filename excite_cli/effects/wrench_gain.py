"""A wrong scale of the measured wrench: w_measured = (1 + g) w, of all its components alike.

That of a force plate, or of the amplifier of a base sensor. Where nothing else is measured and no
inertia is known, all masses take it up.
"""

from typing import ClassVar

from excite_cli.effects.torque_gain import TorqueGain


class WrenchGain(TorqueGain):
    """The rows of the base grow by g · (wrench of the model)."""

    kind: ClassVar = "wrench_gain"
    title: ClassVar = "wrong scale of the measured wrench"
    signature: ClassVar = "the residual has the shape of the wrench itself, in all of its rows"
    scope: ClassVar = "base"
    on_base: ClassVar = False
    identified_by: ClassVar = (
        "the robot's mass is known (identification.total_mass), or one run carries a known payload "
        "(identification.known_payload)"
    )
    can_appear_later: ClassVar = True
    changes_between_runs: ClassVar = False
    excitable: ClassVar = False
    why_not_excitable: ClassVar = "planned motions have a base that stands still"
