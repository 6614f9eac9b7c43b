"""The error to expect on a job, in a sentence, as a table and as data."""

from math import isfinite

from excite_cli.fields import data_of
from excite_cli.scoring.forecast import Forecast, JointForecast
from excite_cli.shown.answer import Answer, Parts, Table, show
from excite_cli.summary.cells import percent

_NAMED = 4  # joints in a sentence


def forecast_answer(found: Forecast) -> Answer:
    """What `excite score --job` answers; status 1 where more error is to be expected than usual."""
    data = data_of(found)
    data["mean_share"], data["outside"] = found.mean_share, list(found.outside)
    return Answer(tuple(forecast_parts(found)), data, found.good)


def forecast_parts(found: Forecast) -> Parts:
    """The sentence, and a row for each joint."""
    names = ("joint", "torque RMS", "expected error", "share", "outside the model's data")
    rows = tuple(
        (
            name,
            f"{each.torque:.3g} {unit}",
            f"{each.error:.3g} {unit}" if isfinite(each.error) else "not known",
            percent(each.share) if isfinite(each.share) else "",
            _outside(each),
        )
        for (name, each), unit in zip(found.joints.items(), found.torque_units, strict=True)
    )
    left = ("joint", "outside the model's data")
    note = (
        "where the joint moves. expected error: noise, parameters, what the model lacks, as one "
        "standard deviation"
    )
    return [
        _sentence(found),
        Table("", names, rows, left=left, words=left[1:], note=note),
    ]


def _sentence(found: Forecast) -> str:
    made = "" if found.made is None else f" ({percent(found.made)} on its own held-out data)"
    told = f"Expect an error of {percent(found.mean_share)} of the torque where joints move{made}."
    if not found.outside:
        return f"{told} All joints stay within the positions, speeds and loads of the model's data."
    more = len(found.outside) - _NAMED
    named = ", ".join(found.outside[:_NAMED]) + (f" and {more} more" if more > 0 else "")
    return f"{told} Beyond the positions, speeds or loads of the model's data: {named}."


def _outside(joint: JointForecast) -> str:
    if not joint.outside:
        return ""
    told = [
        f"{what}, up to {most:.1f} times"
        for what, share, most in (
            ("faster", joint.faster, joint.fastest),
            ("more load", joint.heavier, joint.heaviest),
            ("other positions", joint.farther, joint.farthest),
        )
        if share > 0.0
    ]
    return ", ".join(told)


show(Forecast, _sentence, forecast_parts)
