"""Further columns of the log that effects may follow: temperatures, a neighbour's current.

They are called as the file calls them; `<channel>_<joint>` where they belong to a joint (columns of
an HDF5 array too), `<channel>_<number>` in any other array. They are often slower than the rest: a
sample without a value takes it from its neighbours, linearly, and nothing else is filtered.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from excite_cli.errors import ConfigError, FileError, nearest
from excite_cli.measurement.arrange import listed
from excite_cli.measurement.dataset import Array, Dataset, Finding, Run
from excite_cli.measurement.missing_values import filled_between, known_values
from excite_cli.measurement.reader import CHANNELS, SENT, RawRun
from excite_cli.measurement.stretches import longest

_KEY = "measurement.covariates"
_LONG = 10.0  # s without a value: a motor's winding may have warmed up by then
_OUR_OWN = ("q_ref", "valid", *SENT)  # channels that are known to be something else


def further_columns(raw: RawRun, names: Mapping[str, str]) -> dict[str, Array]:
    """All columns (T,) of a run by name; `names` are those of joints in the file -> the robot's."""
    found: dict[str, Array] = {}
    for name, values in raw.others.items():
        found |= _of_array(name, values)
    for channel, columns in raw.columns.items():
        for joint, values in columns.items():
            found[f"{channel}_{joint}"] = values
            found.setdefault(f"{channel}_{names.get(joint, joint)}", values)
        if len(columns) == 1:  # the reader takes any column for that of an only joint
            found.setdefault(channel, next(iter(columns.values())))
    return found


def _of_array(name: str, values: Array) -> dict[str, Array]:
    if values.ndim == 1:
        return {name: values}
    return {f"{name}_{k}": column for k, column in enumerate(values.T, 1)}


@dataclass
class DeclaredCovariates:
    """The columns that a configuration declares, taken from one recording after the other.

    Those that are `told` of need no word: they are declared as something else.
    """

    names: tuple[str, ...]
    told: Callable[[str], bool] = lambda name: False
    _known: dict[str, list[str]] = field(default_factory=dict)
    _untold: dict[str, None] = field(default_factory=dict)

    def take(self, run: Run, raw: RawRun, joints: Mapping[str, str]) -> Run:
        """The run with those of them that it has; `check` says which it lacks."""
        columns = further_columns(raw, joints)
        where = f"{run.origin.file}, run {run.name}" if run.origin.file else f"run {run.name}"
        self._known[where] = list(columns)
        if not self.names:
            worth = (name for name in _worth_telling(raw) if not self.told(name))
            self._untold.update(dict.fromkeys(worth))
        own = {name: columns[name].astype(float) for name in self.names if name in columns}
        return replace(run, covariates=own)

    def check(self) -> list[Finding]:
        """What is to be said of all recordings.

        Raises
        ------
        ConfigError
            No recording has a column of such a name.
        FileError
            One has, another one does not.
        """
        everywhere = list(dict.fromkeys(name for known in self._known.values() for name in known))
        for name in self.names:
            lacking = [where for where, known in self._known.items() if name not in known]
            if len(lacking) == len(self._known):
                raise ConfigError(
                    f"{_KEY}: no file has a column '{name}'.{nearest(name, everywhere)} "
                    f"The files have: {listed(everywhere)}."
                )
            if lacking:
                raise FileError(
                    f"{lacking[0]}: there is no column '{name}' ({_KEY}), which other runs have. "
                    f"It has: {listed(self._known[lacking[0]])}. Leave the run out, or '{name}' "
                    f"out of {_KEY}."
                )
        if not self._untold:
            return []
        text = (
            f"unused columns: {listed(list(self._untold))}. One that friction or offsets depend on "
            f"(a temperature) can be declared: {_KEY}: [NAME]"
        )
        return [Finding("further_columns", "note", text)]


def _worth_telling(raw: RawRun) -> Iterator[str]:
    """Columns that are not known to be something else and do change; one name for all joints."""
    for name, values in raw.others.items():
        if name not in _OUR_OWN and name not in CHANNELS and values.ndim == 1 and _changes(values):
            yield name
    for channel, columns in raw.columns.items():
        if channel not in (*_OUR_OWN, *CHANNELS) and any(map(_changes, columns.values())):
            yield f"{channel}_<joint>" if len(columns) > 1 else f"{channel}_{next(iter(columns))}"


def _changes(values: Array) -> bool:
    known = values[known_values(values)]
    return bool(len(known)) and bool(np.ptp(known) > 0.0)


def without_missing_covariates(run: Run) -> tuple[Run, list[Finding]]:
    """The run with a value of every covariate in every sample, and what was missing."""
    findings: list[Finding] = []
    whole = {}
    for name, values in run.covariates.items():
        known = known_values(values)
        whole[name] = filled_between(values)
        if not known.any():
            text = (
                f"column {name} has no value at all. Leave the run out, or '{name}' out of {_KEY}"
            )
            findings.append(Finding("dead", "error", text, run.name))
        elif not known.all():
            findings.append(_told(run, name, longest(~known)))
    return replace(run, covariates=whole), findings


def _told(run: Run, name: str, samples: int) -> Finding:
    steps = np.diff(run.t)
    seconds = samples * float(np.median(steps)) if len(steps) else 0.0
    if seconds <= _LONG:
        text = f"column {name}: samples without a value are interpolated"
        return Finding("interpolated", "note", text, run.name)
    text = f"column {name} has no value for up to {seconds:.3g} s; interpolated there"
    return Finding("interpolated", "warning", text, run.name)


def with_declared(dataset: Dataset, names: Sequence[str]) -> Dataset:
    """Data at hand with the declared columns, from the further channels of their runs.

    Raises
    ------
    ConfigError
        A run lacks one.
    FileError
        A value is NaN or infinite.
    """
    return replace(dataset, runs=tuple(_with_declared(run, names) for run in dataset.runs))


def _with_declared(run: Run, names: Sequence[str]) -> Run:
    there = dict(run.covariates)
    for channel, values in run.extra.items():
        there = {**_of_array(channel, values), **there}
    for name in names:
        if name not in there:
            raise ConfigError(
                f"{_KEY}: run '{run.label}' has no channel '{name}'.{nearest(name, there)} "
                f"It has: {listed(list(there))}."
            )
        if not np.isfinite(there[name]).all():
            raise FileError(
                f"run '{run.label}': column {name} is NaN or infinite. `load_data` fills such "
                "samples in files; fill them in data of your own."
            )
    return replace(run, covariates={name: there[name] for name in names})
