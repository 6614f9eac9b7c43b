"""`excite simulate`: planned motions, played on a robot that differs from its model."""

import math
from collections.abc import Sequence
from dataclasses import replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from excite_cli.cli import options
from excite_cli.cli.completion import complete_effect
from excite_cli.cli.console import Terminal
from excite_cli.cli.help_page import OUTPUT
from excite_cli.cli.next_step import next_step
from excite_cli.cli.options import start_from
from excite_cli.errors import ConfigError

if TYPE_CHECKING:
    from excite_cli.api.simulating import PositionDrive
    from excite_cli.config.spec import Spec

_played = partial(typer.Option, rich_help_panel="Playback")
_of_robot = partial(typer.Option, rich_help_panel="Simulated robot")
_recorded = partial(typer.Option, rich_help_panel="Recording")
_driven = partial(typer.Option, rich_help_panel="Controller")


class Control(StrEnum):
    """What leads the simulated robot."""

    TRACKING = "tracking"
    POSITION = "position"


@options.command
def simulate(
    terminal: Terminal,
    config: options.Config,
    file: options.MotionFile,
    output: Path = typer.Option(
        ..., "--output", "-o", help="The data file, HDF5.", rich_help_panel=OUTPUT
    ),
    effect: list[str] | None = _of_robot(
        None,
        "--effect",
        metavar="KIND@JOINT=VALUE",
        help="Put an effect into the robot (may be repeated); in full: "
        "KIND@JOINT,…=VALUE,NAME:VALUE,…, then ;runs:RUN|RUN, then ;covariate:COLUMN.",
        autocompletion=complete_effect,
    ),
    covariate: list[str] | None = _recorded(
        None,
        "--covariate",
        metavar="NAME=START",
        help="A further column that effects may follow (may be repeated); in full: "
        "NAME=START,end:VALUE,time_constant:SECONDS,noise:SD over the campaign, or "
        "NAME=FILE.csv with columns t and NAME.",
    ),
    motion: list[int] | None = _played(
        None, "--motion", min=1, help="Play this motion only (may be repeated)."
    ),
    repeat: int = _played(
        1, "--repeat", min=1, help="Recordings of each motion, with fresh noise."
    ),
    periods: int = _played(1, "--periods", min=1, help="Periods of a motion in each recording."),
    pause: float = _played(
        0.0, "--pause", help="Seconds between recordings, which then have absolute stamps."
    ),
    entry: bool = _played(
        False, "--entry", help="Enter each motion from rest at a posture, and go back to it."
    ),
    posture: str | None = _played(
        None,
        "--from",
        metavar="JOINT=VALUE,…",
        help="The posture of --entry [rad, m]; joints not named are at robot.posture.",
    ),
    rate: float = _recorded(500.0, "--rate", help="Samples per second [Hz]."),
    torque_noise: options.TorqueNoise = 0.01,
    noise_correlation: options.NoiseCorrelation = 0.0,
    encoder: options.Encoder = 2e-05,
    wrench_noise: str | None = _recorded(
        None,
        "--wrench-noise",
        metavar="FORCE,MOMENT",
        help="Noise of wrenches [N, N·m], where robot.rows has base. Default: 2,0.5.",
    ),
    imu_noise: str | None = _recorded(
        None,
        "--imu-noise",
        metavar="ACCELERATION,RATE",
        help="Noise of the base's inertial unit [m/s², rad/s], where the config declares "
        "one. Default: 0.02,0.001.",
    ),
    inertia_error: options.InertiaError = 0.2,
    no_declared: bool = _of_robot(
        False, "--no-declared", help="Leave out the effects that the config declares."
    ),
    torque_limits: bool = _of_robot(
        False, "--torque-limits", help="Motors saturate at the robot's effort limits."
    ),
    control: Control | None = _driven(
        None,
        "--control",
        help="tracking: a controller with a model; position: drives that follow set points, whose "
        "log holds positions and set points, but no torque. Default: position where the config "
        "gives measurement.command.kp.",
    ),
    kp: list[str] | None = _driven(
        None,
        "--kp",
        metavar="NUMBER|JOINT=NUMBER",
        help="With --control position: stiffness of the drives [N·m/rad, N/m] (may be repeated). "
        "Default: the config's, and so for --kd and --command-delay.",
    ),
    kd: list[str] | None = _driven(
        None,
        "--kd",
        metavar="NUMBER|JOINT=NUMBER",
        help="With --control position: damping of the drives [N·m·s/rad, N·s/m] (may be repeated).",
    ),
    command_rate: float | None = _driven(
        None,
        "--command-rate",
        help="With --control position: set points per second [Hz], held in between. Default: 500.",
    ),
    command_delay: float | None = _driven(
        None,
        "--command-delay",
        help="With --control position: seconds from sending a set point until it acts.",
    ),
    set_point_speeds: bool = _driven(
        False,
        "--set-point-speeds",
        help="With --control position: send planned speeds too (v_cmd); without, they are 0.",
    ),
    lead: bool = _driven(
        False,
        "--lead",
        help="With --control position: set points lead the motion by what the drives lag behind "
        "it, by the URDF's inertias.",
    ),
    seed: options.Seed = None,
    overrides: options.Set = None,
    overwrite: options.Overwrite = False,
) -> None:
    """Play motions on a MuJoCo robot and record them as measured data.

    The robot has a tracking controller, encoders, torque noise, inertias that differ from the URDF,
    the effects that the config declares, in plausible sizes, and those given with --effect. The
    ground truth is stored in the file's attribute `truth`. With --entry the robot starts and ends
    at rest, and entry and return keep all constraints of the config.

    With --control position the drives follow set points, τ = kp (q* - q) + kd (v* - v), and the
    log holds t, q, q_cmd (v_cmd) and no torque, as of quadrupeds and servos; gains and delay are
    in `truth`. What the drives cannot follow, the robot does not do: constraints.tracking_error
    plans for that, and with --lead the robot plays the motion as it was planned.

    Examples:
      excite simulate ur10.yaml ur10.h5 -o measured.h5 \\
          --effect load_dependent_friction@elbow_joint=0.06
      excite simulate ur10.yaml ur10.h5 -o loaded.h5 --effect payload@all=1.5
      excite simulate ur10.yaml ur10.h5 -o mixed.h5 \\
          --effect coulomb_friction@elbow_joint,wrist_1_joint=2 \\
          --effect 'payload@all=1.5;runs:motion_2'
      excite simulate ur10.yaml ur10.h5 -o warm.h5 --repeat 4 --pause 300 \\
          --covariate temp=25,end:45,time_constant:600,noise:0.2 \\
          --effect 'covariate_friction@elbow_joint=-0.1,reference:25;covariate:temp'
      excite simulate ur10.yaml ur10.h5 -o servo.h5 --control position \\
          --kp 60 --kd 0.5 --kp wrist_1_joint=20 --command-rate 50 \\
          --command-delay 0.01
    """
    from excite_cli.api.loading import load_case
    from excite_cli.api.simulating import (
        SimulationSettings,
        configured_drive,
        parse_series,
        simulation_answer,
    )
    from excite_cli.api.simulating import simulate as simulate_motions

    start = start_from(posture, entry)
    case = load_case(config, overrides or ())
    settings = SimulationSettings(
        seed=case.spec.seed if seed is None else seed,
        rate=rate,
        torque_noise=torque_noise,
        noise_correlation=noise_correlation,
        encoder=encoder,
        inertia_error=inertia_error,
        repeat=repeat,
        periods=periods,
        pause=pause,
        torque_limits=torque_limits,
        covariates=parse_series(covariate or ()),
        drive=_drive(
            control,
            configured_drive(case),
            case.robot.joint_names,
            kp,
            kd,
            command_rate,
            command_delay,
            set_point_speeds,
            lead,
        ),
        **_base_noise(case.spec, wrench_noise, imu_noise),
    )
    with terminal.live("simulating") as line:
        found = simulate_motions(
            case,
            file,
            effect or (),
            settings,
            chosen=motion or (),
            start=start,
            declared=not no_declared,
            output=output,
            overwrite=overwrite,
            progress=line,
            tell=terminal.tell,
        )
    rest = (config, output, "-o", "diagnosis.h5", "--apply", "better.yaml")
    following = next_step("find what the model lacks", "diagnose", *rest)
    terminal.show(simulation_answer(found, str(output), settings.seed), following)


