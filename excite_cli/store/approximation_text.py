"""What an effect only comes near, as files have it: a record, and a text in earlier versions."""

from collections.abc import Mapping
from typing import Any

from excite_cli.diagnosis.covariate import Covariate
from excite_cli.diagnosis.records import Approximation
from excite_cli.diagnosis.words import approximation_in_words
from excite_cli.effects.catalogue import catalogue

_FUNCTION = "a function of "
_SIMILAR = ("an effect of similar shape to ", "something that also looks like ")  # today, in 0.2


def approximation_as_data(found: Approximation | None) -> dict[str, Any]:
    """Entries of an effect's record: a text for people and readers of earlier files, and itself."""
    if found is None:
        return {"approximates": ""}
    codes = [covariate.code for covariate in found.covariates]
    return {
        "approximates": approximation_in_words(found),
        "approximation": {"covariates": codes, "kind": found.kind},
    }


def approximation_of(data: Mapping[str, Any]) -> Approximation | None:
    """The approximation in an effect's record, if it is one.

    Raises
    ------
    ValueError
        Nothing that a residual may depend on.
    """
    told = str(data.get("approximates", ""))
    if "approximation" in data:
        given = data["approximation"]
        return Approximation(_covariates(given["covariates"]), str(given["kind"]))
    if told.startswith(_FUNCTION):
        return Approximation(_covariates(told.removeprefix(_FUNCTION).split(", ")))
    if told.startswith(_SIMILAR):
        title = told.removeprefix(_SIMILAR[0]).removeprefix(_SIMILAR[1])
        kinds = [kind for kind, effect in catalogue().items() if effect.title == title]
        return Approximation(kind=kinds[0] if kinds else title)
    return None


def _covariates(codes: list[Any]) -> tuple[Covariate, ...]:
    return tuple(Covariate.of_code(str(code)) for code in codes)
