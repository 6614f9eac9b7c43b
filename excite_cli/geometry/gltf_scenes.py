"""glTF files whose scene has one root, read with that root's place.

coal reads meshes by assimp and leaves out the transformation of assimp's own root. Of COLLADA that
is the file's up axis and unit, which ROS leaves out too: URDFs are written for coordinates as they
stand in the file, whatever it calls up. Of a glTF file with one root in its scene, assimp takes
that for its own, and what hangs on it stands turned (by 90°, as most programs export). Such files
are read a second time, with a root above.
"""

import base64
import json
import struct
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from excite_cli.errors import RobotError

_BINARY, _TEXT = ".glb", ".gltf"
_MAGIC, _JSON = b"glTF", b"JSON"
_HEADER, _CHUNK = struct.Struct("<4sII"), struct.Struct("<I4s")
_PLACES = ("matrix", "translation", "rotation", "scale")


def whole_scenes(geometry: pin.GeometryModel) -> pin.GeometryModel:
    """The same geometry, where meshes of glTF stand as their scene says.

    Raises
    ------
    RobotError
        Such a mesh cannot be read a second time.
    """
    read: dict[tuple[str, bytes], pin.CollisionGeometry] = {}
    for item in geometry.geometryObjects:
        scale = np.asarray(item.meshScale, dtype=float).ravel()
        key = str(item.meshPath), scale.tobytes()
        if key not in read:
            below = _below_a_root(Path(item.meshPath))
            read[key] = item.geometry if below is None else _read(Path(item.meshPath), below, scale)
        item.geometry = read[key]
    return geometry


def _read(path: Path, content: bytes, scale: np.ndarray) -> pin.CollisionGeometry:
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / path.name
        copy.write_bytes(content)
        try:
            return coal.MeshLoader().load(str(copy), scale)
        except (RuntimeError, ValueError) as error:
            raise RobotError(f"the mesh {path} cannot be loaded: {error}.") from error


def _below_a_root(path: Path) -> bytes | None:
    """The file with a root above its only one; None where nothing would be lost without."""
    if path.suffix.lower() not in (_BINARY, _TEXT):
        return None
    content = path.read_bytes()
    try:
        chunks = list(_chunks(content))
        text = chunks[0][1] if chunks else content
        tree = json.loads(text)
        scene = tree["scenes"][tree.get("scene", 0)]
        (root,) = scene["nodes"]
        node = tree["nodes"][root]
        if not node.get("children") or not any(place in node for place in _PLACES):
            return None
        scene["nodes"] = [len(tree["nodes"])]
        tree["nodes"].append({"children": [root]})
        _embed(tree, path.parent)
    except (KeyError, IndexError, TypeError, ValueError, OSError, struct.error):
        return None  # several roots, or no glTF that could be read so
    return _joined(json.dumps(tree).encode(), chunks)


def _chunks(content: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Kind and bytes of every chunk of a binary file; none of one that is text."""
    if content[:4] != _MAGIC:
        return
    at = _HEADER.size
    while at < len(content):
        length, kind = _CHUNK.unpack_from(content, at)
        at += _CHUNK.size
        yield kind, content[at : at + length]
        at += length


def _joined(text: bytes, chunks: list[tuple[bytes, bytes]]) -> bytes:
    if not chunks:
        return text
    text += b" " * (-len(text) % 4)
    parts = [(_JSON, text), *chunks[1:]]
    body = b"".join(_CHUNK.pack(len(each), kind) + each for kind, each in parts)
    return _HEADER.pack(_MAGIC, 2, _HEADER.size + len(body)) + body


def _embed(tree: dict[str, Any], folder: Path) -> None:
    """Data in files beside this one becomes a part of it, since it is read from elsewhere."""
    for buffer in tree.get("buffers", ()):
        uri = buffer.get("uri", "data:")
        if not uri.startswith("data:"):
            data = base64.b64encode((folder / uri).read_bytes()).decode()
            buffer["uri"] = f"data:application/octet-stream;base64,{data}"
