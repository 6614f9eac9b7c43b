"""MATLAB's `.mat` up to version 7: variables t, q, tau[, dq], each (T, n) or (n, T)."""

from pathlib import Path
from typing import Any

import numpy as np

from excite_cli.errors import FileError
from excite_cli.measurement.arrange import listed
from excite_cli.measurement.dataset import Array
from excite_cli.measurement.reader import (
    CHANNELS,
    RawRun,
    Reader,
    ReadOptions,
    check_size,
    check_values,
    times_from_rate,
)


class MatReader(Reader):
    """MATLAB's files of variables."""

    title = "MATLAB"
    suffixes = (".mat",)

    def read(self, path: Path, wanted: ReadOptions) -> list[RawRun]:
        """The file's only run; columns carry numbers unless a variable joint_names names them."""
        held = _variables(path)
        check_values(path, sum(values.size for values in held.values()))
        words = listed([*held])
        time = wanted.called("t")
        stamped = time is not None and time in held
        found = {name: held[called] for name in CHANNELS if (called := wanted.called(name)) in held}
        missing = [name for name in wanted.needed if name not in found]
        if missing:
            raise FileError(
                f"{path} has no variable '{wanted.called(missing[0])}'; its variables: {words}. "
                f"Another name: measurement.channels: {{{missing[0]}: …}}."
            )
        samples = held[str(time)].size if stamped else max(found["q"].shape)
        t = held[str(time)].ravel() if stamped else times_from_rate(path, samples, wanted, words)
        named = _names(path)
        columns = {}
        for channel, values in found.items():
            rows = values if len(values) == samples else values.T
            if len(rows) != samples:
                raise FileError(
                    f"{path}: '{channel}' is {' x '.join(map(str, values.shape))}; {samples} "
                    "instants are expected, as rows or as columns."
                )
            width = rows.shape[1]
            names = named if len(named) == width else [str(k + 1) for k in range(width)]
            columns[channel] = dict(zip(names, np.ascontiguousarray(rows.T, float), strict=True))
        numbered = all(name.isdigit() for name in columns["q"])
        return [RawRun("", np.asarray(t, float), columns, {}, numbered, not stamped)]


def _loaded(path: Path) -> dict[str, Any]:
    from scipy.io import loadmat  # takes a moment to import
    from scipy.io.matlab import MatReadError

    check_size(path)
    try:
        return dict(loadmat(path, squeeze_me=False, chars_as_strings=True))
    except NotImplementedError as error:
        raise FileError(
            f"{path} is of MATLAB's version 7.3. Save it with save(…, '-v7'), or as HDF5 with "
            "datasets t, q, tau."
        ) from error
    except (MatReadError, ValueError, TypeError, KeyError, OSError, EOFError) as error:
        raise FileError(f"{path} is no readable MATLAB file: {error}.") from error


def _variables(path: Path) -> dict[str, Array]:
    found = {}
    for name, values in _loaded(path).items():
        if isinstance(values, np.ndarray) and values.dtype.kind in "fiu" and values.ndim == 2:
            found[name] = values
    return found


def _names(path: Path) -> list[str]:
    """What a variable joint_names holds: a cell of texts, or rows of characters."""
    given = _loaded(path).get("joint_names")
    if not isinstance(given, np.ndarray):
        return []
    return [str(np.ravel(each)[0] if np.size(each) else "").strip() for each in given.ravel()]
