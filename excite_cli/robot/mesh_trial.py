"""Meshes are read in a process of their own; this one reads copies that it made.

The library that reads meshes (assimp) can be led by a damaged file to end its process, to fill
memory, to run on, or to read other files; nothing in this process can hold it then. `faults` starts
a process with limits of time and memory, confined to the robot's folders, that reads the files as
`coal` does and leaves their triangles as plain STL in the cache (`copy_of`), which is all that this
process reads of them. The process is this module's `serve`, asked by lines on stdin.
"""

import atexit
import base64
import contextlib
import hashlib
import json
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import coal
import numpy as np

from excite_cli.errors import RobotError
from excite_cli.robot.confinement import (
    OUT_OF_TIME,
    command,
    confine,
    environment,
    limit_memory,
    set_alarm,
)
from excite_cli.robot.formats.kept_meshes import is_sound, keep_mesh, kept_meshes_folder

SUFFIXES = (".stl", ".dae", ".obj", ".ply")
VISUAL_SUFFIXES = (*SUFFIXES, ".glb", ".gltf", ".3ds", ".fbx")
MAX_BYTES = 100 * 2**20  # of a mesh
MAX_TRIANGLES = 1_000_000
_MAX_MEMORY = 2**30  # bytes that the reading of one robot's meshes may take
_SECONDS, _BYTES_PER_SECOND = 1.0, 2**20  # processor time allowed: a base, and by size
_SLOWEST = 20  # times the processor time, on a machine with much else to do
_IDLE = 10.0  # s without a question after which the process ends


@dataclass(frozen=True)
class Reading:
    """What came of a mesh: a copy of its triangles as STL, or what is wrong with it."""

    copy: Path | None
    fault: str = ""


# By place, which says what else it may name, and content.
_known: dict[tuple[Path, str], Reading] = {}


def faults(
    paths: Sequence[Path], folders: Sequence[Path], any_format: bool = False
) -> dict[Path, str]:
    """Files that cannot be read as meshes, or not without harm; why, without a full stop.

    folders: all that may be read, for what a mesh names in its turn; any_format: more formats than
    those of collision meshes, and any number of triangles.
    """
    found: dict[Path, str] = {}
    for path in dict.fromkeys(paths):
        if refused := _refused(path, any_format):
            found[path] = f"the mesh {path} {refused}"
            continue
        key = path, _content(path)
        if key not in _known:
            _known[key] = _trial.reading(path, [str(folder) for folder in folders], any_format)
        if _known[key].fault:
            found[path] = (
                f"the mesh {path} cannot be loaded: {_known[key].fault}. Repair it, or convert it "
                "to STL with another program"
            )
    return found


@cache
def _copies() -> Path:
    """Where copies are kept: the cache, or where that cannot be, a folder that goes at the end."""
    folder = kept_meshes_folder()
    with contextlib.suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
    if os.access(folder, os.W_OK):
        return folder
    passing = Path(tempfile.mkdtemp(prefix="excite-"))
    atexit.register(shutil.rmtree, passing, ignore_errors=True)
    return passing


def copy_of(path: Path) -> Path:
    """The copy of a mesh in which `faults` found nothing wrong.

    Raises
    ------
    RobotError
        It has changed since.
    """
    reading = _known.get((path, _content(path)))
    if reading is None or reading.copy is None or not is_sound(reading.copy):
        raise RobotError(f"the mesh {path} was changed while it was read. Try again.")
    return reading.copy


def _refused(path: Path, any_format: bool) -> str:
    """Why a file is not even tried; empty where it is."""
    known = VISUAL_SUFFIXES if any_format else SUFFIXES
    if path.suffix.lower() not in known:
        return f"is of no known format; read are {', '.join(known)}"
    size = path.stat().st_size
    if size <= MAX_BYTES:
        return ""
    return (
        f"has {size / 2**20:.0f} MiB; up to {MAX_BYTES / 2**20:.0f} MiB are read. Take a coarser "
        "one for collisions"
    )


def _content(path: Path) -> str:
    """Format and hash of a file's bytes."""
    with path.open("rb") as file:
        return path.suffix.lower() + hashlib.file_digest(file, "blake2b").hexdigest()


