"""Tables that can be read: condition numbers beside each other, margins, gradients."""

from collections.abc import Sequence
from typing import Any

from rich.table import Table

from excite_cli.cli.layout import table as new_table
from excite_cli.constraints.base import Constraint
from excite_cli.excitation.motion import Motion
from excite_cli.excitation.problem import Problem
from excite_cli.excitation.random_baseline import RandomMotion
from excite_cli.summary.margins import worst_data


def motion_table(motions: Sequence[Motion]) -> Table:
    """Condition numbers of each motion and of the stack (the paper's Table I), status, effort."""
    names = ("motion", "own", "stacked", "status", "iterations", "seconds")
    table = new_table("Condition numbers", names, left=("status",))
    for motion in motions:
        status = motion.status if motion.improved else f"{motion.status}; no improvement"
        table.add_row(
            str(motion.index),
            f"{motion.condition_number:.2f}",
            f"{motion.stacked_condition_number:.2f}",
            status,
            str(motion.iterations),
            f"{motion.seconds:.1f}",
        )
    return table


def margin_table(motions: Sequence[Motion], constraints: Sequence[Constraint]) -> Table:
    """The worst margin of every constraint over all motions, at controller rate."""
    names = ("constraint", "margin", "unit", "where", "motion", "time [s]")
    table = new_table(
        "Worst margins at 1 kHz", names, left=("constraint", "unit"), words=("where",)
    )
    for constraint in constraints:
        motion = min(motions, key=lambda m: m.margins[constraint.name].margin)
        worst = motion.margins[constraint.name]
        table.add_row(
            constraint.name,
            f"{worst.margin:.4f}",
            worst.unit,
            worst.label,
            str(motion.index),
            f"{worst.time:.3f}",
        )
    return table


def comparison_table(optimized: Sequence[Motion], random: Sequence[RandomMotion]) -> Table:
    """The paper's Tables I and II side by side."""
    names = ("motion", "optimised", "stacked", "random", "random, stacked", "times worse")
    table = new_table("Condition numbers, optimised and random (the paper's Tables I, II)", names)
    for index in range(max(len(optimized), len(random))):
        first = optimized[index] if index < len(optimized) else None
        second = random[index] if index < len(random) else None
        ratio = (
            f"{second.stacked_condition_number / first.stacked_condition_number:.2f}"
            if first and second
            else ""
        )
        table.add_row(str(index + 1), *_pair(first), *_pair(second), ratio)
    return table


def _pair(motion: Motion | RandomMotion | None) -> tuple[str, str]:
    if motion is None:
        return "", ""
    return f"{motion.condition_number:.1f}", f"{motion.stacked_condition_number:.1f}"


def outlook_table(outlook: dict[str, Any]) -> Table:
    """What the motions are expected to tell apart."""
    title = f"Expected divergence ½Δ; from {outlook['told_apart_from']:g} on, told apart"
    names = ("effect", "alias", "so far", "then", "motions needed")
    table = new_table(title, names, words=("effect", "alias"))
    for pair in outlook["pairs"]:
        needed = pair["motions_needed"]
        table.add_row(
            pair["effect"],
            pair["alias"],
            f"{pair['kl_so_far']:.2g}",
            f"{pair['expected_kl']:.3g}",
            "> 1000" if needed is None else str(needed),
        )
    return table


def motion_data(motion: Motion) -> dict[str, Any]:
    """A motion for `--json`."""
    return {
        "index": motion.index,
        "condition_number": motion.condition_number,
        "stacked_condition_number": motion.stacked_condition_number,
        "improved": motion.improved,
        "status": motion.status,
        "note": motion.note,
        "seconds": motion.seconds,
        "iterations": motion.iterations,
        "evaluations": motion.evaluations,
        "certified": motion.certified,
        "margins": {name: worst_data(worst) for name, worst in motion.margins.items()},
    }


def criterion_data(problem: Problem) -> dict[str, str]:
    """What was minimised and how it was weighted, for `--json`."""
    return {
        "kind": problem.spec.criterion.kind,
        "row_weights": problem.weighting.row_name,
        "column_scaling": problem.weighting.column_name,
    }
