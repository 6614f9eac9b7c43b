"""Set points played on models: how far they are from the robot, as tables and as data."""

from math import isfinite
from typing import Any

from excite_cli.fields import data_of
from excite_cli.scoring.records import ReplayedModel, SetPointReplay
from excite_cli.shown.answer import Answer, Parts, Table
from excite_cli.shown.record import show


def set_point_answer(found: SetPointReplay) -> Answer:
    """What `excite replay` answers where set points were played; status 1: no improvement."""
    return Answer(tuple(_parts(found)), _data(found), found.good)


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
    return [_in_words(found), table, *found.notes]


def _milli(value: float) -> str:
    return f"{1e3 * value:.2f}" if isfinite(value) else ""


def _in_words(found: SetPointReplay) -> str:
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


def _data(found: SetPointReplay) -> dict[str, Any]:
    """The answer for `--json`."""
    return {
        "good": found.good,
        "answer": _in_words(found),
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


show(SetPointReplay, _in_words, _parts)
