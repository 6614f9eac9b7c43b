"""What a page says about identified parameters."""

from collections.abc import Sequence

import numpy as np

from excite_cli.identification.fit import Fit
from excite_cli.identification.fit_words import (
    Identifiable,
    consistency_in_words,
    fixed_by_data,
    relative_in_words,
    short_number,
)
from excite_cli.identification.stored_model import StoredFit
from excite_cli.report.chart import Chart, Colour
from excite_cli.report.page import Block, Charts, Fold, KeyFigure, PageSection, TableBlock, Text
from excite_cli.report.residual_error_section import by_joint, error_blocks
from excite_cli.report.residual_findings import findings_blocks, processing_table
from excite_cli.report.residual_section import residuals_in_time
from excite_cli.report.rows_chart import Axis, Bar, Form, Mark, Row, rows_chart

# Parameters of a fit with their intervals; the marker says how well the data fix each.

_MOST_ROWS = 16
_FORMS: dict[Identifiable, tuple[str, Form, Colour]] = {
    Identifiable.YES: ("identifiable", "dot", "blue"),
    Identifiable.ZERO: ("identifiable, zero within error", "ring", "blue"),
    Identifiable.NO: ("not identifiable", "cross", "vermilion"),
}


def parameter_charts(fit: Fit) -> tuple[Chart, ...]:
    """A chart for every unit; long ones are cut in several."""
    charts: list[Chart] = []
    for unit in dict.fromkeys(fit.units):
        rows = [i for i, own in enumerate(fit.units) if own == unit]
        axis = _axis(fit, unit, rows)
        parts = np.array_split(np.array(rows), -(-len(rows) // _MOST_ROWS))
        for number, part in enumerate(parts, start=1):
            of = f", {number} of {len(parts)}" if len(parts) > 1 else ""
            charts.append(_chart(fit, unit, [int(i) for i in part], axis, of))
    return tuple(charts)


def _chart(fit: Fit, unit: str, rows: Sequence[int], axis: Axis, of: str) -> Chart:
    loose = [fit.names[i] for i in rows if not fit.identifiable[i]]
    words = f"{len(rows)} parameters in {unit} with one standard deviation to either side; " + (
        f"not identifiable: {', '.join(loose)}." if loose else "all of them identifiable."
    )
    drawn = [_row(fit, i, axis) for i in rows]
    return rows_chart(f"Parameters [{unit}]{of}", words, axis, drawn, noted="rel. std")


def _row(fit: Fit, i: int, axis: Axis) -> Row:
    word, form, colour = _FORMS[fixed_by_data(fit, i)]
    value, std = float(fit.values[i]), float(fit.std[i])
    ends = (value - std, value + std) if np.isfinite(std) else (axis.low, axis.high)
    bar = Bar(*ends, colour, dashed=not fit.identifiable[i])
    note = relative_in_words(float(fit.relative_std[i]))
    return Row(fit.names[i], (Mark(value, word, colour, form),), (bar,), note)


def _axis(fit: Fit, unit: str, rows: Sequence[int]) -> Axis:
    """Room for all values, and the intervals of those that the data fix.

    Logarithmic to both sides of zero if values differ by more than a decade or two.
    """
    shown = [0.0]
    for i in rows:
        value, std = float(fit.values[i]), float(fit.std[i])
        shown.append(value)
        if fit.identifiable[i] and np.isfinite(std):
            shown += [value - std, value + std]
    label = f"value ± standard deviation [{unit}]"
    if not any(shown):
        return Axis.about(label, (-1.0, 1.0))
    sizes = np.abs([float(fit.values[i]) for i in rows])
    least = max(float(np.quantile(sizes, 0.25)), 1e-4 * float(np.abs(shown).max()), 1e-12)
    linear = 10.0 ** np.floor(np.log10(least))
    return Axis.about(label, shown, float(linear))


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
            f"all samples {error.mean_relative:.2%}, 95% interval {low:.2%} to {high:.2%}",
        ),
        KeyFigure(
            "identifiable parameters",
            f"{fixed} of {len(fit.names)}",
            f"{fit.rank} base parameters, {len(fit.names) - fit.rank} of effects",
        ),
        KeyFigure(
            "effective sample size",
            f"{fit.samples:.0f}",
            f"of {fit.count} samples, which are correlated in time",
        ),
    )


def fit_sections(stored: StoredFit) -> tuple[PageSection, ...]:
    """Errors, parameters, residual in time, data and choices."""
    return (_errors(stored), parameter_section(stored.fit), time_section(stored), _data(stored))


def _errors(stored: StoredFit) -> PageSection:
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
        f"the torque there {stored.error.mean_relative:.2%} (95% interval {low:.2%} to "
        f"{high:.2%}), {stored.error.mean_relative_moving:.2%} where joints move; on the training "
        f"data {stored.training_error.mean_relative:.2%}."
    )
    return PageSection("fit-errors", "Error of the fit", blocks, lead)


def parameter_section(fit: Fit) -> PageSection:
    """Values with intervals, and how well the data fix each."""
    blocks: list[Block] = [Charts(parameter_charts(fit)), _table(fit), *correlated_parameters(fit)]
    if fit.consistent is not None:
        blocks.append(Text(consistency_in_words(fit), "plain" if fit.consistent.solved else "bad"))
    fixed = int(np.sum(fit.identifiable))
    kept = " The URDF's inertias are kept as a prior." if fit.inertias == "cad" else ""
    lead = (
        f"{fixed} of {len(fit.names)} parameters are identifiable. A full dot: identifiable; a "
        "hollow dot: identifiable, zero within error; a cross with a dashed interval: not "
        "identifiable. Standard deviations respect serial correlation: "
        f"the effective sample size is {fit.samples:.0f} of {fit.count}.{kept}"
    )
    return PageSection("fit-parameters", "Parameters", tuple(blocks), lead)


def _table(fit: Fit) -> TableBlock:
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
    return TableBlock(
        ("parameter", "value", "std", "relative", "unit", "identifiable", "what it groups"),
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
        TableBlock(
            ("parameter", "and", "correlation"),
            rows,
            title=f"{len(pairs)} pairs correlated by more than {_CORRELATED}{more}",
            right=frozenset({2}),
            note="Of such a pair the data know a sum or a difference far better than either.",
            folded=True,
        ),
    )


def time_section(stored: StoredFit) -> PageSection:
    """Measured and predicted torque of all runs, the held-out ones first."""
    units = stored.torque_units or ("N·m",) * len(stored.fit.joint_names)
    # What took no part comes first: it is the judge.
    traces = sorted(stored.traces, key=lambda trace: not trace.held_out)
    blocks = residuals_in_time(traces, stored.fit.joint_names, units)
    lead = (
        "Filtered torque, as used in the fit. Above: measured torque and prediction of the model; "
        "below: residual. Shaded: held out from the fit."
        if traces
        else ""
    )
    return PageSection("fit-time", "Fit in time", blocks, lead)


def _data(stored: StoredFit) -> PageSection:
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
    return PageSection("fit-data", "Data and choices", tuple(blocks), lead)
