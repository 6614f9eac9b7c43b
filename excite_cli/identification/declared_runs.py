"""Runs and columns that effects of the configuration name must be in the data."""

from excite_cli.config.spec import Spec
from excite_cli.errors import ConfigError, nearest
from excite_cli.identification.declared_states import check_states
from excite_cli.identification.split import Split
from excite_cli.measurement.dataset import Dataset


def check_declared_runs(spec: Spec, dataset: Dataset) -> None:
    """Refuse effects and states that are declared for a run which `dataset` does not hold.

    And effects that follow a column which is not declared.

    Raises
    ------
    ConfigError
        There is no run or column of such a name, or a state is of a kind that all runs share.
    """
    names, columns = dataset.names, spec.measurement.covariates
    for index, effect in enumerate(spec.effects or ()):
        if effect.covariate and effect.covariate not in columns:
            raise ConfigError(
                f"effects[{index}].covariate: '{effect.covariate}' is not declared."
                f"{nearest(effect.covariate, columns)} measurement.covariates: "
                f"{', '.join(columns) or 'none'}."
            )
        for name in () if effect.runs == "all" else effect.runs:
            if name not in names:
                raise ConfigError(
                    f"effects[{index}].runs: there is no run '{name}' in the data."
                    f"{nearest(name, names)} Runs: {', '.join(names)}."
                )
    check_states(spec.runs, names)
    known = spec.identification.known_payload
    for name in known.runs if known else ():
        if name not in names:
            raise ConfigError(
                f"identification.known_payload.runs: there is no run '{name}' in the data."
                f"{nearest(name, names)} Runs: {', '.join(names)}."
            )


def check_left_to_fit(spec: Spec, parts: Split) -> None:
    """Refuse effects, or a known payload, of sealed runs only: nothing would be fitted of them.

    Raises
    ------
    ConfigError
        There is such an effect.
    """
    declared = [
        (f"effects[{index}]", each.kind, () if each.runs == "all" else each.runs)
        for index, each in enumerate(spec.effects or ())
    ]
    needed = spec.identification.needed_runs
    for where, what, names in [*declared, ("identification.known_payload", "the payload", needed)]:
        if names and not any(run.id.is_among(names) for run in parts.training):
            others = [unit for unit in parts.units if unit not in (*names, parts.sealed_name)]
            instead = f" Seal another run: --sealed '{others[-1]}'." if others else ""
            raise ConfigError(
                f"{where}.runs: '{', '.join(names)}' is sealed, so that nothing is left "
                f"to fit {what} on.{instead}"
            )
