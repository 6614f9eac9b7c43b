"""Options of `excite simulate` for robots whose drives follow position set points."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from excite_cli.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from excite_cli.api.simulating import PositionDrive

PANEL = "Controller"


class Control(StrEnum):
    """What leads the simulated robot."""

    TRACKING = "tracking"
    POSITION = "position"


ControlOption = Annotated[
    Control,
    typer.Option(
        "--control",
        rich_help_panel=PANEL,
        help="tracking: a controller with a model; position: drives that follow set points, whose "
        "log holds positions and set points, but no torque.",
    ),
]
Kp = Annotated[
    list[str] | None,
    typer.Option(
        "--kp",
        rich_help_panel=PANEL,
        metavar="NUMBER|JOINT=NUMBER",
        help="With --control position: stiffness of the drives [N·m/rad, N/m] (may be repeated).",
    ),
]
Kd = Annotated[
    list[str] | None,
    typer.Option(
        "--kd",
        rich_help_panel=PANEL,
        metavar="NUMBER|JOINT=NUMBER",
        help="With --control position: damping of the drives [N·m·s/rad, N·s/m] (may be repeated).",
    ),
]
CommandRate = Annotated[
    float | None,
    typer.Option(
        "--command-rate",
        rich_help_panel=PANEL,
        help="With --control position: set points per second [Hz], held in between. Default: 500.",
    ),
]
CommandDelay = Annotated[
    float | None,
    typer.Option(
        "--command-delay",
        rich_help_panel=PANEL,
        help="With --control position: seconds from sending a set point until it acts. Default: 0.",
    ),
]
SetPointSpeeds = Annotated[
    bool,
    typer.Option(
        "--set-point-speeds",
        rich_help_panel=PANEL,
        help="With --control position: send planned speeds too (v_cmd); without, they are 0.",
    ),
]


def drive_asked_for(
    control: Control,
    joint_names: Sequence[str],
    kp: list[str] | None,
    kd: list[str] | None,
    command_rate: float | None,
    command_delay: float | None,
    set_point_speeds: bool,
) -> PositionDrive | None:
    """The drive that the options describe; None for the tracking controller.

    Raises
    ------
    ConfigError
        Options of drives without --control position, or that without gains; a gain cannot be read.
    """
    from excite_cli.api.simulating import PositionDrive, parse_gains

    options = {
        "--kp": kp, "--kd": kd, "--command-rate": command_rate, "--command-delay": command_delay,
        "--set-point-speeds": set_point_speeds or None,
    }  # fmt: skip
    if control is Control.TRACKING:
        given = [name for name, value in options.items() if value is not None]
        if given:
            raise ConfigError(
                f"{given[0]}: only drives that follow set points have it. Add --control position."
            )
        return None
    missing = [name for name in ("--kp", "--kd") if not options[name]]
    if missing:
        raise ConfigError(
            f"--control position: {' and '.join(missing)} missing. Give the gains of the drives, "
            "for all joints (--kp 20 --kd 0.5) or one by one (--kp elbow=40); 0 is a --kd as well."
        )
    return PositionDrive(
        parse_gains("--kp", kp or (), joint_names),
        parse_gains("--kd", kd or (), joint_names),
        500.0 if command_rate is None else command_rate,
        0.0 if command_delay is None else command_delay,
        set_point_speeds,
    )
