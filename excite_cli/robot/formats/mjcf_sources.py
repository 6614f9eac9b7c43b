"""The files that an MJCF reads, all within the folders that it may read.

Includes, models that it attaches, meshes, textures, height fields: MuJoCo looks for them beside the
main file or in a folder that <compiler> names, takes `\\` for `/`, and resolves `..` by the names
alone. Here all that a name may mean are taken, so and as the file system has it, before MuJoCo sees
any of them.
"""

import os
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Iterator
from math import pi
from pathlib import Path
from typing import Any

from excite_cli.errors import RobotError
from excite_cli.robot.allowed_files import AllowedFiles
from excite_cli.robot.mesh_trial import MAX_BYTES
from excite_cli.robot.urdf_check import tree_of, xml_text

# Ranges of MJCF joints, also those that MuJoCo refuses or passes over: equal and reversed ones.
#
# With `limited="true"` MuJoCo does not compile them, with `auto` it takes the joint for unlimited.
# They are taken out before it compiles, and belong into the URDF as they are written.

_SLIDE, _HINGE = 2, 3  # mjtJoint
_UNLIMITED, _LIMITED = 0, 1  # mjtLimited
_DEGREE = pi / 180

Ranges = dict[int, tuple[float, float]]


def compiled(spec: Any) -> tuple[Any, Ranges]:
    """The model of a `mujoco.MjSpec`, and the ranges [rad or m] by the number of the joint.

    MuJoCo's own errors come through.
    """
    odd = []
    for joint in spec.joints:
        kind, says = int(joint.type), int(joint.limited)
        lower, upper = map(float, joint.range)
        given = says == _LIMITED or (says != _UNLIMITED and (lower, upper) != (0.0, 0.0))
        if kind not in (_SLIDE, _HINGE) or not given or lower < upper:
            continue
        joint.limited = _UNLIMITED
        unit = _DEGREE if kind == _HINGE and spec.compiler.degree else 1.0
        odd.append((joint, (lower * unit, upper * unit)))
    model = spec.compile()
    limited = {
        j: (float(model.jnt_range[j, 0]), float(model.jnt_range[j, 1]))
        for j in range(model.njnt)
        if model.jnt_limited[j]
    }
    return model, {**limited, **{int(joint.id): bounds for joint, bounds in odd}}


_FOLDERS = ("meshdir", "texturedir", "assetdir")
_MODELS = ("include", "model")
_MOST, _MOST_INCLUDED = 2000, 100  # names of files; files that are read here
_MAX_TOTAL = 2**30  # bytes of all files, whose content is what a kept conversion is found by


def mjcf_sources(path: Path, text: str, allowed: AllowedFiles) -> tuple[Path, ...] | None:
    """Every file that may be meant, in the order of their names.

    None where it attaches other models: their content does not tell what becomes of them.

    Raises
    ------
    OutsideError
        One of them lies outside the folders that may be read.
    RobotError
        An included file is no XML, a file is none that can be read, or they are too many or large.
    """
    own = path.resolve()
    roots = {own: tree_of(path, text)}
    while True:
        elements = [element for root in roots.values() for element in root.iter()]
        folders = {element.get(key, ".") for element in elements for key in _FOLDERS}
        places = {os.path.join(file.parent, _plain(each)) for file in roots for each in folders}
        included = [each for each in elements if _tag(each) in _MODELS]
        more = {*_there(places, _names(included), allowed)} - {*roots}
        if not more:
            break
        if len(roots) + len(more) > _MOST_INCLUDED:
            raise RobotError(f"{path.name}: it includes more than {_MOST_INCLUDED} files.")
        roots |= {each: tree_of(each, xml_text(each, "an MJCF")) for each in sorted(more)}
    names = _names(elements)
    if len(names) > _MOST:
        raise RobotError(f"{path.name}: it names more than {_MOST} files.")
    found = {*roots, *_there(places, names, allowed)}
    _check_sizes(path, found)
    attaches = any(_tag(element) in ("model", "attach") for element in elements)
    return None if attaches else tuple(sorted(found))


def _tag(element: ElementTree.Element) -> str:
    """The name of an element, in whatever namespace: MuJoCo knows none."""
    return str(element.tag).rpartition("}")[2]


def _names(elements: Iterable[ElementTree.Element]) -> set[str]:
    """The files that elements name: `file`, and `fileright` and its like of a sky."""
    return {
        value
        for element in elements
        for key, value in element.attrib.items()
        if key.startswith("file")
    }


def _there(places: set[str], names: set[str], allowed: AllowedFiles) -> Iterator[Path]:
    """The files that names mean in places, resolved.

    An absolute name stands alone, whatever it is joined to. MuJoCo also takes the last part of a
    name alone (strippath).
    """
    for place in sorted(places):
        for name in map(_plain, sorted(names)):
            for inside in dict.fromkeys((name, os.path.basename(name))):
                joined = os.path.join(place, inside)
                for meant in dict.fromkeys((joined, os.path.normpath(joined))):
                    if inside and _exists(meant):
                        real = allowed.require(Path(meant))
                        if real.is_dir():
                            continue
                        if not real.is_file():
                            raise RobotError(f"{allowed.source}: {real} is no regular file.")
                        yield real


def _plain(name: str) -> str:
    return name.replace("\\", "/")


def _exists(path: str) -> bool:
    """Whether there is something; names of robots' files may be too long, or have a NUL in them."""
    try:
        return os.path.exists(path)
    except ValueError:
        return False


def _check_sizes(path: Path, files: set[Path]) -> None:
    sizes = {file: file.stat().st_size for file in files}
    largest = max(sizes, key=lambda file: sizes[file])
    if sizes[largest] > MAX_BYTES or sum(sizes.values()) > _MAX_TOTAL:
        raise RobotError(
            f"{path.name}: its files are too large ({largest.name}: "
            f"{sizes[largest] / 2**20:.0f} MiB); {MAX_BYTES // 2**20} MiB each and "
            f"{_MAX_TOTAL // 2**20} MiB together are read."
        )
