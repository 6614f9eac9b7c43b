"""What `excite identify` found, as tables and as data."""

from typing import Any

from rich.table import Table

from excite_cli.cli.layout import table as new_table
from excite_cli.cli.noise_floor_words import floor_cells, floor_columns
from excite_cli.identification.errors_of_torque import Errors
from excite_cli.identification.fit import Fit
from excite_cli.identification.fit_words import (
    above_the_floor,
    consistency_in_words,
    fixed_by_data,
    relative_in_words,
    short_number,
)
from excite_cli.identification.identify import Identification
from excite_cli.robot.model import Robot


def tables_of(found: Identification, robot: Robot) -> list[Table | str]:
    """Parameters, errors per joint, and sentences."""
    low, high = found.error.interval
    fit = found.fit
    sentences = [
        f"Mean relative error on {found.sealed_run}: {found.error.mean_relative:.2%} "
        f"(95 % interval {low:.2%} to {high:.2%}), moving {found.error.mean_relative_moving:.2%}.",
        f"{fit.count} samples carry the information of {fit.samples:.0f} independent ones.",
        f"{found.hausman.sentence()[0].upper()}{found.hausman.sentence()[1:]}.",
    ]
    if fit.consistent is not None:
        sentences.append(consistency_in_words(fit))
    above = above_the_floor(found.error, found.noise_floor)
    return [
        _parameter_table(fit),
        error_table(found.error, found.training_error, robot, found.noise_floor),
        *([above] if above else []),
        *sentences,
    ]


def _parameter_table(fit: Fit) -> Table:
    names = ("parameter", "value", "std", "relative", "unit", "fixed by the data")
    table = new_table("Parameters", names, left=("parameter", "unit", "fixed by the data"))
    for i, name in enumerate(fit.names):
        row = (
            short_number(fit.values[i], 5),
            short_number(fit.std[i], 3),
            relative_in_words(fit.relative_std[i]),
        )
        table.add_row(name, *row, fit.units[i], fixed_by_data(fit, i))
    return table


def error_table(
    error: Errors, training: Errors, robot: Robot, floor: dict[str, float] | None = None
) -> Table:
    """Errors per joint on the sealed part, and the training part's and the noise floor beside."""
    title = "Error of the torque on sealed data (raw: as recorded; training: where it was fitted)"
    names = ("joint", "moving", "all", "RMS", *floor_columns(floor), "raw RMS", "unit", "training")
    table = new_table(title, names, left=("joint", "unit"))
    for joint, sliding in zip(robot.joint_names, robot.sliding, strict=True):
        table.add_row(
            joint,
            f"{error.relative_moving[joint]:.2%}",
            f"{error.relative[joint]:.2%}",
            f"{error.rms[joint]:.4g}",
            *floor_cells(floor, joint),
            f"{error.rms_raw[joint]:.4g}",
            "N" if sliding else "N·m",
            f"{training.relative[joint]:.2%}",
        )
    return table


def answer_of(found: Identification) -> dict[str, Any]:
    """The answer for `--json`."""
    fit = found.fit
    return {
        "parameters": [
            {
                "name": name,
                "value": float(fit.values[i]),
                "std": float(fit.std[i]),
                "relative_std": float(fit.relative_std[i]),
                "identifiable": bool(fit.identifiable[i]),
                "essential": bool(fit.essential[i]),
                "unit": fit.units[i],
            }
            for i, name in enumerate(fit.names)
        ],
        "effects": [
            {
                "kind": effect.kind,
                "joints": [fit.joint_names[j] for j in effect.joints],
                "parameters": {
                    name: {"value": value.value, "std": value.std, "unit": value.unit}
                    for name, value in fit.effect_report(i).items()
                },
            }
            for i, effect in enumerate(fit.effects)
        ],
        "sealed_run": found.sealed_run,
        "error": found.error.as_data(),
        "training_error": found.training_error.as_data(),
        "noise_floor": found.noise_floor,
        "samples": {"count": fit.count, "independent": fit.samples},
        "noise": dict(zip(fit.joint_names, map(float, fit.noise), strict=True)),
        "consistent": None
        if fit.consistent is None
        else {
            "solved": fit.consistent.solved,
            "status": fit.consistent.status,
            "cost": fit.consistent.cost,
            "smallest_eigenvalue": float(fit.consistent.eigenvalues.min()),
        },
        "closed_loop_bias": {
            "testable": found.hausman.testable,
            "p_value": found.hausman.p_value,
            "source": found.hausman.source,
            "text": found.hausman.sentence(),
        },
        "findings": [
            {
                "kind": finding.kind,
                "severity": finding.severity,
                "run": finding.run,
                "text": finding.text,
            }
            for finding in found.findings
        ],
        "processing": found.processing.as_data(),
    }
