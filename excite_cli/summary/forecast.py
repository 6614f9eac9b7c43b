"""The error to expect on a job, in a sentence, as a table and as data."""

from math import isfinite

from excite_cli.fields import data_of
from excite_cli.scoring.forecast import Forecast
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
    rows = [
        {
            "joint": name,
            "torque RMS": f"{each.torque:.3g} {unit}",
            "expected error": f"{each.error:.3g} {unit}" if isfinite(each.error) else "not known",
            "share": percent(each.share) if isfinite(each.share) else "",
            "speed": _times(each.faster, each.fastest),
            "load": _times(each.heavier, each.heaviest),
            "position": _times(each.farther, each.farthest),
        }
        for (name, each), unit in zip(found.joints.items(), found.torque_units, strict=True)
    ]
    note = (
        "Where the joint moves. expected error: noise, parameters, and what the model lacks, as "
        "one standard deviation; speed, load, position: how many times those of the model's own "
        "data at most, where beyond them (positions from the middle of the own ones)."
    )
    return [_sentence(found), Table.of("", rows, left=("joint",)), note]


def _sentence(found: Forecast) -> str:
    made = ""
    if found.made is not None:
        made = f" ({percent(found.made)} on its own held-out data"
        made += (
            f", where {percent(found.usual)} would be expected)" if isfinite(found.usual) else ")"
        )
    told = f"Expect an error of {percent(found.mean_share)} of the torque where joints move{made}."
    if not found.outside:
        return f"{told} All joints stay within the positions, speeds and loads of the model's data."
    more = len(found.outside) - _NAMED
    named = ", ".join(found.outside[:_NAMED]) + (f" and {more} more" if more > 0 else "")
    return f"{told} Beyond the positions, speeds or loads of the model's data: {named}."


def _times(share: float, most: float) -> str:
    return f"{most:.1f} x" if share > 0.0 else ""


show(Forecast, _sentence, forecast_parts)