def _drive(
    control: Control | None,
    known: "PositionDrive | None",
    joint_names: Sequence[str],
    kp: list[str] | None,
    kd: list[str] | None,
    command_rate: float | None,
    command_delay: float | None,
    set_point_speeds: bool,
    lead: bool,
) -> "PositionDrive | None":
    """The drive that the options describe, else that `known` from the config; None: tracking.

    Raises
    ------
    ConfigError
        Options of drives without --control position, or that without gains; a gain cannot be read.
    """
    from excite_cli.api.simulating import PositionDrive, parse_gains

    options = {
        "--kp": kp, "--kd": kd, "--command-rate": command_rate, "--command-delay": command_delay,
        "--set-point-speeds": set_point_speeds or None, "--lead": lead or None,
    }  # fmt: skip
    if control is Control.TRACKING or (control is None and known is None):
        given = [name for name, value in options.items() if value is not None]
        if given:
            raise ConfigError(
                f"{given[0]}: only drives that follow set points have it. Add --control position."
            )
        return None
    missing = [name for name in ("--kp", "--kd") if known is None and not options[name]]
    if missing:
        raise ConfigError(
            f"--control position: {' and '.join(missing)} missing. Give the gains of the drives, "
            "for all joints (--kp 20 --kd 0.5) or one by one (--kp elbow=40), or in the config "
            "(measurement.command); 0 is a --kd as well."
        )
    values = {
        "kp": parse_gains("--kp", kp, joint_names) if kp else None,
        "kd": parse_gains("--kd", kd, joint_names) if kd else None,
        "command_rate": command_rate,
        "delay": command_delay,
        "set_point_speeds": set_point_speeds or None,
        "lead": lead or None,
    }
    chosen: dict[str, Any] = {key: value for key, value in values.items() if value is not None}
    return PositionDrive(**chosen) if known is None else replace(known, **chosen)


