"""A tetrahedron with edges 1, 2 and 3 along x, y and z [m], as COLLADA and as glTF."""

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]], dtype="<f4")
FACES = np.array([0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3], dtype="<u2")
QUARTER_ABOUT_X = [float(np.sqrt(0.5)), 0.0, 0.0, float(np.sqrt(0.5))]

_COLLADA = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset>{up}</asset>
<library_geometries><geometry id="g"><mesh><source id="p">
<float_array id="a" count="12">{corners}</float_array><technique_common>
<accessor source="#a" count="4" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>{faces}</p></triangles>
</mesh></geometry></library_geometries><library_visual_scenes><visual_scene id="s">{nodes}
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>
"""
MESH = '<instance_geometry url="#g"/>'


def write_collada(path: Path, up: str, nodes: str) -> None:
    """`nodes`: XML of the scene; `up`: X_UP, Y_UP, Z_UP or nothing."""
    axis = f"<up_axis>{up}</up_axis>" if up else ""
    numbers = " ".join(map(str, CORNERS.ravel())), " ".join(map(str, FACES))
    text = _COLLADA.format(up=axis, corners=numbers[0], faces=numbers[1], nodes=nodes)
    path.write_text(text, encoding="utf-8")


def write_gltf(
    path: Path, nodes: list[dict[str, Any]], roots: list[int], beside: bool = False
) -> None:
    """`nodes` of the scene, whose mesh is 0; `beside`: the numbers are in a file of their own."""
    data = CORNERS.tobytes() + FACES.tobytes()
    tree: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": roots}],
        "nodes": nodes,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
             "min": [0, 0, 0], "max": [1, 2, 3]},
            {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 24},
        ],
        "buffers": [{"byteLength": len(data)}],
    }  # fmt: skip
    if path.suffix == ".glb":
        text = json.dumps(tree).encode()
        text += b" " * (-len(text) % 4)
        chunks = b"".join(
            struct.pack("<I4s", len(each), kind) + each
            for kind, each in ((b"JSON", text), (b"BIN\0", data))
        )
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
        return
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    if beside:
        uri = f"{path.stem}.bin"
        path.with_suffix(".bin").write_bytes(data)
    tree["buffers"][0]["uri"] = uri
    path.write_text(json.dumps(tree), encoding="utf-8")
