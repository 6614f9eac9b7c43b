"""A model as a ROS 2 package: a plug-in of `inverse_dynamics_solver`, for ros2_control.

Its interface (versions 1.0 to 6.0, Humble to Rolling) asks for the inertia matrix, for Coriolis,
gravity and friction vectors, and for torques: `ros2/solver.cpp`, which calls the C file.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from xml.sax.saxutils import escape

from excite_cli.errors import ConfigError
from excite_cli.export.c_text import filled
from excite_cli.export.exported import ModelText, in_words
from excite_cli.identification.identified_model import IdentifiedModel
from excite_cli.robot.model import Robot

_FILES = ("CMakeLists.txt", "package.xml", "plugin.xml", "solver.cpp")


@dataclass(frozen=True)
class ModelFolder:
    """Texts of a folder's `files` by name; `notes`, sentences for the person who uses it."""

    files: Mapping[str, str]
    notes: tuple[str, ...] = ()

    def fill(self, path: Path) -> None:
        """Make the folder `path`."""
        path.mkdir()
        for name, text in self.files.items():
            (path / name).write_text(text, encoding="utf-8")


def is_package(path: Path) -> bool:
    """Whether `path` is such a package, and nothing else is in its folder."""
    return path.is_dir() and {each.name for each in path.iterdir()} == {*_FILES, "model.c"}


def package_name(folder: str) -> str:
    """`folder` as the name of a ROS package: lower-case letters, digits, underscores."""
    name = re.sub(r"[^a-z0-9]+", "_", folder.lower()).strip("_")
    return name if name[:1].isalpha() and name else f"robot_{name}".rstrip("_")


def ros2_package(robot: Robot, model: IdentifiedModel, c_file: ModelText, name: str) -> ModelFolder:
    """The package `name` of `model`, whose C file is known.

    Raises
    ------
    ConfigError
        An effect follows a column of the log.
    """
    standing, names = model.without(model.of_single_runs), robot.joint_names
    followed = [effect for effect in standing.effects if effect.follows_covariate]
    if followed:
        raise ConfigError(
            f"--format ros2-package: {in_words(followed, names)} follows the column "
            f"'{followed[0].covariate}' of the log, which inverse_dynamics_solver does not give. "
            "Take --format c."
        )
    gaps = {"NAME": name, "N": str(robot.n)}
    for key, text in (("JOINTS", ", ".join(names)), ("ROBOT", robot.name)):
        gaps[key] = re.sub(r'[^ -~]|["\\]', "_", text)  # stands in a string of C++
    in_xml = {key: escape(value) for key, value in gaps.items()}
    texts = {"model.c": c_file.text}
    for each in _FILES:
        text = (files("excite_cli.export") / "ros2" / each).read_text(encoding="utf-8")
        texts[each] = filled(text, in_xml if each.endswith(".xml") else gaps)
    notes = [*c_file.notes, f"build it with colcon build; the plug-in is {name}/Solver"]
    beside = [e for e in standing.effects if e.is_friction and {*e.function_of} - {"speed"}]
    if beside:
        notes.append(
            f"getFrictionVector has neither position nor load; in getCoriolisVector is what these "
            f"change: {in_words(beside, names)}"
        )
    if over_time := [effect for effect in standing.effects if effect.over_time]:
        notes.append(f"as at the first instant of a series: {in_words(over_time, names)}")
    return ModelFolder(texts, tuple(notes))