def _base_noise(spec: "Spec", wrench: str | None, imu: str | None) -> dict[str, float]:
    """Standard deviations by their names in the settings; none of options that are not given.

    Raises
    ------
    ConfigError
        A text is not two numbers, or the config declares no such sensor.
    """
    found: dict[str, float] = {}
    stands = "base" in spec.robot.rows
    if wrench is not None:
        if not stands:
            raise ConfigError(
                "--wrench-noise: no wrench is measured; robot.rows of the config has no 'base'."
            )
        force, moment = _pair("--wrench-noise", wrench, "FORCE,MOMENT [N, N·m]", "2,0.5")
        found |= {"force_noise": force, "moment_noise": moment}
    if imu is not None:
        if not stands or spec.measurement.base.imu is None:
            raise ConfigError(
                "--imu-noise: no inertial unit is declared; it needs measurement.base.imu, and "
                "'base' in robot.rows."
            )
        form = "ACCELERATION,RATE [m/s², rad/s]"
        acceleration, rate = _pair("--imu-noise", imu, form, "0.02,0.001")
        found |= {"acceleration_noise": acceleration, "rate_noise": rate}
    return found


def _pair(option: str, text: str, form: str, example: str) -> tuple[float, float]:
    try:
        first, second = map(float, text.split(","))
    except ValueError:
        first = second = math.nan
    if not (0.0 <= first < math.inf and 0.0 <= second < math.inf):
        raise ConfigError(
            f"{option}: '{text}' is not {form}, two numbers that are not negative; for example "
            f"{option} {example}."
        )
    return first, second
