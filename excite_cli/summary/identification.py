"""What `excite identify` found, as tables and as data."""

from collections.abc import Mapping, Sequence
from math import isnan
from pathlib import Path
from typing import Any

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
from excite_cli.identification.link_changes import LinkChange, LinkParameterChange
from excite_cli.identification.stored_model import StoredFit
from excite_cli.shown.answer import Answer, Command, Parts, Table, as_word
from excite_cli.shown.record import show
from excite_cli.summary.cells import figure, files_in_words, floor_cells, floor_columns, percent

# What a fit changed of the links, as a table, a line on the others, and as data.

_TITLE = (
    "Links deviating from the URDF (± one standard deviation; centre of mass in the link's frame)"
)
_COLUMNS = (
    "link",
    "mass [kg]",
    "URDF mass [kg]",
    "centre x, y, z [mm]",
    "URDF centre [mm]",
    "determined by data",
    "physically infeasible",
)


def link_parts(links: Sequence[LinkChange]) -> Parts:
    """Links that changed by more than two standard deviations or are marked; others counted."""
    if not links:
        return []
    shown = [link for link in links if link.significant or link.marks]
    others = len(links) - len(shown)
    counted = (
        f"{others} {'other ' if shown else ''}link{'s' * (others != 1)} of {len(links)}: mass and "
        "centre within two standard deviations of the URDF's."
    )
    rows = tuple(_row(link) for link in shown)
    left = ("link", "determined by data", "physically infeasible")
    return [
        *(
            [Table(_TITLE, _COLUMNS, rows, left=left, words=("physically infeasible",))]
            if rows
            else []
        ),
        *([counted] if others else []),
    ]


def link_data(links: Sequence[LinkChange]) -> list[dict[str, Any]]:
    """All links for `--json`: masses [kg], centres [m] in the link's frame."""
    return [
        {
            "link": link.link,
            "joint": link.joint,
            "mass": _link_changes_data(link.mass),
            "center": {
                axis: _link_changes_data(c) for axis, c in zip("xyz", link.center, strict=True)
            },
            "significant": link.significant,
            "marks": list(link.marks),
        }
        for link in links
    ]


def _link_changes_data(change: LinkParameterChange) -> dict[str, Any]:
    return {
        "before": change.before,
        "after": change.after,
        "std": change.std,
        "left": change.left,
        "determined": change.determined,
    }


def _row(link: LinkChange) -> tuple[str, ...]:
    """A line per axis in the cells of the centre."""
    known = [
        name
        for name, change in zip(("mass", "x", "y", "z"), (link.mass, *link.center), strict=True)
        if change.determined
    ]
    return (
        link.link,
        with_deviation(link.mass.after, link.mass.std),
        f"{link.mass.before:.4g}",
        "\n".join(with_deviation(1e3 * c.after, 1e3 * c.std) for c in link.center),
        "\n".join(f"{1e3 * c.before:.4g}" for c in link.center),
        ", ".join(known) or "nothing",
        "; ".join(link.marks),
    )


def identification_answer(
    found: Identification, written: Mapping[str, str | Path | None]
) -> Answer:
    """What `excite identify` answers; `written` are the files that were requested, by kind."""
    files = {kind: str(path) for kind, path in written.items() if path is not None}
    parts = (*identification_parts(found), *files_in_words(files), *_next(found, files.get("fit")))
    return Answer(parts, {**_data(found), "output": files})


def _next(found: Identification, file: str | None) -> Parts:
    """What to do next with the `file` of the fit, unless a finding says it."""
    if file is None or any(each.kind == "much_left" for each in found.findings):
        return []
    return ["Next, with other data:", Command(("excite", "score", as_word(file), "DATA.h5"))]


