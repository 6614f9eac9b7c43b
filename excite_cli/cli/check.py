"""`excite check`: every motion of a file against every constraint, on a grid of its own."""

from typing import Annotated

import typer

from excite_cli.cli import options
from excite_cli.cli.console import Terminal


def check(
    config: options.Config,
    file: options.ResultFile,
    rate: Annotated[float, typer.Option("--rate", min=1.0, help="Instants per second [Hz].")] = 1e3,
    overrides: options.Set = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
    no_progress: options.NoProgress = False,
) -> None:
    """Re-evaluate the motions of a result file at controller rate.

    Exit status 1: a constraint is broken. Joint bounds of a Fourier series are proved at every
    instant where its samples allow (Ehlich and Zeller); all else holds at the instants checked.

    Example:  excite check configs/talos_arms.yaml talos_arms.h5 --rate 1000
    """
    from rich.table import Table

    from excite_cli.cli.setup import load_problem, single_threaded
    from excite_cli.cli.tables import worst_data
    from excite_cli.config.load import parse_spec
    from excite_cli.errors import FileError
    from excite_cli.excitation.admissible import proved_constraints, worst_margins
    from excite_cli.store.result_file import read_result

    terminal = Terminal(as_json, quiet, verbose, not no_progress)
    with single_threaded():
        result = read_result(file)
        problem = load_problem(terminal, config, overrides)
        if result.joint_names != problem.robot.joint_names:
            raise FileError(
                f"{file} moves other joints than {config}: {', '.join(result.joint_names)}."
            )
        shape = (problem.trajectory.n_coefficients, problem.robot.n)
        stored = parse_spec(result.config, f"the config stored in {file}").trajectory
        same = stored == problem.spec.trajectory
        if not same or any(motion.coefficients.shape != shape for motion in result.motions):
            raise FileError(f"{file} has motions of another trajectory section than {config}.")
        table = Table(title=f"Margins at {rate:g} Hz", title_justify="left")
        for name in (
            "motion",
            "constraint",
            "worst margin",
            "unit",
            "where",
            "time [s]",
            "verdict",
        ):
            right = name in ("motion", "worst margin", "time [s]")
            table.add_column(name, justify="right" if right else "left")
        data, broken = [], 0
        for motion in result.motions:
            margins = worst_margins(problem, motion.coefficients, rate)
            proved = proved_constraints(problem, motion.coefficients)
            violations = sum(worst.violations for worst in margins.values())
            broken += violations
            for constraint in problem.constraints:
                worst = margins[constraint.name]
                verdict = "BROKEN" if worst.margin < 0 else "sampled"
                verdict = "proved" if proved[constraint.name] else verdict
                table.add_row(
                    str(motion.index),
                    constraint.name,
                    f"{worst.margin:.5f}",
                    worst.unit,
                    worst.label,
                    f"{worst.time:.3f}",
                    verdict,
                )
            data.append(
                {
                    "index": motion.index,
                    "margins": {name: worst.margin for name, worst in margins.items()},
                    "worst": {name: worst_data(worst) for name, worst in margins.items()},
                    "violations": violations,
                    "certified": proved,
                }
            )
    summary = f"{broken} violations" if broken else "No violation."
    terminal.answer([table, summary], {"motions": data, "rate": rate})
    if broken:
        raise typer.Exit(1)
