"""`excite verify-gradient`: adjoint, the paper's block form and finite differences."""

from excite_cli.cli import options
from excite_cli.cli.console import Terminal


def verify_gradient(
    config: options.Config,
    seed: options.Seed = None,
    overrides: options.Set = None,
    threads: options.Threads = 1,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
    no_progress: options.NoProgress = False,
) -> None:
    """Check the gradient of this problem in three ways and time them.

    The block form is that of the base regressor; effects listed in the config are checked against
    differences. Exit status 1: the adjoint and the block form differ by more than 1e-9, or one of
    them from central differences by more than 1e-7 (relative).

    Examples:
      excite verify-gradient ur10.yaml
    """
    import typer

    from excite_cli.cli.layout import table as new_table
    from excite_cli.cli.setup import load_problem, single_threaded
    from excite_cli.excitation.gradient_check import (
        ADJOINT_BLOCK_LIMIT,
        CENTRAL_LIMIT,
        PAPER_FORWARD_ERROR,
        check_gradient,
    )

    terminal = Terminal(as_json, quiet, verbose, not no_progress)
    extra = ["constraints.self_collision=null"]
    extra += [f"seed={seed}"] if seed is not None else []
    with single_threaded(threads):
        problem = load_problem(terminal, config, overrides, extra)
        with terminal.live("differences of every variable"):
            found = check_gradient(problem, problem.spec.seed)
    table = new_table("Relative error of the gradient", ("pair", "error", "allowed"), ("pair",))
    errors = found.relative_error
    table.add_row(
        "adjoint – block form", f"{errors['adjoint_vs_block']:.1e}", f"{ADJOINT_BLOCK_LIMIT:.0e}"
    )
    table.add_row(
        "adjoint – central differences, 5 points",
        f"{errors['adjoint_vs_central']:.1e}",
        f"{CENTRAL_LIMIT:.0e}",
    )
    table.add_row(
        "block form – central differences, 5 points",
        f"{errors['block_vs_central']:.1e}",
        f"{CENTRAL_LIMIT:.0e}",
    )
    table.add_row(
        "adjoint – forward differences, h = 1e-6",
        f"{errors['adjoint_vs_forward']:.1e}",
        f"the paper had {PAPER_FORWARD_ERROR:.1e}",
    )
    times = new_table("Time", ("what", "ms", "forward differences take"), ("what",))
    words = {
        "cost": "cost alone",
        "adjoint": "cost and gradient, adjoint",
        "block": "cost and gradient, block form",
        "forward": "forward differences",
        "central": "central differences, 5 points",
    }
    for key, word in words.items():
        seconds = found.seconds[key]
        times.add_row(word, f"{1e3 * seconds:.2f}", f"{found.seconds['forward'] / seconds:.3g} ×")
    verdict = "The gradient is right." if found.passed else "The gradient is WRONG."
    terminal.answer(
        [
            f"{found.variables} variables, {found.samples} samples, {found.base_parameters} base "
            f"parameters, at a random motion of condition number {found.condition_number:.1f}",
            table,
            times,
            verdict,
        ],
        {
            "variables": found.variables,
            "samples": found.samples,
            "base_parameters": found.base_parameters,
            "condition_number": found.condition_number,
            "relative_error": found.relative_error,
            "seconds": found.seconds,
            "passed": found.passed,
        },
    )
    if not found.passed:
        raise typer.Exit(1)
