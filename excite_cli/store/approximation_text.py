"""What an effect only comes near, as files have it."""

from collections.abc import Mapping
from typing import Any

from excite_cli.diagnosis.covariate import Covariate
from excite_cli.diagnosis.records import Approximation
from excite_cli.diagnosis.words import approximation_in_words


def approximation_as_data(found: Approximation | None) -> dict[str, Any]:
    """Entries of an effect's record: a text for people, and itself."""
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
    given = data.get("approximation")
    if given is None:
        return None
    covariates = tuple(Covariate.of_code(str(code)) for code in given["covariates"])
    return Approximation(covariates, str(given["kind"]))
