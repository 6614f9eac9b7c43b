"""Further columns of a simulated log, such as a temperature, and the words that ask for them.

`name=start[,end:value,time_constant:seconds,noise:sd]` warms up (or cools down) from `start` over
the campaign, `name=FILE.csv` follows the column `name` over `t` [s] of a table.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from excite_cli.errors import ConfigError, nearest
from excite_cli.measurement.text_table import read_table
from excite_cli.robot.model import Array

FORM = "name=start[,end:value,time_constant:seconds,noise:sd], or name=FILE.csv"
_TIME_CONSTANT = 600.0  # s, of a gear of medium size
_SPAN, _POINTS = 10.0, 400  # time constants after which nothing changes; points on the way


@dataclass(frozen=True)
class CovariateSeries:
    """`values` at the times `clock` of the campaign [s], linear between, the last one held.

    The robot follows `values`; what is recorded has `noise` (standard deviation) on it.
    """

    name: str
    clock: tuple[float, ...]
    values: tuple[float, ...]
    noise: float = 0.0

    @classmethod
    def warming(
        cls, name: str, start: float, end: float, time_constant: float, noise: float = 0.0
    ) -> "CovariateSeries":
        """end + (start − end) exp(−t/time_constant)."""
        clock = np.linspace(0.0, _SPAN * time_constant, _POINTS)
        values = end + (start - end) * np.exp(-clock / time_constant)
        return cls(name, tuple(clock.tolist()), tuple(values.tolist()), noise)

    def at(self, clock: Array) -> Array:
        """Values at times of the campaign, (T,)."""
        return np.interp(clock, self.clock, self.values)

    def recorded(self, clock: Array, rng: np.random.Generator) -> Array:
        """As the log has them, (T,)."""
        return self.at(clock) + self.noise * rng.normal(size=len(clock))


def parse_series(texts: Sequence[str]) -> tuple[CovariateSeries, ...]:
    """The columns that `texts` ask for.

    Raises
    ------
    ConfigError
        A text has another form, or a name comes twice.
    FileError
        A table cannot be read, or lacks a column.
    """
    found = tuple(map(_parsed, texts))
    names = [each.name for each in found]
    for name in names:
        if names.count(name) > 1:
            raise ConfigError(f"--covariate: '{name}' is given twice; each column once.")
    return found


def _parsed(text: str) -> CovariateSeries:
    where = f"--covariate '{text}'"
    name, equals, rest = (part.strip() for part in text.partition("="))
    if not (name and equals and rest):
        raise ConfigError(f"{where}: not of the form {FORM}.")
    if rest.lower().endswith((".csv", ".csv.gz")):
        return _of_table(name, Path(rest), where)
    first, *more = rest.split(",")
    start = finite_number(first, where)
    given = {"end": start, "time_constant": _TIME_CONSTANT, "noise": 0.0}
    for part in more:
        key, colon, number = (word.strip() for word in part.partition(":"))
        if not colon or key not in given:
            raise ConfigError(
                f"{where}: '{part}' is not one of {', '.join(f'{each}:value' for each in given)}."
                f"{nearest(key, given)}"
            )
        given[key] = finite_number(number, where)
    if given["time_constant"] <= 0.0 or given["noise"] < 0.0:
        raise ConfigError(f"{where}: time_constant must be positive, noise not negative.")
    return CovariateSeries.warming(name, start, **given)


def _of_table(name: str, path: Path, where: str) -> CovariateSeries:
    if not path.is_file():
        raise ConfigError(f"{where}: there is no file {path}.")
    columns = read_table(path).columns
    for wanted in ("t", name):
        if wanted not in columns:
            raise ConfigError(
                f"{where}: {path} has no column '{wanted}'.{nearest(wanted, columns)} It has: "
                f"{', '.join(columns)}."
            )
    t, values = columns["t"], columns[name]
    if not (np.isfinite(t).all() and np.isfinite(values).all() and (np.diff(t) > 0.0).all()):
        raise ConfigError(f"{where}: {path} must have finite numbers, and a t [s] that rises.")
    return CovariateSeries(name, tuple(t.tolist()), tuple(values.tolist()))


def finite_number(text: str, where: str) -> float:
    """The number of a text; ConfigError where it has none, or one that is not finite."""
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise ConfigError(f"{where}: '{text.strip()}' is not a finite number.")
    return value
