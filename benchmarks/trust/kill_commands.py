"""The commands that write, small enough to be killed hundreds of times, and what they write."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

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


def _result(path: Path) -> Content:
    from excite_cli.store.result_file import read_result

    read_result(path)
    return numbers(path)


def _fit(path: Path) -> Content:
    from excite_cli.store.fit_file import read_fit

    read_fit(path)
    return numbers(path)


def _diagnosis(path: Path) -> Content:
    from excite_cli.store.diagnosis_file import read_diagnosis

    read_diagnosis(path)
    return {name: bits for name, bits in numbers(path).items() if "seconds" not in name}


def _data(path: Path) -> Content:
    from excite_cli.config.data_spec import MeasurementSpec
    from excite_cli.measurement.catalogue import read_dataset

    names = tuple(h5py.File(path).attrs["joint_names"])
    read_dataset([path], MeasurementSpec(), names)
    return numbers(path)


def _motion(path: Path) -> Content:
    from excite_cli.measurement.motion_files import read_own_motion

    motion = read_own_motion(path)
    states = (motion.t, motion.q, motion.v, motion.a)
    return [None if array is None else array.tobytes() for array in states]


def config(path: Path) -> Content:
    from excite_cli.config.load import load_spec

    load_spec(path, [])
    return path.read_bytes()


def _page(path: Path) -> Content:
    text = path.read_text(encoding="utf-8")
    assert text.rstrip().endswith("</html>"), "the page is cut off"
    return len(text)


def _picture(path: Path) -> Content:
    from PIL import Image

    with Image.open(path) as image:
        image.load()
        return image.size, image.convert("RGB").tobytes()


def _text(path: Path) -> Content:
    return path.read_bytes()


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
    {"fit.h5": _fit, "new.urdf": _text, "new.xml": _text, "new.yaml": _text},
)
DIAGNOSIS = Command(
    "diagnose",
    ("diagnose", SMOKE, "../inputs/data.h5", "-o", "diagnosis.h5", "--apply", "better.yaml"),
    {"diagnosis.h5": _diagnosis, "better.yaml": config},
)


def _export(kind: str) -> Command:
    from excite_cli.export.motions import MOTION_EXPORTERS

    name = f"motion{MOTION_EXPORTERS[kind].suffix}"
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
        {"fit.urdf": _text},
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
    Command("schema", ("schema", "-o", "schema.json"), {"schema.json": _text}),
)
INPUTS = (MOTIONS, DATA, FIT)