def identification_parts(found: Identification) -> Parts:
    """Parameters, errors per joint, and sentences."""
    low, high = found.error.interval
    fit = found.fit
    sentences = [
        f"Mean relative error on {found.held_out_run}: {found.error.mean_relative:.2%} "
        f"(95% interval {low:.2%} to {high:.2%}); where joints move "
        f"{found.error.mean_relative_moving:.2%}.",
        f"Effective sample size: {fit.samples:.0f} of {fit.count} filtered torque samples of all "
        "joints (their noise is correlated).",
        f"{found.hausman.sentence()[0].upper()}{found.hausman.sentence()[1:]}.",
    ]
    if fit.consistent is not None:
        sentences.append(consistency_in_words(fit))
    above = above_the_floor(found.error, found.noise_floor)
    return [
        _parameter_table(fit),
        _error_table(found),
        *link_parts(fit.links),
        *([above] if above else []),
        *sentences,
    ]


def _parameter_table(fit: Fit) -> Table:
    rows = tuple(
        (
            name,
            short_number(fit.values[i], 5),
            short_number(fit.std[i], 3),
            relative_in_words(fit.relative_std[i]),
            fit.units[i],
            fixed_by_data(fit, i),
        )
        for i, name in enumerate(fit.names)
    )
    names = ("parameter", "value", "std", "relative std", "unit", "identifiable")
    title = "Parameters (base parameters stand for sums of inertial ones, and may be negative)"
    return Table(title, names, rows, left=("parameter", "unit", "identifiable"))


def _error_table(found: Identification | StoredFit) -> Table:
    """Errors per joint on the held-out part, and the training part's and the noise floor beside."""
    error, floor, joints = found.error, found.noise_floor, found.fit.joint_names
    units = found.torque_units or ("",) * len(joints)
    rows = tuple(
        (
            joint,
            percent(error.relative_moving[joint]),
            percent(error.relative[joint]),
            figure(error.rms[joint]),
            *floor_cells(floor, joint),
            figure(error.rms_raw[joint]),
            unit,
            percent(found.training_error.relative[joint]),
        )
        for joint, unit in zip(joints, units, strict=True)
        if not isnan(error.rms[joint])  # its torque was not measured
    )
    title = "Error of the torque on held-out data (RMS: of all samples, filtered, and as recorded)"
    names = (
        "joint", "error, moving", "error, all", "RMS", *floor_columns(floor), "RMS unfiltered",
        "unit", "training error",
    )  # fmt: skip
    return Table(title, names, rows, left=("joint", "unit"))


def _data(found: Identification) -> dict[str, Any]:
    """The answer for `--json`."""
    fit = found.fit
    return {
        "parameters": [
            {
                "name": name,
                "value": float(fit.values[i]),
                "std": float(fit.std[i]),
                "relative_std": float(fit.relative_std[i]),
                "identifiable": bool(fit.identifiable[i]),
                "essential": bool(fit.essential[i]),
                "unit": fit.units[i],
            }
            for i, name in enumerate(fit.names)
        ],
        "effects": [
            {
                "kind": effect.kind,
                "joints": [fit.joint_names[j] for j in effect.joints],
                "parameters": {
                    name: {"value": value.value, "std": value.std, "unit": value.unit}
                    for name, value in fit.effect_report(i).items()
                },
            }
            for i, effect in enumerate(fit.effects)
        ],
        "held_out_run": found.held_out_run,
        "error": found.error.as_data(),
        "training_error": found.training_error.as_data(),
        "noise_floor": found.noise_floor,
        "samples": {"count": fit.count, "independent": fit.samples},
        "noise": dict(zip(fit.joint_names, map(float, fit.noise), strict=True)),
        "consistent": None
        if fit.consistent is None
        else {
            "solved": fit.consistent.solved,
            "status": fit.consistent.status,
            "cost": fit.consistent.cost,
            "spread": fit.consistent.spread,
            "smallest_eigenvalue": float(fit.consistent.eigenvalues.min()),
        },
        "links": link_data(fit.links),
        "closed_loop_bias": {
            "testable": found.hausman.testable,
            "p_value": found.hausman.p_value,
            "source": found.hausman.source,
            "text": found.hausman.sentence(),
        },
        "findings": [
            {
                "kind": finding.kind,
                "severity": finding.severity,
                "run": finding.run,
                "text": finding.text,
            }
            for finding in found.findings
        ],
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


show(Fit, _fit_in_words, lambda fit: [_parameter_table(fit)])
show(Identification, _in_words, identification_parts)
show(StoredFit, _in_words, _stored_parts)
