"""What `excite identify` found, as tables and as data."""

from collections.abc import Mapping, Sequence
from math import isnan, nan
from pathlib import Path
from typing import Any

import numpy as np

from excite_cli.diagnosis.words import counted
from excite_cli.fields import data_of
from excite_cli.identification.carried_load import LoadIdentification
from excite_cli.identification.fit import Fit
from excite_cli.identification.fit_words import (
    above_the_floor,
    consistency_in_words,
    fixed_by_data,
    relative_in_words,
    short_number,
    with_deviation,
)
from excite_cli.identification.identify import Identification
from excite_cli.identification.link_changes import LinkChange
from excite_cli.identification.stored_model import StoredFit
from excite_cli.report.error_chart import NOTHING_MOVES, error_charts, parameter_charts
from excite_cli.report.residual_chart import IN_TIME, residuals_in_time
from excite_cli.report.validity_chart import validity_section
from excite_cli.shown.answer import (
    Answer,
    Block,
    Charts,
    KeyFigure,
    Parts,
    Section,
    Table,
    Text,
    show,
)
from excite_cli.summary.cells import (
    figure,
    files_in_words,
    findings_data,
    percent,
)
from excite_cli.summary.findings import data_blocks
from excite_cli.summary.frames import OF_FIT, OF_IDENTIFICATION, parameters_of

_CORRELATED, _MOST_PAIRS = 0.95, 15
_OVERFITTED = 2.0  # times the training error that the held-out one is

# What a fit changed of the links, as a table, a line on the others, and as data.

_TITLE = (
    "Links deviating from the URDF (± one standard deviation; centre of mass in the link's frame)"
)


def link_parts(links: Sequence[LinkChange]) -> Parts:
    """Links that changed by more than two standard deviations or are marked; others counted."""
    if not links:
        return []
    shown = [link for link in links if link.significant or link.marks]
    others = len(links) - len(shown)
    unchanged = (
        f"{others} {'other ' if shown else ''}link{'s' * (others != 1)} of {len(links)}: mass and "
        "centre within two standard deviations of the URDF's."
    )
    left = ("link", "determined by data")
    table = Table.of(_TITLE, map(_row, shown), left, words=("physically infeasible",))
    return [*([table] if shown else []), *([unchanged] if others else [])]


def link_data(links: Sequence[LinkChange]) -> list[dict[str, Any]]:
    """All links for `--json`: masses [kg], centres [m] in the link's frame."""
    changed = ("before", "after", "std", "left", "determined")
    return [
        {
            **data_of(link, "link", "joint", "significant", "marks"),
            "mass": data_of(link.mass, *changed),
            "center": {
                axis: data_of(each, *changed) for axis, each in zip("xyz", link.center, strict=True)
            },
        }
        for link in links
    ]


def _row(link: LinkChange) -> dict[str, str]:
    """A line per axis in the cells of the centre."""
    changes = zip(("mass", "x", "y", "z"), (link.mass, *link.center), strict=True)
    known = [name for name, change in changes if change.determined]
    center = (with_deviation(1e3 * each.after, 1e3 * each.std) for each in link.center)
    return {
        "link": link.link,
        "mass [kg]": with_deviation(link.mass.after, link.mass.std),
        "URDF mass [kg]": f"{link.mass.before:.4g}",
        "centre x, y, z [mm]": "\n".join(center),
        "URDF centre [mm]": "\n".join(f"{1e3 * each.before:.4g}" for each in link.center),
        "determined by data": ", ".join(known) or "nothing",
        "physically infeasible": "; ".join(link.marks),
    }


def identification_answer(
    found: Identification, written: Mapping[str, str | Path | None]
) -> Answer:
    """What `excite identify` answers; `written` are the files that were requested, by kind."""
    files = {kind: str(path) for kind, path in written.items() if path is not None}
    parts = (*identification_parts(found), *files_in_words(files))
    return Answer(parts, {**_data(found), "output": files})


