"""`excite verify-gradient`: adjoint, the paper's block form and finite differences."""

from excite_cli.cli import options
from excite_cli.cli.console import Terminal
from excite_cli.cli.next_step import next_step


@options.command
def verify_gradient(
    terminal: Terminal,
    config: options.Config,
    seed: options.Seed = None,
    overrides: options.Set = None,
    threads: options.Threads = 1,
) -> None:
    """Check the gradient of this problem in three ways and time them.

    The block form is that of the base regressor; effects listed in the config are checked against
    differences. Exit status 1: the adjoint and the block form differ by more than 1e-9, or one of
    them from central differences by more than 1e-7 (relative).

    Examples:
      excite verify-gradient ur10.yaml
    """
    from excite_cli.api.loading import load_problem
    from excite_cli.api.verifying import gradient_answer
    from excite_cli.api.verifying import verify_gradient as verify

    changes = [*(overrides or []), "constraints.self_collision=null"]
    problem = load_problem(config, options.changes(changes, seed=seed), terminal.tell)
    with terminal.live("differences of every variable"):
        found = verify(problem)
    answer = gradient_answer(found)
    terminal.show(answer, next_step("plan motions", "optimize", config) if answer.good else ())
