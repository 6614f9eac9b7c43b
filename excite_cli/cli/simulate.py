"""`excite simulate`: planned motions, played on a robot that differs from its model."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from excite_cli.api.outputs import check_outputs
from excite_cli.cli import options
from excite_cli.cli.completion import complete_effect
from excite_cli.cli.console import Terminal
from excite_cli.cli.help_page import OUTPUT

if TYPE_CHECKING:
    from rich.table import Table

    from excite_cli.config.spec import Spec
    from excite_cli.robot.model import Robot
    from excite_cli.simulation.settings import SimulationSettings
    from excite_cli.simulation.simulate import Simulation

_PLAYED, _ROBOT, _MEASURED = "What is played", "The robot", "What is measured"


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
            "KIND@JOINT,…=VALUE,NAME:VALUE,…;runs:RUN|RUN.",
            autocompletion=complete_effect,
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
            help="Takes of each motion, with fresh noise.",
        ),
    ] = 1,
    periods: Annotated[
        int,
        typer.Option(
            "--periods", rich_help_panel=_PLAYED, min=1, help="Periods of a motion in each take."
        ),
    ] = 1,
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
            help="As a share of the joint's torque RMS.",
        ),
    ] = 0.01,
    noise_correlation: Annotated[
        float,
        typer.Option(
            "--noise-correlation",
            rich_help_panel=_MEASURED,
            help="Of the noise, from sample to sample.",
        ),
    ] = 0.0,
    encoder: Annotated[
        float,
        typer.Option(
            "--encoder", rich_help_panel=_MEASURED, help="Resolution of the encoders, in rad (m)."
        ),
    ] = 2e-5,
    inertia_error: Annotated[
        float,
        typer.Option(
            "--inertia-error",
            rich_help_panel=_ROBOT,
            help="Of the robot's inertias against the URDF; 0: none.",
        ),
    ] = 0.2,
    no_declared: Annotated[
        bool,
        typer.Option(
            "--no-declared",
            rich_help_panel=_ROBOT,
            help="The robot lacks the config's own effects.",
        ),
    ] = False,
    torque_limits: Annotated[
        bool,
        typer.Option(
            "--torque-limits",
            rich_help_panel=_ROBOT,
            help="Motors stop at the robot's effort limits.",
        ),
    ] = False,
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
    the effects that the config declares, in plausible sizes, and those given with --effect. What
    was put in is stored in the file's attribute `truth`. With --entry the robot starts and ends at
    rest, and entry and return keep all constraints of the config.

    Examples:
      excite simulate ur10.yaml ur10.h5 -o measured.h5 \\
          --effect load_dependent_friction@elbow_joint=0.06
      excite simulate ur10.yaml ur10.h5 -o loaded.h5 \\
          --effect coulomb_friction@elbow_joint,wrist_1_joint=2 \\
          --effect 'payload@all=1.5;runs:motion_2'
    """
    from dataclasses import replace

    from excite_cli.api.loading import load_case
    from excite_cli.api.motions import load_motions
    from excite_cli.cli.entry_program import playable, posture_from
    from excite_cli.cli.setup import load_problem, single_threaded
    from excite_cli.config.load import load_spec
    from excite_cli.effects.catalogue import declared_effects
    from excite_cli.errors import ConfigError
    from excite_cli.export.timed import repeated
    from excite_cli.measurement.hdf5_writer import write_dataset
    from excite_cli.robot.model import build_robot
    from excite_cli.simulation.engine import load_mujoco
    from excite_cli.simulation.planned_motion import Planned, PlannedMotion, PlannedProgram
    from excite_cli.simulation.planted import parse_planted
    from excite_cli.simulation.settings import SimulationSettings
    from excite_cli.simulation.simulate import run_names
    from excite_cli.simulation.simulate import simulate as simulate_motions

    terminal = Terminal(as_json, quiet, verbose, not no_progress)
    check_outputs({"output": output}, overwrite)
    if posture is not None and not entry:
        raise ConfigError("--from says where --entry starts: give both.")
    with single_threaded():
        spec = load_spec(config, overrides)
        settings = SimulationSettings(
            seed=spec.seed if seed is None else seed,
            rate=rate,
            torque_noise=torque_noise,
            noise_correlation=noise_correlation,
            encoder=encoder,
            inertia_error=inertia_error,
            repeat=repeat,
            periods=1 if entry else periods,
            torque_limits=torque_limits,
        )
        load_mujoco()
        robot = build_robot(spec.robot, config.resolve().parent)
        found = load_motions(load_case(config, overrides or ()), file, motion or (), terminal.tell)
        motions: list[Planned]
        if entry:
            start, problem = posture_from(posture, robot), load_problem(terminal, config, overrides)
            chains = playable(terminal, problem, found, start, periods)
            motions = [PlannedProgram(m.name, c) for m, c in zip(found, chains, strict=True)]
        else:
            motions = [PlannedMotion(m.name, m.trajectory, m.coefficients) for m in found]
            if periods > 1 and not all(motion.periodic for motion in motions):
                chains = [repeated(m, periods, robot.joint_names) for m in found]
                motions = [PlannedProgram(m.name, c) for m, c in zip(found, chains, strict=True)]
                settings = replace(settings, periods=1)
        names = [name for takes in run_names(motions, repeat) for name in takes]
        planted = [p for text in effect or [] for p in parse_planted(text, robot, names)]
        declared = () if no_declared else declared_effects(spec.effects, robot)
        if _converts(spec):
            terminal.say(
                "warning: the config converts recorded positions or torques (measurement: …), but "
                "this file holds rad and N·m at the joints. Read it with a config without that."
            )
        with terminal.live("simulating", len(names)) as show:
            simulation = simulate_motions(robot, motions, settings, planted, declared, show)
        write_dataset(output, simulation.dataset, _attributes(simulation, settings, spec, robot))
    records = [p.record(robot) for p in simulation.truth.effects]
    runs = [
        {
            "name": run.name,
            "samples": len(run.t),
            "duration": run.duration,
            "tracking_error": dict(
                zip(robot.joint_names, map(float, simulation.tracking[run.name]), strict=True)
            ),
        }
        for run in simulation.dataset.runs
    ]
    terminal.answer(
        [_run_table(simulation), *([_effect_table(records)] if records else []), str(output)],
        {"runs": runs, "effects": records, "output": str(output), "seed": settings.seed},
    )