def identification_parts(found: Identification) -> Parts:
    """Parameters, errors per joint, and sentences."""
    fit = found.fit
    consistent = consistency_in_words(fit)
    above = above_the_floor(found.error, found.noise_floor)
    return [
        _parameter_table(fit),
        _error_table(found),
        *link_parts(fit.links),
        *([above] if above else []),
        _mean_error(found),
        _effective_size(fit),
        f"{found.hausman.sentence()[0].upper()}{found.hausman.sentence()[1:]}.",
        *([consistent] if consistent else []),
    ]


def _mean_error(found: Identification | StoredFit) -> str:
    low, high = found.error.interval
    return (
        f"Mean relative error on {found.held_out_run}: {found.error.mean_relative:.2%} "
        f"(95% interval {low:.2%} to {high:.2%}); where joints move "
        f"{found.error.mean_relative_moving:.2%}."
    )


def _effective_size(fit: Fit) -> str:
    return (
        f"Effective sample size: {fit.samples:.0f} of {fit.count} filtered torque samples of all "
        "joints (their noise is correlated)."
    )


def _parameter_table(fit: Fit, grouped: bool = False) -> Table:
    """With `grouped` also what each base parameter groups."""
    rows = (
        {
            "parameter": name,
            "value": short_number(fit.values[i], 5),
            "std": short_number(fit.std[i], 3),
            "relative std": relative_in_words(fit.relative_std[i]),
            "unit": fit.units[i],
            "identifiable": fixed_by_data(fit, i),
            **({"what it groups": fit.words[i] or "–"} if grouped else {}),
        }
        for i, name in enumerate(fit.names)
    )
    title = "Parameters (base parameters stand for sums of inertial ones, and may be negative)"
    left = ("parameter", "unit", "identifiable")
    return Table.of(title, rows, left, words=("what it groups",), folded=grouped)


def _error_table(found: Identification | StoredFit) -> Table:
    """Errors per joint on the held-out part, and the training part's and the noise floor beside."""
    error, floor = found.error, found.noise_floor
    rows = (
        {
            "joint": joint,
            "error, moving": percent(error.relative_moving[joint]),
            "error, all": percent(error.relative[joint]),
            "RMS": figure(error.rms[joint]),
            **({} if floor is None else {"noise floor": figure(floor.get(joint, nan))}),
            "RMS unfiltered": figure(error.rms_raw[joint]),
            "unit": unit,
            "training error": percent(found.training_error.relative[joint]),
        }
        for joint, unit in zip(found.fit.joint_names, found.torque_units, strict=True)
        if not isnan(error.rms[joint])  # its torque was not measured
    )
    title = "Error of the torque on held-out data (RMS: of all samples, filtered, and as recorded)"
    return Table.of(title, rows, left=("joint", "unit"))


def _data(found: Identification) -> dict[str, Any]:
    """The answer for `--json`."""
    fit, bias = found.fit, found.hausman
    consistent = fit.consistent
    return {
        **data_of(found, "held_out_run", "error", "training_error", "noise_floor"),
        "parameters": parameters_of(fit),
        "effects": [
            {
                "kind": effect.kind,
                "joints": [fit.joint_names[j] for j in effect.joints],
                "parameters": data_of(fit.effect_report(i)),
            }
            for i, effect in enumerate(fit.effects)
        ],
        "samples": {"count": fit.count, "independent": fit.samples},
        "noise": dict(zip(fit.joint_names, map(float, fit.noise), strict=True)),
        "consistent": consistent
        and {
            **data_of(consistent, "solved", "status", "cost", "spread"),
            "smallest_eigenvalue": float(consistent.eigenvalues.min()),
        },
        "links": link_data(fit.links),
        "closed_loop_bias": {
            **data_of(bias, "testable", "p_value", "source"),
            "text": bias.sentence(),
        },
        "findings": findings_data(found.findings),
        "processing": found.processing.as_data(),
    }


def _fit_in_words(fit: Fit) -> str:
    """`28 parameters (24 fixed by the data) of 5 joints; coulomb_friction@elbow`."""
    known = int(sum(fit.identifiable))
    effects = ", ".join(
        f"{effect.kind}@{','.join(fit.joint_names[j] for j in effect.joints)}"
        for effect in fit.effects
    )
    words = f"{len(fit.names)} parameters ({known} identifiable) of {len(fit.joint_names)} joints"
    return words + (f"; {effects}" if effects else "")


