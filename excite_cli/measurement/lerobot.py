"""LeRobot's datasets: their files, and their columns in our names.

`data/chunk-000/` has a file per episode (`episode_000000.parquet`, 2.1) or of several (`file-000`,
3.0); `meta/info.json` names the entries of a column, as `elbow.pos`, `elbow.torque` or `elbow`.
"""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from excite_cli.errors import FileError
from excite_cli.measurement.dataset import Array

STATE = "observation.state"
EPISODE = "episode_index"
_COUNTS = (EPISODE, "frame_index", "index", "task_index")
# Of the joints of the state; the other columns keep their names.
_FEATURES = {"velocity": "dq", "effort": "tau", "torque": "tau", "current": "current"}
_ENDINGS = {
    "pos": "q", "q": "q", "vel": "dq", "dq": "dq", "torque": "tau", "effort": "tau", "tau": "tau",
    "current": "current",
}  # fmt: skip
_MAX_INFO = 2**24  # bytes


def files_of(folder: Path) -> list[Path]:
    """Files of a dataset's folder, in the order of its episodes; none where it is no dataset."""
    is_dataset = (folder / "meta" / "info.json").is_file()
    return sorted(folder.glob("data/*/*.parquet")) if is_dataset else []


def in_our_names(path: Path, columns: Mapping[str, Array]) -> dict[str, Array]:
    """Columns (T,) as `t` [s], `q_<joint>`, `dq_<joint>`, `tau_<joint>`, and what else there is."""
    features = _features(path)
    found: dict[str, Array] = {}
    for feature, values in columns.items():
        if feature == "timestamp" and values.ndim == 1:
            found["t"] = values
        elif feature not in _COUNTS and not feature.startswith("next."):
            matrix = values.reshape(len(values), -1)
            names = _entries(features, feature, matrix.shape[1])
            for name, column in zip(names, matrix.T, strict=True):
                found[name if name not in found else f"{feature}.{name}"] = column
    return found


def _entries(features: Mapping[str, Any], feature: str, width: int) -> Iterator[str]:
    """What the entries of a column are called; they carry numbers where nothing names them."""
    short = feature.removeprefix("observation.")
    sources = (feature, STATE) if short in _FEATURES else (feature,)
    named = (_listed(features.get(source)) for source in sources)
    numbers = [str(k + 1) for k in range(width)]
    for entry in next((names for names in named if len({*names}) == len(names) == width), numbers):
        joint, _, ending = entry.rpartition(".")
        if not joint or ending not in _ENDINGS:
            joint, ending = entry, "pos"
        channel = _ENDINGS[ending] if feature == STATE else _FEATURES.get(short, short)
        yield f"{channel}_{joint}"


def _listed(feature: Any) -> list[str]:
    """Names of a feature: a list, one in a list, `{"motors": […]}`, or `{name: its number}`."""
    names = feature.get("names") if isinstance(feature, dict) else None
    if isinstance(names, dict) and all(isinstance(each, int) for each in names.values()):
        names = sorted(names, key=names.__getitem__)
    elif isinstance(names, dict):
        names = list(names.values())
    while isinstance(names, list) and len(names) == 1 and isinstance(names[0], list):
        names = names[0]
    good = isinstance(names, list) and all(isinstance(each, str) for each in names)
    return names if isinstance(names, list) and good else []


def _features(path: Path) -> Mapping[str, Any]:
    """What `meta/info.json` says of the columns; nothing where it is not beside `data`."""
    beside = (folder / "meta" / "info.json" for folder in path.absolute().parents[:3])
    info = next((each for each in beside if each.is_file()), None)
    if info is None:
        return {}
    try:
        if info.stat().st_size > _MAX_INFO:
            raise ValueError(f"more than {_MAX_INFO // 2**20} MiB")
        return dict(json.loads(info.read_text(encoding="utf-8"))["features"])
    except (OSError, ValueError, TypeError, KeyError, RecursionError) as error:
        raise FileError(
            f"{info} does not describe LeRobot's columns ({error!s:.200}). Restore it; without it "
            "columns carry numbers, which stand for the moved joints in their order."
        ) from error
