"""Simulated runs and what was put into the robot, as tables and as data."""

from math import isfinite
from typing import Any

import numpy as np

from excite_cli.diagnosis.records import by_joint
from excite_cli.fields import data_of
from excite_cli.scoring.records import Replay, ReplayedModel, SetPointReplay
from excite_cli.shown.answer import Answer, Parts, Table, show
from excite_cli.simulation.simulate import Simulation

# How far models drift from the robot when its torques are played on them.


def replay_answer(found: Replay) -> Answer:
    """What `excite replay` answers; status 1 where the deviation did not fall."""
    return Answer(tuple(replay_parts(found)), _data(found), found.good)


def replay_parts(found: Replay) -> Parts:
    """A sentence, the deviations, and what the simulator cannot hold."""
    rows = (
        {
            "joint": joint,
            "URDF": "" if found.before is None else f"{1e3 * found.before[joint]:.2f}",
            "model": f"{1e3 * after:.2f}",
            "unit": "mm" if joint in found.sliding else "mrad",
        }
        for joint, after in found.after.items()
    )
    table = Table.of("Deviation from the measured motion, RMS", rows, left=("joint", "unit"))
    return [_replay_in_words(found), table, *found.notes]


def _replay_in_words(found: Replay) -> str:
    before, after = found.means
    over = f"{found.seconds:.3g} s of recorded torques"
    lost = f" {' and '.join(found.lost)} left all bounds." if found.lost else ""
    all_slide = set(found.after) <= set(found.sliding)
    unit = "mm" if all_slide else "mrad (mm)" if found.sliding else "mrad"
    if before is None:
        return f"Driven by {over}, the model deviates by {1e3 * after:.3g} {unit} RMS.{lost}"
    worse = "" if found.good else ", which is no improvement"
    return (
        f"Driven by {over}, the model deviates from the robot by {1e3 * after:.3g} {unit} RMS "
        f"(URDF: {1e3 * before:.3g} {unit}; mean over joints){worse}.{lost}"
    )


def _data(found: Replay) -> dict[str, Any]:
    """The answer for `--json`."""
    before, after = found.means
    return {
        "good": found.good,
        "answer": _replay_in_words(found),
        "runs": list(found.names),
        "mean": {"before": before, "after": after},
        **data_of(found, "seconds", "before", "after", "lost", "notes"),
    }


show(Replay, _replay_in_words, replay_parts)


def simulation_answer(found: Simulation, output: str, seed: int) -> Answer:
    """What `excite simulate` answers; `output` is the file of the data."""
    joints = found.dataset.joint_names
    data = {
        "runs": [
            {
                "name": run.name,
                "samples": len(run.t),
                "duration": run.duration,
                "tracking_error": by_joint(joints, found.tracking[run.name]),
                **(
                    {"largest_error": by_joint(joints, found.lag[run.name])}
                    if run.name in found.lag
                    else {}
                ),
            }
            for run in found.dataset.runs
        ],
        "effects": _records(found),
        "output": output,
        "seed": seed,
    }
    return Answer((*simulation_parts(found), output), data)


def simulation_parts(found: Simulation) -> Parts:
    """The runs, and the effects in the robot."""
    records = _records(found)
    lag = [_lag_in_words(found)] if found.lag else []
    return [_run_table(found), *lag, *([_effect_table(records)] if records else [])]


def _lag_in_words(found: Simulation) -> str:
    """How far a robot that follows set points is from them, where that is most."""
    run, joint, error = found.farthest
    unit = "m" if found.truth.sliding[joint] else "rad"
    name = found.dataset.joint_names[joint]
    return f"Largest distance to the set points: {error:.3g} {unit} at '{name}' in {run}."


def _records(found: Simulation) -> list[dict[str, Any]]:
    truth = found.truth
    return [each.record(truth.joint_names, truth.sliding) for each in truth.effects]