def _in_words(found: Identification | StoredFit) -> str:
    """The fit, and its error on data that it did not see."""
    error = f"mean relative error {found.error.mean_relative:.2%} on {found.held_out_run}"
    return f"{_fit_in_words(found.fit)}; {error}"


def _stored_parts(found: StoredFit) -> Parts:
    return [_parameter_table(found.fit), _error_table(found), *link_parts(found.fit.links)]


# The page of a fit.


def fit_figures(stored: StoredFit) -> tuple[KeyFigure, ...]:
    """What sums a fit up."""
    fit, error = stored.fit, stored.error
    low, high = error.interval
    fixed = int(np.sum(fit.identifiable))
    known = {j: each for j, each in error.relative_moving.items() if not isnan(each)}
    worst = max(known, key=lambda joint: known[joint], default="")
    said = f"worst joint: {worst} {known[worst]:.2%}\n" if known else ""
    overfitted = error.mean_relative > _OVERFITTED * stored.training_error.mean_relative
    warned = sum(each.severity == "warning" for each in stored.findings)
    data = f"{counted(warned, 'warning')} about the data"
    return (
        KeyFigure(
            "error on held-out data, moving",
            f"{error.mean_relative_moving:.2%}",
            f"{said}all samples {error.mean_relative:.2%}, 95% interval {low:.2%} to {high:.2%}",
            "open" if overfitted else "good",
            "fit-errors",
        ),
        KeyFigure(
            "identifiable parameters",
            f"{fixed} of {len(fit.names)}",
            f"{fit.rank} base parameters, {len(fit.names) - fit.rank} of effects",
            "good" if fixed == len(fit.names) else "open",
            "fit-parameters",
        ),
        KeyFigure(
            "effective sample size",
            f"{fit.samples:.0f}",
            f"of {fit.count} samples, which are correlated in time\n{data}",
            "open" if warned else "good",
            "fit-data",
        ),
    )


def fit_in_a_sentence(stored: StoredFit) -> str:
    """What its page says first."""
    fixed, count = int(np.sum(stored.fit.identifiable)), len(stored.fit.names)
    return (
        f"The model misses {relative_in_words(stored.error.mean_relative_moving)} of the torque on "
        f"{stored.held_out_run}, which took no part in the fit (mean over joints, where they "
        f"move). {fixed} of {count} parameters are identifiable."
    )


def fit_sections(stored: StoredFit) -> list[Section]:
    """Errors, parameters, residual in time, data and choices."""
    fit, units = stored.fit, stored.torque_units
    # What took no part comes first: it is the judge.
    traces = sorted(stored.traces, key=lambda trace: not trace.held_out)
    noise = stored.noise_floor or dict(zip(fit.joint_names, map(float, fit.noise), strict=True))
    return [
        Section(
            "fit-errors",
            "Error of the fit",
            tuple(_error_blocks(stored)),
            f"{stored.held_out_run} took no part in the fit. {_mean_error(stored)}",
        ),
        parameter_section(fit),
        Section(
            "fit-time",
            "Fit in time",
            residuals_in_time(traces, fit.joint_names, units, noise),
            f"{IN_TIME}, over the noise. Shaded: held out from the fit.",
        ),
        *_validity(stored),
        Section(
            "fit-data",
            "Data and choices",
            (
                f"{stored.closed_loop_bias[:1].upper()}{stored.closed_loop_bias[1:]}.",
                *data_blocks(stored, fit.joint_names),
            ),
            f"Made by `excite identify` from {', '.join(stored.sources)}, held out: "
            f"{stored.held_out_run}.",
        ),
    ]


def _validity(stored: StoredFit) -> list[Section]:
    names, units = stored.fit.joint_names, stored.torque_units
    section = validity_section(stored.traces, stored.processing, names, units)
    return [section] if section.blocks else []


def _error_blocks(stored: StoredFit) -> list[Block]:
    units = dict(zip(stored.fit.joint_names, stored.torque_units, strict=True))
    errors, floor = (stored.training_error, stored.error), stored.noise_floor
    above = above_the_floor(stored.error, floor)
    moves = not all(isnan(each) for each in stored.error.relative_moving.values())
    return [
        Charts(error_charts(("training", "held-out"), errors, units, floor)),
        *([] if moves else [NOTHING_MOVES]),
        *([above] if above else []),
        _error_table(stored),
    ]


