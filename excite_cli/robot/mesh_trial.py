"""Meshes read for a try in a process of their own, before this one reads them.

The library that reads meshes (assimp) can be led by a damaged file to end its process, to fill
memory or to run on; nothing in this process can hold it then. `faults` starts a process with
limits of time and memory, confined to the robot's folders, that reads the files as `coal` does,
once for each content. The process is this module's `serve`, asked by lines on stdin.
"""

import atexit
import contextlib
import hashlib
import json
import os
import subprocess
import sys
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from excite_cli.robot.apart import OUT_OF_TIME, command, environment, limit_memory, set_alarm
from excite_cli.robot.confinement import confine

SUFFIXES = (".stl", ".dae", ".obj", ".ply")
MAX_BYTES = 100 * 2**20  # of a mesh
MAX_TRIANGLES = 1_000_000
_MAX_MEMORY = 2**30  # bytes that the reading of one robot's meshes may take
_SECONDS, _BYTES_PER_SECOND = 1.0, 2**20  # processor time allowed: a base, and by size
_SLOWEST = 20  # times the processor time, on a machine with much else to do
_IDLE = 10.0  # s without a question after which the process ends


@dataclass(frozen=True)
class Fault:
    """What is wrong with a mesh; `harms`: reading it ends the process or takes forever."""

    words: str
    harms: bool = False


_known: dict[str, Fault | None] = {}  # by content


def faults(
    paths: Sequence[Path], folders: Sequence[Path], any_format: bool = False
) -> dict[Path, str]:
    """Files that cannot be read as meshes, or not without harm; why, without a full stop.

    folders: all that may be read, for what a mesh names in its turn; any_format: a file may be of
    any format, and hold anything, as long as reading it does no harm.
    """
    found: dict[Path, str] = {}
    for path in dict.fromkeys(paths):
        if refused := _refused(path, any_format):
            found[path] = f"the mesh {path} {refused}"
            continue
        content = _content(path)
        if content not in _known:
            _known[content] = _trial.fault(path, [str(folder) for folder in folders])
        fault = _known[content]
        if fault is not None and (fault.harms or not any_format):
            found[path] = (
                f"the mesh {path} cannot be loaded: {fault.words}. Repair it, or convert it to "
                "STL with another program"
            )
    return found


def _refused(path: Path, any_format: bool) -> str:
    """Why a file is not even tried; empty where it is."""
    if not any_format and path.suffix.lower() not in SUFFIXES:
        return f"is of no known format; read are {', '.join(SUFFIXES)}"
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

    def fault(self, path: Path, folders: list[str]) -> Fault | None:
        """What is wrong with a mesh, if anything is."""
        if folders != self._folders:
            self.close()
            self._folders = folders
        seconds = _SECONDS + path.stat().st_size / _BYTES_PER_SECOND
        line = json.dumps([str(path), seconds]).encode() + b"\n"
        while True:
            answer, status = self._asked(line, _SLOWEST * seconds)
            if answer:
                said = str(json.loads(answer))
                return Fault(said) if said else None
            if status != 0:  # else it was idle and has just ended
                how = "takes too long" if status in OUT_OF_TIME else "fails"
                return Fault(f"reading it {how}", harms=True)

    def _asked(self, line: bytes, longest: float) -> tuple[bytes, int]:
        """The answer, or how the process ended; it is ended if it takes longer [s]."""
        if self._process is None:
            self._process = subprocess.Popen(
                command(__name__),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=environment(),
                process_group=0,  # Ctrl-C is for the parent
            )
            line = json.dumps(self._folders).encode() + b"\n" + line
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


def _peak() -> int:
    try:
        import resource
    except ImportError:
        return 0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak


def serve() -> None:
    """In the process: for each line [path, seconds] of stdin a line, empty for a good mesh.

    Before them stands a line with the folders that may be read.
    """
    import coal

    limit_memory(2 * _MAX_MEMORY)
    confine([Path(folder) for folder in json.loads(sys.stdin.buffer.readline())])
    loader = coal.MeshLoader(coal.NODE_TYPE.BV_OBBRSS)
    idle = threading.Timer(_IDLE, os._exit, (0,))
    idle.daemon = True
    idle.start()
    for line in sys.stdin.buffer:
        idle.cancel()
        path, seconds = json.loads(line)
        set_alarm(seconds)
        said = _said(loader, path)
        set_alarm(0)
        print(json.dumps(said), flush=True)
        if _peak() > _MAX_MEMORY:
            return  # the next begins with a peak of its own
        idle = threading.Timer(_IDLE, os._exit, (0,))
        idle.daemon = True
        idle.start()


def _said(loader: object, path: str) -> str:
    import numpy as np

    try:
        mesh = loader.load(path, np.ones(3))  # type: ignore[attr-defined]
    except Exception as error:
        said = str(error).partition("message: ")[2] or str(error)  # coal begins with its own files
        return (said.strip().splitlines() or ["no reason given"])[0].rstrip(".")[:200]
    if not mesh.num_vertices or not mesh.num_tris:
        return "it has no triangles"
    if mesh.num_tris > MAX_TRIANGLES or _peak() > _MAX_MEMORY:
        return f"it is too large ({mesh.num_tris:,} triangles)"
    if not np.isfinite(np.asarray(mesh.vertices())).all():
        return "it has corners that are not finite"
    return ""
