"""`excite simulate`: planned motions, played on a robot that differs from its model."""

from pathlib import Path
from typing import Annotated

import typer

from excite_cli.cli import drive, options
from excite_cli.cli.completion import complete_effect
from excite_cli.cli.console import Terminal
from excite_cli.cli.help_page import OUTPUT
from excite_cli.cli.options import start_from

_PLAYED, _ROBOT, _MEASURED = "Playback", "Simulated robot", "Recording"


def simulate(
    config: options.Config,
    file: options.MotionFile,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="The data file, HDF5.", rich_help_panel=OUTPUT)
    ],
    effect: Annotated[
        list[str] | None,
        typer.Option(
            "--effect",
            rich_help_panel=_ROBOT,
            metavar="KIND@JOINT=VALUE",
            help="Put an effect into the robot (may be repeated); in full: "
            "KIND@JOINT,…=VALUE,NAME:VALUE,…, then ;runs:RUN|RUN, then ;covariate:COLUMN.",
            autocompletion=complete_effect,
        ),
    ] = None,
    covariate: Annotated[
        list[str] | None,
        typer.Option(
            "--covariate",
            rich_help_panel=_MEASURED,
            metavar="NAME=START",
            help="A further column that effects may follow (may be repeated); in full: "
            "NAME=START,end:VALUE,time_constant:SECONDS,noise:SD over the campaign, or "
            "NAME=FILE.csv with columns t and NAME.",
        ),
    ] = None,
    motion: Annotated[
        list[int] | None,
        typer.Option(
            "--motion",
            rich_help_panel=_PLAYED,
            min=1,
            help="Play this motion only (may be repeated).",
        ),
    ] = None,
    repeat: Annotated[
        int,
        typer.Option(
            "--repeat",
            rich_help_panel=_PLAYED,
            min=1,
            help="Recordings of each motion, with fresh noise.",
        ),
    ] = 1,
    periods: Annotated[
        int,
        typer.Option(
            "--periods",
            rich_help_panel=_PLAYED,
            min=1,
            help="Periods of a motion in each recording.",
        ),
    ] = 1,
    pause: Annotated[
        float,
        typer.Option(
            "--pause",
            rich_help_panel=_PLAYED,
            help="Seconds between recordings, which then have absolute stamps.",
        ),
    ] = 0.0,
    entry: Annotated[
        bool,
        typer.Option(
            "--entry",
            rich_help_panel=_PLAYED,
            help="Enter each motion from rest at a posture, and go back to it.",
        ),
    ] = False,
    posture: Annotated[
        str | None,
        typer.Option(
            "--from",
            rich_help_panel=_PLAYED,
            metavar="JOINT=VALUE,…",
            help="The posture of --entry [rad, m]; joints not named are at robot.posture.",
        ),
    ] = None,
    rate: Annotated[
        float, typer.Option("--rate", rich_help_panel=_MEASURED, help="Samples per second [Hz].")
    ] = 500.0,
    torque_noise: Annotated[
        float,
        typer.Option(
            "--torque-noise",
            rich_help_panel=_MEASURED,
            help="Torque noise as a share of the joint's RMS torque.",
        ),
    ] = 0.01,
    noise_correlation: Annotated[
        float,
        typer.Option(
            "--noise-correlation",
            rich_help_panel=_MEASURED,
            help="Correlation of the noise from sample to sample.",
        ),
    ] = 0.0,
    encoder: Annotated[
        float,
        typer.Option(
            "--encoder", rich_help_panel=_MEASURED, help="Resolution of the encoders, in rad (m)."
        ),
    ] = 2e-5,
    wrench_noise: Annotated[
        str | None,
        typer.Option(
            "--wrench-noise",
            rich_help_panel=_MEASURED,
            metavar="FORCE,MOMENT",
            help="Noise of wrenches [N, N·m], where robot.rows has base. Default: 2,0.5.",
        ),
    ] = None,
    imu_noise: Annotated[
        str | None,
        typer.Option(
            "--imu-noise",
            rich_help_panel=_MEASURED,
            metavar="ACCELERATION,RATE",
            help="Noise of the base's inertial unit [m/s², rad/s], where the config declares one. "
            "Default: 0.02,0.001.",
        ),
    ] = None,
    inertia_error: Annotated[
        float,
        typer.Option(
            "--inertia-error",
            rich_help_panel=_ROBOT,
            help="Deviation of the robot's inertias from the URDF; 0: none.",
        ),
    ] = 0.2,
    no_declared: Annotated[
        bool,
        typer.Option(
            "--no-declared",
            rich_help_panel=_ROBOT,
            help="Leave out the effects that the config declares.",
        ),
    ] = False,
    torque_limits: Annotated[
        bool,
        typer.Option(
            "--torque-limits",
            rich_help_panel=_ROBOT,
            help="Motors saturate at the robot's effort limits.",
        ),
    ] = False,
    control: drive.ControlOption = drive.Control.TRACKING,
    kp: drive.Kp = None,
    kd: drive.Kd = None,
    command_rate: drive.CommandRate = None,
    command_delay: drive.CommandDelay = None,
    set_point_speeds: drive.SetPointSpeeds = False,
    seed: options.Seed = None,
    overrides: options.Set = None,
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
    no_progress: options.NoProgress = False,
) -> None:
    """Play motions on a MuJoCo robot and record them as measured data.

    The robot has a tracking controller, encoders, torque noise, inertias that differ from the URDF,
    the effects that the config declares, in plausible sizes, and those given with --effect. The
    ground truth is stored in the file's attribute `truth`. With --entry the robot starts and ends
    at rest, and entry and return keep all constraints of the config.

    With --control position the drives follow set points, τ = kp (q* - q) + kd (v* - v), and the
    log holds t, q, q_cmd (v_cmd) and no torque, as of quadrupeds and servos; gains and delay are
    in `truth`. Motions are planned as ever: what the drives cannot follow, the robot does not do.

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
    from excite_cli.api.simulating import SimulationSettings, parse_series, simulation_answer
    from excite_cli.api.simulating import simulate as simulate_motions
    from excite_cli.api.working import single_threaded
    from excite_cli.cli.base_noise import base_noise

    terminal = Terminal(as_json, quiet, verbose, not no_progress)
    start = start_from(posture, entry)
    with single_threaded():
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
            drive=drive.drive_asked_for(
                control,
                case.robot.joint_names,
                kp,
                kd,
                command_rate,
                command_delay,
                set_point_speeds,
            ),
            **base_noise(case.spec, wrench_noise, imu_noise),
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
    terminal.show(simulation_answer(found, str(output), settings.seed))
