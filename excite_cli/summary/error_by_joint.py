"""Errors of every joint on held-out data: of the URDF, refitted, with effects; who took it off."""

from collections.abc import Iterator
from math import isnan, nan

import numpy as np

from excite_cli.diagnosis.records import Diagnosis
from excite_cli.diagnosis.words import assumption_in_words, counted, ends_in_words, title_of
from excite_cli.geometry.link_meshes import Poses
from excite_cli.identification.errors_of_torque import Errors
from excite_cli.identification.fit_words import above_the_floor
from excite_cli.report.chart import Chart
from excite_cli.report.error_chart import DECLARED_AND_FOUND, NOTHING_MOVES, error_charts
from excite_cli.report.posture_chart import robot_chart
from excite_cli.report.robot_faces import Faces
from excite_cli.robot.model import Robot
from excite_cli.shown.answer import Block, Charts, Detail, Section, Table
from excite_cli.summary.cells import figure, percent
from excite_cli.summary.named_effects import what_and_where
from excite_cli.view.geometry import robot_bodies

_OFF = "change by effect (pp)"
_NAMED, _WORTH = 3, 0.1  # parts that are named in a row, and the least share of the fall
_NOTHING = 5e-4
_SEEN = 0.005  # share of the first error below which a part is one of the others
REPEATABILITY = (
    "Repeatability: RMS of what changes from one repetition of a motion to the next. No model "
    "leaves less, unless it knows why."
)
_LINES = ("URDF untouched", "declared model, refitted", "with effects")


def errors_section(found: Diagnosis, detail: Detail, robot: Robot | None = None) -> Section:
    """Tables and what they come to; on a page also where the residual is, and both errors.

    With the `robot` it is drawn from its meshes.
    """
    blocks: list[Block] = list(_charts(found, robot)) if detail == Detail.PAGE else []
    blocks += error_tables(found, detail)
    above = above_the_floor(found.after, found.noise_floor)
    blocks += [above] if above else []
    blocks += [REPEATABILITY] if found.noise_floor and detail == Detail.PAGE else []
    blocks += [ends_in_words(part) for part in found.parts]
    blocks += [f"Assumed: {assumption_in_words(each)}" for each in found.assumed]
    blocks.append(_verdict(found))
    lead = f"On {found.held_out_run}, which took no part in choosing or fitting."
    return Section("diagnosis-errors", "Error of the torque on held-out data", tuple(blocks), lead)


def _verdict(found: Diagnosis) -> str:
    low, high = found.after.interval
    return (
        f"{counted(len(found.named), 'effect')}"
        + (f", {counted(len(found.approximations), 'surrogate term')}" * bool(found.approximations))
        + "; mean held-out error where joints move "
        f"{found.before.mean_relative_moving:.2%} → {found.after.mean_relative_moving:.2%}; over "
        f"all samples, standing joints among them, {found.after.mean_relative:.2%} (95% interval "
        f"of this {low:.2%} to {high:.2%}). "
        f"{found.seconds:.1f} s."
    )


def _charts(found: Diagnosis, robot: Robot | None) -> Iterator[Block]:
    charts: tuple[Chart, ...] = error_charts(
        DECLARED_AND_FOUND,
        (found.before, found.after),
        dict(zip(found.joint_names, found.torque_units, strict=True)),
        found.noise_floor,
    )
    if found.skeleton is not None:
        what = "Residual relative error where the joint moves, on held-out data"
        shares = found.after.relative_moving
        title = "Where the residual is"
        faces = None if robot is None else faces_of(robot)
        drawn = robot_chart(title, found.skeleton, found.joint_names, shares, what, faces)
        charts = (drawn, *charts)
    yield Charts(charts)
    if all(isnan(each) for each in found.after.relative_moving.values()):
        yield NOTHING_MOVES


def error_tables(found: Diagnosis, detail: Detail) -> list[Table]:
    """Where the joints move; with more detail every part, and another table over all samples."""
    if not detail:
        return [_moving(found)]
    parts = [_parts(found)] if _has_parts(found) else []
    return [_moving(found), *parts, _all_samples(found)]


def _moving(found: Diagnosis) -> Table:
    rows = []
    for joint, unit in _joints(found):
        row = _row(found, joint, unit, moving=True)
        if found.noise_floor is not None:
            row["repeatability"] = figure(found.noise_floor.get(joint, nan))
        if _has_parts(found):
            row[_OFF] = _taken_off(found, joint)
        rows.append(row)
    errors = {
        name: percent(each.mean_relative_moving) for name, each in errors_by_model(found).items()
    }
    title = (
        f"Error of the torque on held-out data ({found.held_out_run}), where joints move "
        f"({_columns_in_words(found)})"
    )
    return _with_mean(title, rows, errors)


def _with_mean(
    title: str, rows: list[dict[str, str]], means: dict[str, str], folded: bool = False
) -> Table:
    last, every = (len(rows),), [*rows, {"joint": "mean", **means}]
    look = {"bold": last, "parted": last, "folded": folded}
    return Table.of(title, every, ("joint", "unit"), words=(_OFF,), **look)


def _row(found: Diagnosis, joint: str, unit: str, moving: bool) -> dict[str, str]:
    errors = {
        name: percent((each.relative_moving if moving else each.relative)[joint])
        for name, each in errors_by_model(found).items()
    }
    before, after = ((_rms(each) if moving else each.rms) for each in (found.before, found.after))
    rms = {"RMS declared": figure(before[joint]), "RMS with effects": figure(after[joint])}
    raw = {} if moving else {"RMS unfiltered": figure(found.after.rms_raw[joint])}
    return {"joint": joint, **errors, **rms, **raw, "unit": unit}


