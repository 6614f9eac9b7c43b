"""Runs that the configuration names must be in the data."""

from excite_cli.config.data_spec import EffectSpec
from excite_cli.errors import ConfigError, nearest
from excite_cli.measurement.dataset import Dataset


def check_declared_runs(specs: tuple[EffectSpec, ...] | None, dataset: Dataset) -> None:
    """Refuse effects that are declared for a run which `dataset` does not hold.

    Raises
    ------
    ConfigError
        There is no run of such a name.
    """
    names = dataset.names
    for index, spec in enumerate(specs or ()):
        for name in () if spec.runs == "all" else spec.runs:
            if name not in names:
                raise ConfigError(
                    f"effects[{index}].runs: there is no run '{name}' in the data."
                    f"{nearest(name, names)} Runs: {', '.join(names)}."
                )
