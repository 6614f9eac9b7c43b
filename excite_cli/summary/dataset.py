"""Measured data in words, and their runs as a table."""

from excite_cli.measurement.dataset import Dataset
from excite_cli.shown.record import show
from excite_cli.shown.table import Parts, Table


def runs_in_words(data: Dataset) -> str:
    """`2 runs, 24 s`."""
    runs = "1 run" if len(data.runs) == 1 else f"{len(data.runs)} runs"
    return f"{runs}, {sum(run.duration for run in data.runs):.3g} s"


def dataset_parts(data: Dataset) -> Parts:
    """The runs, and what was noticed."""
    rows = tuple(
        (
            run.name,
            str(len(run.t)),
            f"{run.duration:.2f}",
            f"{1.0 / run.step:.4g}",
            f"{run.usable().mean():.1%}",
        )
        for run in data.runs
    )
    names = ("run", "samples", "seconds", "rate [Hz]", "usable")
    table = Table(f"Runs of {', '.join(data.joint_names)}", names, rows, left=("run",))
    noticed = dict.fromkeys(f"{each.severity}: {each.text}" for each in data.findings)
    return [table, *noticed]


show(Dataset, lambda data: f"{len(data.joint_names)} joints; {runs_in_words(data)}", dataset_parts)
