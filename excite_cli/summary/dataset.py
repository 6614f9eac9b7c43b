"""Measured data in words, and their runs as a table."""

from collections.abc import Sequence

from excite_cli.measurement.dataset import Dataset, Run
from excite_cli.shown.record import show
from excite_cli.shown.table import Parts, Table


def runs_in_words(data: Dataset) -> str:
    """`2 runs, 24 s`."""
    runs = "1 run" if len(data.runs) == 1 else f"{len(data.runs)} runs"
    return f"{runs}, {sum(run.duration for run in data.runs):.3g} s"


def dataset_parts(data: Dataset) -> Parts:
    """The runs, and what was noticed."""
    noticed = dict.fromkeys(f"{each.severity}: {each.text}" for each in data.findings)
    return [_run_table(f"Runs of {', '.join(data.joint_names)}", data.runs), *noticed]


def _run_table(title: str, runs: Sequence[Run]) -> Table:
    """Also where each came from, if they were read from files."""
    read = any(run.origin.file for run in runs)
    rows = tuple(
        (
            run.label,
            str(len(run.t)),
            f"{run.duration:.2f}",
            f"{1.0 / run.step:.4g}",
            f"{run.usable().mean():.1%}",
            *([f"{run.origin.file} {run.origin.place}".strip()] if read else []),
        )
        for run in runs
    )
    names = ("run", "samples", "seconds", "rate [Hz]", "usable", *(["from"] if read else []))
    return Table(title, names, rows, left=("run",), words=("from",) if read else ())


def _run_in_words(run: Run) -> str:
    words = f"{run.label}: {run.q.shape[1]} joints, {len(run.t)} samples, {run.duration:.3g} s"
    return f"{words}, from {run.origin.file}" if run.origin.file else words


show(Dataset, lambda data: f"{len(data.joint_names)} joints; {runs_in_words(data)}", dataset_parts)
show(Run, _run_in_words, lambda run: [_run_table("Run", [run])])
