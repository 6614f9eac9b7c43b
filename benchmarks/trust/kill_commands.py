"""The commands that write, small enough to be killed hundreds of times, and what they write."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from PIL import Image

from excite_cli.config.data_spec import MeasurementSpec
from excite_cli.config.load_spec import load_spec
from excite_cli.measurement.catalogue import read_dataset
from excite_cli.motion_formats.catalogue import MOTION_FORMATS, read_own_motion
from excite_cli.store.diagnosis_file import read_diagnosis
from excite_cli.store.fit_file import read_fit
from excite_cli.store.result_file import read_result

ROOT = Path(__file__).resolve().parents[2]
SMOKE = str(ROOT / "configs" / "smoke.yaml")
ARM = str(ROOT / "data" / "smoke_arm.urdf")
# The writing is what is looked at: a few iterations, and nothing to prove but joint limits.
_SETTINGS = (
    "optimizer.max_iterations=2",
    "constraints.self_collision=null",
    "constraints.torque=null",
)
QUICK = tuple(word for setting in _SETTINGS for word in ("--set", setting))
N_MOTIONS = 4
Content = Any


@dataclass(frozen=True)
class Command:
    """Arguments of `excite`, run in a folder of its own, and how to read each file it writes.

    Inputs are in the folder `../inputs`. `resumable`: `--resume` goes on with what is there.
    """

    name: str
    arguments: tuple[str, ...]
    outputs: dict[str, Callable[[Path], Content]]
    resumable: bool = False


def numbers(path: Path) -> Content:
    """Everything in an HDF5 file but the seconds that something took, and the config's folder."""
    found: dict[str, Any] = {}
    with h5py.File(path, "r") as file:

        def keep(name: str, item: Any) -> None:
            if isinstance(item, h5py.Dataset):
                found[name] = (item.shape, str(item.dtype), _bits(item[()]))
            for key, value in item.attrs.items():
                if "seconds" not in key and key != "config_folder":
                    found[f"{name}@{key}"] = _bits(value)

        file.visititems(keep)
        keep("", file)
    return found


def _bits(value: Any) -> Any:
    array = np.asarray(value)
    return array.tolist() if array.dtype.hasobject else array.tobytes()


def _after(read: Callable[[Path], Any], content: Callable[[Path], Content], path: Path) -> Content:
    """The content of a file that its own reader takes."""
    read(path)
    return content(path)


def _without_seconds(path: Path) -> Content:
    return {name: bits for name, bits in numbers(path).items() if "seconds" not in name}


def _read_data(path: Path) -> None:
    with h5py.File(path) as file:
        names = tuple(file.attrs["joint_names"])
    read_dataset([path], MeasurementSpec(), names)


def _motion(path: Path) -> Content:
    motion = read_own_motion(path)
    states = (motion.t, motion.q, motion.v, motion.a)
    return [None if array is None else array.tobytes() for array in states]


_result = partial(_after, read_result, numbers)
_fit = partial(_after, read_fit, numbers)
_diagnosis = partial(_after, read_diagnosis, _without_seconds)
_data = partial(_after, _read_data, numbers)
config = partial(_after, load_spec, Path.read_bytes)


def _page(path: Path) -> Content:
    text = path.read_text(encoding="utf-8")
    assert text.rstrip().endswith("</html>"), "the page is cut off"
    return len(text)


def _picture(path: Path) -> Content:
    with Image.open(path) as image:
        image.load()
        return image.size, image.convert("RGB").tobytes()


def words(*texts: str) -> tuple[str, ...]:
    """Arguments from texts with spaces between them; a text with a slash in front is a path."""
    return tuple(
        word for text in texts for word in ([text] if text.startswith("/") else text.split())
    )


MOTIONS = Command(
    "optimize",
    ("optimize", SMOKE, "-o", "motions.h5", "--motions", str(N_MOTIONS), *QUICK),
    {"motions.h5": _result},
    resumable=True,
)
DATA = Command(
    "simulate",
    ("simulate", SMOKE, "../inputs/motions.h5", "-o", "data.h5", "--rate", "100"),
    {"data.h5": _data},
)
FIT = Command(
    "identify",
    words(
        "identify",
        SMOKE,
        "../inputs/data.h5 -o fit.h5 --urdf new.urdf --mjcf new.xml --parameters new.yaml",
    ),
    {
        "fit.h5": _fit,
        "new.urdf": Path.read_bytes,
        "new.xml": Path.read_bytes,
        "new.yaml": Path.read_bytes,
    },
)
DIAGNOSIS = Command(
    "diagnose",
    ("diagnose", SMOKE, "../inputs/data.h5", "-o", "diagnosis.h5", "--apply", "better.yaml"),
    {"diagnosis.h5": _diagnosis, "better.yaml": config},
)


def _export(kind: str) -> Command:
    name = f"motion{MOTION_FORMATS.members[kind]().suffix}"
    asked = words("export ../inputs/motions.h5 --motion 1 --rate 100", "--format", kind, "-o")
    return Command(f"export {kind}", (*asked, name), {name: _motion})


def _figures() -> dict[str, Callable[[Path], Content]]:
    names = ["condition_numbers", "spectrum"]
    names += [f"motion_{i}" for i in range(1, N_MOTIONS + 1)]
    return {f"{name}.png": _picture for name in names}


COMMANDS = (
    MOTIONS,
    DATA,
    FIT,
    DIAGNOSIS,
    Command(
        "compare-random",
        words(
            "compare-random",
            SMOKE,
            "--optimized ../inputs/motions.h5 --candidates 9 --seconds 0 -o random.h5",
            *QUICK,
        ),
        {"random.h5": _result},
    ),
    Command("init", ("init", "--urdf", ARM, "-o", "arm.yaml"), {"arm.yaml": config}),
    *(_export(kind) for kind in ("csv", "ros2", "rosbag2", "mcap", "moveit", "npz")),
    Command(
        "export urdf",
        ("export", "../inputs/fit.h5", "--format", "urdf", "-o", "fit.urdf"),
        {"fit.urdf": Path.read_bytes},
    ),
    Command(
        "report",
        ("report", "../inputs/motions.h5", "-o", "page.html", "--no-picture"),
        {"page.html": _page},
    ),
    Command(
        "report --figures",
        ("report", "../inputs/motions.h5", "--figures", "."),
        _figures(),
    ),
    Command(
        "view --png",
        ("view", "../inputs/motions.h5", "--png", "arm.png", "--size", "160x120"),
        {"arm.png": _picture},
    ),
    Command(
        "view --gif",
        words("view ../inputs/motions.h5 --gif arm.gif --size 160x120 --duration 0.5 --fps 4"),
        {"arm.gif": _picture},
    ),
    Command("schema", ("schema", "-o", "schema.json"), {"schema.json": Path.read_bytes}),
)
INPUTS = (MOTIONS, DATA, FIT)
