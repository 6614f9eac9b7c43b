"""The gradient in three ways: errors and times."""

from excite_cli.excitation.gradient_check import (
    ADJOINT_BLOCK_LIMIT,
    CENTRAL_LIMIT,
    PAPER_FORWARD_ERROR,
    GradientCheck,
)
from excite_cli.fields import data_of
from excite_cli.shown.answer import Answer, Parts, Table, show

_PAIRS = {
    "adjoint_vs_block": ("adjoint – block form", f"{ADJOINT_BLOCK_LIMIT:.0e}"),
    "adjoint_vs_central": ("adjoint – central differences, 5 points", f"{CENTRAL_LIMIT:.0e}"),
    "block_vs_central": ("block form – central differences, 5 points", f"{CENTRAL_LIMIT:.0e}"),
    "adjoint_vs_forward": (
        "adjoint – forward differences, h = 1e-6",
        f"(paper of the method: {PAPER_FORWARD_ERROR:.1e})",
    ),
}
_TIMES = {
    "cost": "cost alone",
    "adjoint": "cost and gradient, adjoint",
    "block": "cost and gradient, block form",
    "forward": "forward differences",
    "central": "central differences, 5 points",
}


def gradient_answer(found: GradientCheck) -> Answer:
    """What `excite verify-gradient` answers."""
    data = data_of(found, "variables", "samples", "base_parameters", "condition_number",
                   "relative_error", "seconds", "passed")  # fmt: skip
    return Answer(tuple(gradient_parts(found)), data, good=found.passed)


def gradient_parts(found: GradientCheck) -> Parts:
    """What was compared, errors, times, and the verdict."""
    return [
        f"{found.variables} variables, {found.samples} samples, {found.base_parameters} base "
        f"parameters, at a random motion of condition number {found.condition_number:.1f}",
        _errors(found),
        _times(found),
        _verdict(found),
    ]


def _errors(found: GradientCheck) -> Table:
    rows = (
        {"pair": words, "error": f"{found.relative_error[key]:.1e}", "allowed": allowed}
        for key, (words, allowed) in _PAIRS.items()
    )
    return Table.of("Relative error of the gradient", rows, left=("pair",))


def _times(found: GradientCheck) -> Table:
    forward = found.seconds["forward"]
    rows = (
        {
            "computation": words,
            "ms": f"{1e3 * found.seconds[key]:.2f}",
            "faster than forward differences": f"{forward / found.seconds[key]:.3g} ×",
        }
        for key, words in _TIMES.items()
    )
    return Table.of("Time", rows, left=("computation",))


def _verdict(found: GradientCheck) -> str:
    return "The gradient is right." if found.passed else "The gradient is WRONG."


show(GradientCheck, _verdict, gradient_parts)
