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

_BINARY, _TEXT = ".glb", ".gltf"
_MAGIC, _JSON = b"glTF", b"JSON"
_HEADER, _CHUNK = struct.Struct("<4sII"), struct.Struct("<I4s")
_PLACES = ("matrix", "translation", "rotation", "scale")


def load_whole(path: Path, folder: Path) -> Any:
    """The geometry of a mesh (coal's), where one of glTF stands as its scene says.

    folder: for a file that is gone afterwards.

    Raises
    ------
    RuntimeError, ValueError
        It cannot be read.
    """
    loader, one = coal.MeshLoader(coal.NODE_TYPE.BV_OBBRSS), np.ones(3)
    below = _below_a_root(path)
    if below is None:
        return loader.load(str(path), one)
    with tempfile.TemporaryDirectory(dir=folder) as inner:
        copy = Path(inner) / path.name
        copy.write_bytes(below)
        return loader.load(str(copy), one)


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
    except (
        LookupError,
        TypeError,
        ValueError,
        AttributeError,
        OSError,
        RecursionError,
        struct.error,
    ):
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
            if not (folder / uri).is_file():
                raise ValueError(f"{uri} is no file")
            data = base64.b64encode((folder / uri).read_bytes()).decode()
            buffer["uri"] = f"data:application/octet-stream;base64,{data}"