def parameter_section(fit: Fit) -> Section:
    """Values with intervals, and how well the data fix each."""
    blocks: list[Block] = [
        Charts(parameter_charts(fit)),
        _parameter_table(fit, grouped=True),
        *correlated_parameters(fit),
        *link_parts(fit.links),
    ]
    if fit.consistent is not None:
        blocks.append(Text(consistency_in_words(fit), "plain" if fit.consistent.solved else "bad"))
    fixed = int(np.sum(fit.identifiable))
    kept = " The URDF's inertias are kept as a prior." if fit.inertias == "cad" else ""
    lead = (
        f"{fixed} of {len(fit.names)} parameters are identifiable. A full dot: identifiable; a "
        "hollow dot: identifiable, zero within error; a cross with a dashed interval: not "
        "identifiable. Standard deviations respect serial correlation. "
        f"{_effective_size(fit)}{kept}"
    )
    return Section("fit-parameters", "Parameters", tuple(blocks), lead)


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
            f"{len(pairs)} pairs correlated by more than {_CORRELATED}{more}",
            ("parameter", "and", "correlation"),
            rows,
            left=("parameter", "and"),
            note="Of such a pair the data know a sum or a difference far better than either.",
            folded=True,
        ),
    )


show(Fit, _fit_in_words, lambda fit: [_parameter_table(fit)], OF_FIT)
show(Identification, _in_words, identification_parts, OF_IDENTIFICATION)
show(StoredFit, _in_words, _stored_parts, OF_IDENTIFICATION)


# What the robot carries, as a table and as data.


def load_answer(
    found: LoadIdentification, written: Mapping[str, str | Path | None] | None = None
) -> Answer:
    """What `excite identify --only payload` answers; status 1 where no body is so.

    `written` are the files that were requested, by kind.
    """
    files = {kind: str(path) for kind, path in (written or {}).items() if path is not None}
    parts = (*load_parts(found), *files_in_words(files))
    return Answer(parts, {**_load_data(found), "output": files}, found.possible)


def load_parts(found: LoadIdentification) -> Parts:
    """A sentence, the ten parameters, and errors per joint."""
    rows = (
        {
            "parameter": name,
            "value": with_deviation(scale * each.value, scale * each.std),
            "unit": unit,
        }
        for name, each in found.parameters.items()
        for scale, unit in [(1e3, "mm") if each.unit == "m" else (1.0, each.unit)]
    )
    title = (
        f"Load on {found.link}, in its frame (± one standard deviation; inertia about the centre)"
    )
    errors = (
        {
            "joint": joint,
            "fit without the load": percent(found.without.relative_moving[joint]),
            "with it": percent(error),
        }
        for joint, error in found.with_load.relative_moving.items()
    )
    return [
        _load_in_words(found),
        Table.of(title, rows, left=("parameter", "unit")),
        Table.of("Torque error on these data, where the joint moves", errors, left=("joint",)),
    ]


def _load_in_words(found: LoadIdentification) -> str:
    """Mass and centre, from how much data."""
    mass = found.parameters["mass"]
    places = [found.parameters[name] for name in ("cx", "cy", "cz")]
    centre = ", ".join(with_deviation(1e3 * each.value, 1e3 * each.std) for each in places)
    doubt = "" if found.possible else " These values are physically infeasible."
    if any(each.kind == "more_than_a_load" for each in found.findings):
        doubt += " The data contain more than a rigid payload, which the ± do not cover."
    return (
        f"{found.link} carries {with_deviation(mass.value, mass.std)} kg with its centre at "
        f"({centre}) mm, from {found.seconds:.3g} s of motion.{doubt}"
    )


def _load_data(found: LoadIdentification) -> dict[str, Any]:
    """The answer for `--json`."""
    return {
        "good": found.possible,
        **data_of(found, "link", "joint", "parameters", "values", "covariance", "seconds"),
        "error": {**data_of(found, "without", "with_load"), "of_the_fit": found.fit_error},
        "findings": findings_data(found.findings),
    }


show(LoadIdentification, _load_in_words, load_parts)