def _converts(spec: "Spec") -> bool:
    """Whether reading with this config changes positions or torques."""
    from excite_cli.config.data_spec import MeasurementSpec

    kept = {"filter", "encoder_step", "topic", "rate"}
    plain, given = MeasurementSpec(), spec.measurement
    return any(
        getattr(given, name) != getattr(plain, name)
        for name in MeasurementSpec.model_fields
        if name not in kept
    )


def _attributes(
    simulation: "Simulation", settings: "SimulationSettings", spec: "Spec", robot: "Robot"
) -> dict[str, object]:
    """What the data file says about its making."""
    import json
    from dataclasses import asdict

    from excite_cli.config.load import spec_as_yaml
    from excite_cli.store.versions import versions

    return {
        "simulated": True,
        "seed": settings.seed,
        "settings": json.dumps(asdict(settings)),
        "truth": json.dumps(simulation.truth.record(robot), ensure_ascii=False),
        "config": spec_as_yaml(spec),
        "versions": json.dumps(versions()),
    }


def _run_table(simulation: "Simulation") -> "Table":
    import numpy as np

    from excite_cli.cli.layout import table as new_table

    names = ("run", "samples", "seconds", "tracking [mrad]", "worst", "joint")
    table = new_table("Runs (tracking: RMS)", names, left=("run", "joint"))
    for run in simulation.dataset.runs:
        error = 1e3 * simulation.tracking[run.name]
        worst = int(np.argmax(error))
        table.add_row(
            run.name,
            str(len(run.t)),
            f"{run.duration:.2f}",
            f"{np.sqrt(np.mean(error**2)):.3f}",
            f"{error[worst]:.3f}",
            simulation.dataset.joint_names[worst],
        )
    return table


def _effect_table(records: list[dict[str, object]]) -> "Table":
    from excite_cli.cli.layout import table as new_table

    names = ("effect", "joints", "parameters", "runs", "declared")
    table = new_table(
        "Effects in the robot", names, ("effect", "declared"), ("joints", "parameters", "runs")
    )
    for record in records:
        parameters, joints = record["parameters"], record["joints"]
        assert isinstance(parameters, dict)
        assert isinstance(joints, list)
        runs = record["runs"]
        values = (
            f"{key} {each['value']:.4g} {'' if each['unit'] == '1' else each['unit']}".strip()
            for key, each in parameters.items()
        )
        table.add_row(
            str(record["kind"]),
            ", ".join(joints),
            ", ".join(values),
            ", ".join(runs) if isinstance(runs, list) and runs else "all",
            "yes" if record["declared"] else "no",
        )
    return table