def _run_table(found: Simulation) -> Table:
    """Tracking of joints that turn and of joints that slide, each where there are some."""
    names = found.dataset.joint_names
    slides = found.truth.sliding[-len(names) :]  # a base's joints come first and are not driven
    kinds = [(unit, of) for unit, of in (("mrad", ~slides), ("mm", slides)) if of.any()]
    rows = []
    for run in found.dataset.runs:
        error = 1e3 * found.tracking[run.name]
        worst = int(np.argmax(error))
        tracking = {
            f"RMS over joints [{unit}]": f"{np.sqrt(np.mean(error[of] ** 2)):.3f}"
            for unit, of in kinds
        }
        row = {
            "run": run.name,
            "samples": str(len(run.t)),
            "seconds": f"{run.duration:.2f}",
            **tracking,
            "worst joint's RMS": f"{error[worst]:.3f} {'mm' if slides[worst] else 'mrad'}",
            "joint": names[worst],
        }
        rows.append(row)
    return Table.of("Runs (tracking error)", rows, left=("run", "joint"))


def _effect_table(records: list[dict[str, Any]]) -> Table:
    rows = []
    for record in records:
        values = (
            f"{name} {each['value'] + 0.0:.4g}" + f" {each['unit']}" * (each["unit"] != "1")
            for name, each in record["parameters"].items()
        )
        row = {
            "effect": record["kind"],
            "joints": ", ".join(record["joints"]),
            "parameters": ", ".join(values),
            "runs": ", ".join(record["runs"]) or "all",
            "in the config": "yes" if record["declared"] else "no",
        }
        rows.append(row)
    left, words = ("effect", "in the config"), ("joints", "parameters", "runs")
    return Table.of("Effects in the robot", rows, left, words)


def _in_words(found: Simulation) -> str:
    """`motion_1, motion_2; coulomb_friction@elbow`."""
    runs = ", ".join(run.name for run in found.dataset.runs)
    effects = ", ".join(
        f"{record['kind']}@{','.join(record['joints'])}" for record in _records(found)
    )
    return f"{runs}; {effects or 'no effects'}"


show(Simulation, _in_words, simulation_parts)


def set_point_answer(found: SetPointReplay) -> Answer:
    """What `excite replay` answers where set points were played; status 1: no improvement."""
    return Answer(tuple(_parts(found)), _played_data(found), found.good)


def _parts(found: SetPointReplay) -> Parts:
    columns = [f"{horizon:g} s" for horizon in found.horizons]
    rows = []
    for joint in found.models[-1].whole:
        for model in found.models:
            after = zip(columns, model.after[joint], strict=True)
            rows.append({
                "joint": joint,
                "model": model.name,
                **{column: _milli(value) for column, value in after},
                "whole log": _milli(model.whole[joint]),
                "unit": "mm" if joint in found.sliding else "mrad",
            })  # fmt: skip
    title = "Deviation from the measured motion, RMS: so long after a start, and over the log"
    table = Table.of(title, rows, left=("joint", "model", "unit"))
    return [_played_in_words(found), table, *found.notes]


def _milli(value: float) -> str:
    return f"{1e3 * value:.2f}" if isfinite(value) else ""


def _played_in_words(found: SetPointReplay) -> str:
    model = found.models[-1]
    unit = "mrad (mm)" if found.sliding else "mrad"
    others = "; ".join(f"{each.name}: {1e3 * each.mean:.3g} {unit}" for each in found.models[:-1])
    beside = f" ({others}; mean over joints)" if others else " (mean over joints)"
    worse = "" if found.good else ", which is no improvement"
    lost = [each.name for each in found.models if each.lost]
    fell = f" {' and '.join(lost)} left all bounds." if lost else ""
    return (
        f"Driven by {found.seconds:.3g} s of recorded set points, the model deviates from the "
        f"robot by {1e3 * model.mean:.3g} {unit} RMS{beside}{worse}.{fell}"
    )


def _played_data(found: SetPointReplay) -> dict[str, Any]:
    """The answer for `--json`."""
    return {
        "good": found.good,
        "answer": _played_in_words(found),
        "runs": list(found.names),
        **data_of(found, "seconds", "horizons", "starts", "notes"),
        "models": [_of_model(each) for each in found.models],
    }


def _of_model(model: ReplayedModel) -> dict[str, Any]:
    after = {
        joint: [x if isfinite(x) else None for x in values] for joint, values in model.after.items()
    }
    mean = {"after": [x if isfinite(x) else None for x in model.means()], "whole": model.mean}
    return {
        "name": model.name, "after": after, "whole": model.whole, "mean": mean, "lost": model.lost,
    }  # fmt: skip


show(SetPointReplay, _played_in_words, _parts)
