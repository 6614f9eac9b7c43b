"""What a page says about identified parameters."""

import numpy as np

from excite_cli.identification.fit import Fit
from excite_cli.identification.fit_words import (
    consistency_in_words,
    fixed_by_data,
    relative_in_words,
    short_number,
)
from excite_cli.identification.stored_fit import StoredFit
from excite_cli.report.fit_parameter_chart import parameter_charts
from excite_cli.report.page import Block, Charts, Fold, KeyFigure, Section, Table, Text
from excite_cli.report.residual_error_section import by_joint, error_blocks
from excite_cli.report.residual_findings import findings_blocks, processing_table
from excite_cli.report.residual_section import residuals_in_time

_CORRELATED, _MOST_PAIRS = 0.95, 15


def fit_figures(stored: StoredFit) -> tuple[KeyFigure, ...]:
    """What sums a fit up."""
    fit, error = stored.fit, stored.error
    low, high = error.interval
    fixed = int(np.sum(fit.identifiable))
    return (
        KeyFigure(
            "error on held-out data, moving",
            f"{error.mean_relative_moving:.2%}",
            f"all samples {error.mean_relative:.2%}, 95 % interval {low:.2%} to {high:.2%}",
        ),
        KeyFigure(
            "parameters fixed by the data",
            f"{fixed} of {len(fit.names)}",
            f"{fit.rank} base parameters, {len(fit.names) - fit.rank} of effects",
        ),
        KeyFigure(
            "independent samples",
            f"{fit.samples:.0f}",
            f"worth of {fit.count}, which are correlated in time",
        ),
    )


def fit_sections(stored: StoredFit) -> tuple[Section, ...]:
    """Errors, parameters, residual in time, data and choices."""
    return (_errors(stored), parameter_section(stored.fit), time_section(stored), _data(stored))


def _errors(stored: StoredFit) -> Section:
    low, high = stored.error.interval
    blocks = error_blocks(
        ("training", "held-out"),
        stored.training_error,
        stored.error,
        by_joint(stored.fit.joint_names, stored.torque_units),
        stored.noise_floor,
        "raw: on held-out data, on the torque as recorded, without any filter.",
    )
    lead = (
        f"Held-out: {stored.held_out_run}, which took no part in the fit. Mean relative error of "
        f"the torque there {stored.error.mean_relative:.2%} (95 % interval {low:.2%} to "
        f"{high:.2%}), {stored.error.mean_relative_moving:.2%} where joints move; on the training "
        f"data {stored.training_error.mean_relative:.2%}."
    )
    return Section("fit-errors", "Error of the fit", blocks, lead)


def parameter_section(fit: Fit) -> Section:
    """Values with intervals, and how well the data fix each."""
    blocks: list[Block] = [Charts(parameter_charts(fit)), _table(fit), *correlated_parameters(fit)]
    if fit.consistent is not None:
        blocks.append(Text(consistency_in_words(fit), "plain" if fit.consistent.solved else "bad"))
    fixed = int(np.sum(fit.identifiable))
    kept = " The URDF's inertias are kept as a prior." if fit.inertias == "cad" else ""
    lead = (
        f"The data fix {fixed} of {len(fit.names)} parameters. A full dot: fixed; a hollow one: "
        "fixed, but so small that the fit is as good without it; a cross with a dashed interval: "
        "not fixed. Standard deviations respect serial correlation: "
        f"{fit.count} samples carry the information of {fit.samples:.0f} independent ones.{kept}"
    )
    return Section("fit-parameters", "Parameters", tuple(blocks), lead)


def _table(fit: Fit) -> Table:
    rows = tuple(
        (
            name,
            short_number(float(fit.values[i]), 5),
            short_number(float(fit.std[i]), 3),
            relative_in_words(float(fit.relative_std[i])),
            fit.units[i],
            fixed_by_data(fit, i),
            fit.words[i] or "–",
        )
        for i, name in enumerate(fit.names)
    )
    return Table(
        ("parameter", "value", "std", "relative", "unit", "fixed by the data", "what it groups"),
        rows,
        title="Parameters in figures, and what each base parameter groups",
        right=frozenset({1, 2, 3}),
        folded=True,
    )


def correlated_parameters(fit: Fit) -> tuple[Block, ...]:
    """Pairs of which only a sum or a difference is known well."""
    std = np.where(np.isfinite(fit.std) & (fit.std > 0), fit.std, np.nan)
    with np.errstate(invalid="ignore"):
        correlation = np.nan_to_num(fit.covariance / np.outer(std, std), posinf=0.0, neginf=0.0)
    i, j = np.triu_indices(len(std), 1)
    strong = np.abs(correlation[i, j])
    order = np.argsort(-strong, kind="stable")
    pairs = [k for k in order if strong[k] > _CORRELATED]
    if not pairs:
        worst = f"{strong[order[0]]:.2f}" if len(order) else "0"
        text = f"No two parameters are correlated by more than {_CORRELATED} (at most {worst})."
        return (Text(text),)
    rows = tuple(
        (fit.names[i[k]], fit.names[j[k]], f"{correlation[i[k], j[k]]:+.3f}")
        for k in pairs[:_MOST_PAIRS]
    )
    more = f"; the {_MOST_PAIRS} strongest are shown" if len(pairs) > _MOST_PAIRS else ""
    return (
        Table(
            ("parameter", "and", "correlation"),
            rows,
            title=f"{len(pairs)} pairs correlated by more than {_CORRELATED}{more}",
            right=frozenset({2}),
            note="Of such a pair the data know a sum or a difference far better than either.",
            folded=True,
        ),
    )


def time_section(stored: StoredFit) -> Section:
    """Measured and predicted torque of all runs, the held-out ones first."""
    units = stored.torque_units or ("N·m",) * len(stored.fit.joint_names)
    # What took no part comes first: it is the judge.
    traces = sorted(stored.traces, key=lambda trace: not trace.held_out)
    blocks = residuals_in_time(traces, stored.fit.joint_names, units)
    lead = (
        "Filtered torque, as the fit sees it: above what was measured and what the model says, "
        "below what it leaves. Shaded: held out, took no part in the fit."
        if traces
        else ""
    )
    return Section("fit-time", "Fit in time", blocks, lead)


def _data(stored: StoredFit) -> Section:
    blocks: list[Block] = []
    if stored.closed_loop_bias:
        text = stored.closed_loop_bias
        blocks.append(Text(f"{text[0].upper()}{text[1:]}."))
    blocks += findings_blocks(stored.findings)
    if stored.processing:
        blocks.append(processing_table(stored.processing, stored.fit.joint_names))
    blocks.append(Fold("Configuration that was fitted", (Text(stored.config, "code"),)))
    versions = ", ".join(f"{name} {version}" for name, version in stored.versions.items())
    if versions:
        blocks.append(Text(versions))
    sources = ", ".join(stored.sources)
    lead = f"From {sources}." if sources else ""
    return Section("fit-data", "Data and choices", tuple(blocks), lead)
