"""Small valid meshes of a tetrahedron in the formats that URDFs name, and ways to spoil them."""

import struct
from pathlib import Path

import numpy as np

from benchmarks.trust.fuzz_mutations import (
    Rng,
    chance,
    odd_number,
    pick,
    spoiled_bytes,
    spoiled_text,
)

_CORNERS = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
_FACES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
SUFFIXES = ("stl", "obj", "dae", "ply")


def binary_stl(claimed: int | None = None, corners: np.ndarray = _CORNERS) -> bytes:
    """STL; `claimed`: how many triangles its header says there are."""
    body = b"".join(
        struct.pack("<12fH", 0, 0, 0, *corners[list(face)].ravel(), 0) for face in _FACES
    )
    return b"\0" * 80 + struct.pack("<I", len(_FACES) if claimed is None else claimed) + body


def _text_stl() -> bytes:
    lines = ["solid t"]
    for face in _FACES:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex " + " ".join(map(str, _CORNERS[k])) for k in face]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid t"]).encode()


def _obj() -> bytes:
    lines = ["v " + " ".join(map(str, corner)) for corner in _CORNERS]
    lines += ["f " + " ".join(str(k + 1) for k in face) for face in _FACES]
    return "\n".join(lines).encode()


def _ply() -> bytes:
    head = ["ply", "format ascii 1.0", "element vertex 4", "property float x", "property float y"]
    head += ["property float z", "element face 4", "property list uchar int vertex_indices"]
    lines = [*head, "end_header", *(" ".join(map(str, corner)) for corner in _CORNERS)]
    return "\n".join([*lines, *("3 " + " ".join(map(str, f)) for f in _FACES)]).encode()


def _dae() -> bytes:
    numbers = " ".join(map(str, _CORNERS.ravel()))
    faces = " ".join(str(k) for face in _FACES for k in face)
    return f"""<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g" name="g"><mesh>
<source id="p"><float_array id="pa" count="12">{numbers}</float_array><technique_common>
<accessor source="#pa" count="4" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>{faces}</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><instance_geometry url="#g"/></node>
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>
""".encode()


VALID = {"stl": binary_stl(), "obj": _obj(), "dae": _dae(), "ply": _ply()}


def write_meshes(rng: Rng, folder: Path, spoil: bool) -> str:
    """`mesh.<suffix>` of every format, one of them spoiled if asked; which, and how."""
    wrong = pick(rng, SUFFIXES) if spoil else ""
    made = ""
    for suffix, data in VALID.items():
        if suffix == wrong:
            made, data = _spoiled(rng, suffix, data)
        (folder / f"mesh.{suffix}").write_bytes(data)
    return f"{made} {wrong}".strip()


def _spoiled(rng: Rng, suffix: str, data: bytes) -> tuple[str, bytes]:
    way = int(rng.integers(10))
    if way == 0:
        return "mesh of another kind", VALID[pick(rng, SUFFIXES)]
    if way == 1:
        return "blank mesh", pick(rng, (b"", b"\0" * 84, b" ", b"solid", b"<", b"ply\n"))
    if way == 2 and suffix == "stl":
        return "claims", binary_stl(int(pick(rng, (0, 5, 2**16, 2**31, 2**32 - 1))))
    if way == 3 and suffix == "stl":
        corners = _CORNERS * float(odd_number(rng)) if chance(rng, 0.7) else _CORNERS * 0
        with np.errstate(all="ignore"):
            return "odd corners", binary_stl(
                corners=np.clip(np.nan_to_num(corners, nan=np.nan), -3e38, 3e38)
            )
    if way == 4 and suffix == "stl":
        return "text STL", spoiled_text(rng, _text_stl())
    if way == 5 and suffix == "obj":
        names = ("/dev/zero", "/etc/passwd", "../../x", "mesh.obj", ".")
        return "library", b"mtllib " + pick(rng, names).encode() + b"\n" + data
    if way == 6 and suffix == "ply":
        return "claims", data.replace(b"vertex 4", b"vertex " + str(odd_number(rng)).encode())
    if way == 7 and suffix == "dae":
        return "claims", data.replace(b'count="4"', f'count="{odd_number(rng)}"'.encode())
    if way == 8 and suffix == "obj":
        return "odd faces", data + b"\nf " + f"{odd_number(rng)} -9 99999999/1/1".encode()
    if way < 8 and suffix != "stl":
        return "text of a mesh", spoiled_text(rng, data)
    return "bytes of a mesh", spoiled_bytes(rng, data)
