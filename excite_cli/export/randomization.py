"""What simulators randomise, as correlated numbers: one vector y per robot, with its covariance.

    y = [mass, com (3), inertia about it (6) of every link; armature, damping, friction … of joints]

under the names of the exported MJCF. The covariance is that of the model to first order,

    cov y = J B Bᵀ Jᵀ,    J = ∂y/∂x at the model,

and the samples are y of models that robots can have (`uncertain_model.py`). `mean` is y of the
model that the other exports hold.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from excite_cli.export.drive import Drive, law_errors
from excite_cli.export.exported import ten_as_body
from excite_cli.export.mjcf import joint_parts
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.identification.uncertain_model import UncertainModel
from excite_cli.robot.link_frame import own_link
from excite_cli.robot.model import Array, Robot
from excite_cli.robot.tree import tree_of

FORMAT, VERSION = "excite-randomization", 1
_OF_BODY = (
    ("mass", "kg"),
    *((f"com_{axis}", "m") for axis in "xyz"),
    *((f"inertia_{axes}", "kg·m²") for axes in ("xx", "yy", "zz", "xy", "xz", "yz")),
)
_OF_JOINT = {
    "armature": ("kg·m²", "kg"),
    "damping": ("N·m·s/rad", "N·s/m"),
    "damping_2": ("N·m·s²/rad²", "N·s²/m²"),
    "damping_3": ("N·m·s³/rad³", "N·s³/m³"),
    "frictionloss": ("N·m", "N"),
    "stiffness": ("N·m/rad", "N/m"),
    "springref": ("rad", "m"),
    "kp": ("N·m/rad", "N/m"),
    "kd": ("N·m·s/rad", "N·s/m"),
    "torque_offset": ("N·m", "N"),
}
Simplify = Callable[[IdentifiedModel], IdentifiedModel]


@dataclass(frozen=True)
class Quantities:
    """Names `<body or joint of the MJCF>/<what>`, units, and y of any model."""

    robot: Robot
    names: tuple[str, ...]
    units: tuple[str, ...]
    simplify: Simplify
    drive: Drive | None

    def of(self, model: IdentifiedModel) -> Array:
        """y of `model`."""
        values = _values(self.robot, self.simplify(model), self.drive)
        return np.array([values.get(name, 0.0) for name in self.names])


def quantities(
    robot: Robot, model: IdentifiedModel, simplify: Simplify, drive: Drive | None
) -> Quantities:
    """Those that `model` has; `simplify` makes friction of forms that MuJoCo holds."""
    names = tuple(_values(robot, simplify(model), drive))
    slides = dict(zip(robot.joint_names, robot.sliding, strict=True))
    units = tuple(_unit(name, slides) for name in names)
    return Quantities(robot, names, units, simplify, drive)


def _unit(name: str, slides: dict[str, bool]) -> str:
    place, _, what = name.rpartition("/")
    if what in _OF_JOINT:
        return _OF_JOINT[what][int(slides[place])]
    return dict(_OF_BODY)[what]


def _values(robot: Robot, model: IdentifiedModel, drive: Drive | None) -> dict[str, float]:
    tree = tree_of(robot)
    phi = model.phi + model.carried(robot)
    found: dict[str, float] = {}
    for k, joint in enumerate(tree.joints):
        first = 10 * (tree.first_body + k)
        mass, center, about = ten_as_body(phi[first : first + 10])
        six = [about[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        numbers = [mass, *center, *six]
        for (what, _), number in zip(_OF_BODY, numbers, strict=True):
            found[f"body_of_{joint.name}/{what}"] = float(number)
    parts, _ = joint_parts(robot, model)
    for name, own in zip(robot.joint_names, parts.joints, strict=True):
        for what in _OF_JOINT:
            if what in own:
                found[f"{name}/{what}"] = float(own[what])
    gain, offset = law_errors(model, robot.n)
    for j, name in enumerate(robot.joint_names):
        if drive is not None:
            found[f"{name}/kp"] = float(drive.kp[j] / (1.0 + gain[j]))
            found[f"{name}/kd"] = float(drive.kd[j] / (1.0 + gain[j]))
        if offset[j] and drive is not None:
            found[f"{name}/torque_offset"] = float(-offset[j] / (1.0 + gain[j]))
    return found


def covariance_of(y: Quantities, uncertain: UncertainModel) -> Array:
    """cov y, as in the module's text; central differences over a hundredth of each deviation."""
    mean = uncertain.numbers
    std = np.sqrt(np.square(uncertain.root).sum(axis=1))
    slope = np.zeros((len(y.names), len(mean)))
    for i in np.flatnonzero(std > 0.0):
        step = np.zeros(len(mean))
        step[i] = min(0.01 * std[i], 0.01 * abs(mean[i])) or 0.01 * std[i]
        ends = [y.of(uncertain.at(mean + side * step)) for side in (1.0, -1.0)]
        slope[:, i] = (ends[0] - ends[1]) / (2.0 * step[i])
    half = slope @ uncertain.root
    return np.asarray(half @ half.T)


def randomization(
    y: Quantities,
    uncertain: UncertainModel,
    count: int,
    seed: int,
    delay: float | None,
    torque_left: Array,
) -> str:
    """JSON text: names, units, mean, covariance, and `count` samples; `delay` of commands [s].

    `torque_left` (n,): RMS of the held-out torque that the mean leaves, NaN where not known.
    """
    drawn = [y.of(uncertain.at(x)) for x in uncertain.drawn(count, seed)]
    covariance = covariance_of(y, uncertain)
    links = {
        f"body_of_{name}": own_link(y.robot.tree, k).name
        for k, name in enumerate(y.robot.tree.joint_names)
    }
    tree = {
        "format": FORMAT,
        "version": VERSION,
        "robot": y.robot.name,
        "links": links,
        "delay": delay,
        "seed": seed,
        "torque_left": {
            name: float(f"{rms:.4g}") if np.isfinite(rms) else None
            for name, rms in zip(y.robot.joint_names, torque_left, strict=True)
        },
        "names": list(y.names),
        "units": list(y.units),
        "mean": _rounded(y.of(uncertain.model)),
        "std": _rounded(np.sqrt(np.diag(covariance))),
        "covariance": [_rounded(row) for row in covariance],
        "samples": [_rounded(sample) for sample in drawn],
    }
    lines = [f" {json.dumps(k, ensure_ascii=False)}: {_dumped(v)}" for k, v in tree.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _dumped(value: object) -> str:
    """JSON; a row of a matrix takes a line."""
    if isinstance(value, list) and value and isinstance(value[0], list):
        return "[\n  " + ",\n  ".join(json.dumps(row) for row in value) + "\n ]"
    return json.dumps(value, ensure_ascii=False)


def _rounded(values: Array) -> list[float]:
    return [float(f"{float(x) + 0.0:.10g}") for x in values]
