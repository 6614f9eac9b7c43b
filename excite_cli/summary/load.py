"""What the robot carries, as a table and as data."""

from typing import Any

from excite_cli.fields import data_of
from excite_cli.identification.carried_load import LoadIdentification
from excite_cli.identification.fit_words import with_deviation
from excite_cli.shown.answer import Answer, Parts, Table
from excite_cli.shown.record import show
from excite_cli.summary.cells import findings_data, percent


def load_answer(found: LoadIdentification) -> Answer:
    """What `excite identify --only payload` answers; status 1 where no body is so."""
    return Answer(tuple(load_parts(found)), _data(found), found.possible)


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
        _in_words(found),
        Table.of(title, rows, left=("parameter", "unit")),
        Table.of("Torque error on these data, where the joint moves", errors, left=("joint",)),
    ]


def _in_words(found: LoadIdentification) -> str:
    """Mass and centre, from how much data."""
    mass = found.parameters["mass"]
    centre = ", ".join(with_deviation(1e3 * p.value, 1e3 * p.std) for p in _centre(found))
    doubt = "" if found.possible else " These values are physically infeasible."
    if any(each.kind == "more_than_a_load" for each in found.findings):
        doubt += " The data contain more than a rigid payload, which the ± do not cover."
    return (
        f"{found.link} carries {with_deviation(mass.value, mass.std)} kg with its centre at "
        f"({centre}) mm, from {found.seconds:.3g} s of motion.{doubt}"
    )


def _centre(found: LoadIdentification) -> list[Any]:
    return [found.parameters[name] for name in ("cx", "cy", "cz")]


def _data(found: LoadIdentification) -> dict[str, Any]:
    """The answer for `--json`."""
    return {
        "good": found.possible,
        **data_of(found, "link", "joint", "parameters", "values", "covariance", "seconds"),
        "error": {**data_of(found, "without", "with_load"), "of_the_fit": found.fit_error},
        "findings": findings_data(found.findings),
    }


show(LoadIdentification, _in_words, load_parts)