class _Trial:
    """The process that reads meshes; it ends by itself when nothing is asked for a while."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._folders: list[str] = []  # that the process was left

    def reading(self, path: Path, folders: list[str], large: bool = False) -> Reading:
        """What comes of a mesh; `large`: it may have any number of triangles."""
        if folders != self._folders:
            self.close()
            self._folders = folders
        seconds = _SECONDS + path.stat().st_size / _BYTES_PER_SECOND
        line = json.dumps([str(path), seconds, large]).encode() + b"\n"
        while True:
            answer, status = self._asked(line, _SLOWEST * seconds)
            if answer:
                fault, name = map(str, json.loads(answer))
                return Reading(None, fault) if fault else _believed(name)
            if status != 0:  # else it was idle and has just ended
                how = "takes too long" if status in OUT_OF_TIME else "fails"
                return Reading(None, f"reading it {how}")

    def _asked(self, line: bytes, longest: float) -> tuple[bytes, int]:
        """The answer, or how the process ended; it is ended if it takes longer [s]."""
        if self._process is None:
            self._process = subprocess.Popen(
                command(__name__),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=environment(few=True),
                process_group=0,  # Ctrl-C is for the parent
            )
            start = [str(_copies()), *self._folders]
            line = json.dumps(start).encode() + b"\n" + line
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        clock = threading.Timer(longest, process.kill)
        clock.start()
        try:
            process.stdin.write(line)
            process.stdin.flush()
            answer = process.stdout.readline()
        except BrokenPipeError:
            answer = b""
        except BaseException:  # the answer would be taken for that to the next question
            process.kill()
            self.close()
            raise
        finally:
            clock.cancel()
        if answer:
            return answer, 0
        return b"", self.close()

    def close(self) -> int:
        """End the process; how it ended."""
        process, self._process = self._process, None
        if process is None:
            return 0
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                with contextlib.suppress(OSError):
                    pipe.close()
        return process.wait()


_trial = _Trial()
atexit.register(_trial.close)


def _peak_memory() -> Callable[[], int]:
    """What says the most memory that this process has had [bytes]; to be made before `confine`.

    The kernel's `ru_maxrss` begins at that of the process that started this one: a script with a
    large array could read no mesh.
    """
    try:
        import resource
    except ImportError:
        return lambda: 0
    try:
        status = Path("/proc/self/status").open("rb", buffering=0)  # noqa: SIM115
    except OSError:  # no Linux
        unit = 1 if sys.platform == "darwin" else 1024
        return lambda: unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    def peak() -> int:
        status.seek(0)
        line = next(each for each in status.read(1 << 16).splitlines() if each[:6] == b"VmHWM:")
        return 1024 * int(line.split()[1])

    return peak


def serve() -> None:
    """In the process: for each line [path, seconds, large] of stdin a line [fault, copy].

    Before them stands a line with the folder for copies, and those that may be read.
    """

    limit_memory(2 * _MAX_MEMORY)
    peak = _peak_memory()
    copies, *folders = map(Path, json.loads(sys.stdin.buffer.readline()))
    confine(folders, [copies])
    idle = threading.Timer(_IDLE, os._exit, (0,))
    idle.daemon = True
    idle.start()
    for line in sys.stdin.buffer:
        idle.cancel()
        path, seconds, large = json.loads(line)
        set_alarm(seconds)
        answer = _read(load_whole, Path(path), copies, large, peak)
        set_alarm(0)
        print(json.dumps(answer), flush=True)
        if peak() > _MAX_MEMORY:
            return  # the next begins with a peak of its own
        idle = threading.Timer(_IDLE, os._exit, (0,))
        idle.daemon = True
        idle.start()


def _read(
    load: Callable[[Path, Path], Any],
    path: Path,
    copies: Path,
    large: bool,
    peak: Callable[[], int],
) -> tuple[str, str]:
    """What is wrong with a mesh, or nothing and its copy."""
    import numpy as np

    try:
        mesh = load(path, copies)
    except Exception as error:
        said = str(error).partition("message: ")[2] or str(error)  # coal begins with its own files
        return (said.strip().splitlines() or ["no reason given"])[0].rstrip(".")[:200], ""
    if not mesh.num_vertices or not mesh.num_tris:
        return "it has no triangles", ""
    if (mesh.num_tris > MAX_TRIANGLES and not large) or peak() > _MAX_MEMORY:
        return f"it is too large ({mesh.num_tris:,} triangles)", ""
    points = np.asarray(mesh.vertices(), dtype=float).reshape(-1, 3)
    if not np.isfinite(points).all():
        return "it has corners that are not finite", ""
    triangles = (mesh.tri_indices(k) for k in range(mesh.num_tris))
    faces = np.array([(t[0], t[1], t[2]) for t in triangles], dtype=np.intp)
    try:
        return "", str(keep_mesh(points, faces, copies))
    except RobotError as error:
        return str(error).rstrip("."), ""


def _believed(name: str) -> Reading:
    """A copy, which lies where copies are kept: the process may have been led astray."""
    copy = Path(name)
    if copy.parent != _copies() or not is_sound(copy):
        return Reading(None, "reading it fails")
    return Reading(copy)


# glTF files whose scene has one root, read with that root's place.
#
# coal reads meshes by assimp and leaves out the transformation of assimp's own root. Of COLLADA
# that is the file's up axis and unit, which ROS leaves out too: URDFs are written for coordinates
# as they stand in the file, whatever it calls up. Of a glTF file with one root in its scene,
# assimp takes that for its own, and what hangs on it stands turned (by 90°, as most programs
# export). Such files are read a second time, with a root above.

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
