"""A config for a robot of which only the URDF is known: `excite init`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from excite_cli.proposal.propose import Proposal, Request
from excite_cli.proposal.propose import propose as propose_config


def propose(
    urdf: str | Path,
    folder: str | Path = ".",
    *,
    joints: Sequence[str] = (),
    base: Literal["fixed", "floating"] = "fixed",
) -> Proposal:
    """A config for a robot of which nothing but the URDF is known: `excite init`.

    `urdf` is a path (relative to `folder`, where the config will lie) or
    `example-robot-data:<name>`; `joints` those to move, none for a choice of ours. The `text` of
    what is returned is the YAML file, `notes` say what was chosen and why.

    Raises
    ------
    RobotError, ConfigError
        The robot lacks what a plan needs; a joint is unknown.
    NoAdmissibleMotionError
        No posture of the robot is clear of its limits.

    Examples
    --------
    >>> propose("data/smoke_arm.urdf").joints[:2]
    ('shoulder_yaw', 'shoulder_pitch')
    """
    return propose_config(Request(str(urdf), Path(folder), tuple(joints), base))