def _columns_in_words(found: Diagnosis) -> str:
    """What the heads mean, of the columns that there are."""
    given = "" if found.untouched is None else "URDF as given; "
    if found.textbook is None:
        return f"{given}declared model refitted"
    return f"{given}declared model and textbook friction, both refitted"


def errors_by_model(found: Diagnosis) -> dict[str, Errors]:
    """By heads of columns."""
    known = {
        "URDF": found.untouched,
        "declared": found.before,
        "textbook": found.textbook.error if found.textbook else None,
        "with effects": found.after,
    }
    return {head: each for head, each in known.items() if each is not None}


def _joints(found: Diagnosis) -> Iterator[tuple[str, str]]:
    """Those whose torque was measured, with its unit."""
    every = zip(found.joint_names, found.torque_units, strict=True)
    return ((joint, unit) for joint, unit in every if not isnan(found.after.rms[joint]))


def _rms(error: Errors) -> dict[str, float]:
    """Where joints move; over all samples where that is not known."""
    return error.rms_moving or error.rms


def _has_parts(found: Diagnosis) -> bool:
    return any(each.parts for each in found.effects)


def parts_of(found: Diagnosis, joint: str) -> list[tuple[str, float]]:
    """Who takes how much off the relative error of a joint, most first; all of it, to rounding."""
    everything = len(found.joint_names)
    parts = [
        (
            title_of(each.effect.kind)
            if each.effect.joints == (joint,) and not each.effect.runs and not each.effect.covariate
            else what_and_where(each.effect, everything),
            each.parts.get(joint, 0.0),
        )
        for each in found.effects
    ]
    if found.inertia_parts:
        parts.append(("fit of the inertias", found.inertia_parts[joint]))
    return sorted(parts, key=lambda part: -abs(part[1]))


def _taken_off(found: Diagnosis, joint: str) -> str:
    """The largest parts in words, and the rest in one number."""
    parts = parts_of(found, joint)
    whole = sum(part for _, part in parts)
    if isnan(whole):
        return "-"
    if max(abs(part) for _, part in parts) < _NOTHING:
        return ""
    named = [p for p in parts if abs(p[1]) >= _WORTH * abs(whole)][:_NAMED]
    rest = parts[len(named) :]
    told = [f"{name} {-100 * part:+.1f}" for name, part in named]
    others = sum(part for _, part in rest)
    if abs(others) >= _NOTHING:
        told.append(f"{len(rest)} other{'s' * (len(rest) > 1)} {-100 * others:+.1f}")
    return ", ".join(told)


def _parts(found: Diagnosis) -> Table:
    """Every joint's way from the first error to the last, by all that takes a part off."""
    begin, unit = found.baseline, dict(_joints(found))
    rows: list[tuple[str, ...]] = []
    parted: list[int] = []
    for joint in found.joint_names:
        parts = parts_of(found, joint)
        relative, rms = begin.relative_moving[joint], _rms(begin)[joint]
        if isnan(relative):
            continue
        scale = rms / relative if relative else 0.0
        parted.append(len(rows))
        first = _LINES[0] if found.inertia_parts else _LINES[1]
        rows.append((joint, first, f"{100 * relative:.2f}", figure(rms), unit[joint]))
        worth = [p for p in parts if abs(p[1]) >= _SEEN * abs(relative)]
        if rest := parts[len(worth) :]:
            others = f"{len(rest)} other{'s' * (len(rest) > 1)}"
            worth.append((others, sum(part for _, part in rest)))
        rows += [
            ("", name, f"{-100 * part:+.2f}", f"{-part * scale:+.3g}", unit[joint])
            for name, part in worth
        ]
        after = found.after.relative_moving[joint]
        rows.append(("", _LINES[2], f"{100 * after:.2f}", figure(after * scale), unit[joint]))
    return Table(
        "Change of the error by each effect (Shapley share: mean over orders), where joints move",
        ("joint", "contribution", "error or change, %", "RMS", "unit"),
        tuple(rows),
        left=("joint", "unit"),
        words=("contribution",),
        parted=tuple(parted[1:]),
        folded=True,
    )


def _all_samples(found: Diagnosis) -> Table:
    rows = [_row(found, joint, unit, moving=False) for joint, unit in _joints(found)]
    title = (
        f"Over all samples of {found.held_out_run}, including joints at rest (unfiltered: with "
        "effects, the torque as recorded)"
    )
    errors = {name: percent(each.mean_relative) for name, each in errors_by_model(found).items()}
    return _with_mean(title, rows, errors, folded=True)


# The robot in its posture, as it is drawn beside the errors.

_SMALL = 1 / 35  # of the robot's size: detail that is left out


def faces_of(robot: Robot) -> Faces | None:
    """Its visual shapes, without small detail; None where there are none."""
    poses = Poses.of(robot, robot.posture[None])
    reach = float(np.ptp(poses.translations[0], axis=0).max()) or 1.0
    bodies = robot_bodies(robot, _SMALL * reach)[0]
    corners = [
        poses.points(body.joint, body.surface.points)[0][body.surface.faces] for body in bodies
    ]
    if not any(len(each) for each in corners):
        return None
    joints = np.repeat([_mover(robot, body.joint) for body in bodies], [len(c) for c in corners])
    return Faces(np.concatenate(corners), joints)


def _mover(robot: Robot, joint: int) -> int:
    """The moved joint that carries a joint of the model; how many there are if none does."""
    own = [int(each) for each in robot.model_joints]
    while joint > 0 and joint not in own:
        joint = int(robot.model.parents[joint])
    return own.index(joint) if joint > 0 else robot.n
