"""Conversion to a URDF in a process of its own, with limits; kept on disk where that is safe.

What is kept is found again by the content of all files that the format says it read, by the
arguments and by the program's version, and carries a digest (`disk_cache`). Meshes that the
conversion wrote into the cache bear the hash of their content as a name and are compared to it.
"""

import contextlib
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from excite_cli import __version__
from excite_cli.disk_cache import store_arrays, stored_arrays
from excite_cli.errors import ExciteError, MissingExtraError, RobotError
from excite_cli.robot.allowed_files import FolderRequest, OutsideError, allowed_files
from excite_cli.robot.confinement import (
    OUT_OF_TIME,
    command,
    confine,
    environment,
    limit_memory,
    set_alarm,
)
from excite_cli.robot.formats.base import ConversionRequest, RobotFormat, Urdf
from excite_cli.robot.formats.kept_meshes import is_sound, kept_meshes_folder
from excite_cli.robot.mesh_trial import MAX_BYTES
from excite_cli.robot.ros_packages import (
    MissingPackageError,
    is_name,
    missing_package,
    search_package,
    unnamed_package,
)

_SECONDS, _BYTES_PER_SECOND = 8.0, 2**20  # processor time allowed: a base, and by size of files
_MOST_ABSENT = 10  # packages that are nowhere; each costs a process
_SLOWEST = 10  # times the processor time, on a machine with much else to do
_MAX_MEMORY = 4 * 2**30  # bytes
_MAX_TEXT = 20_000_000  # characters of the URDF, as of one that is given
_FORM = "3"  # of what is kept; another one after a change of what formats write
_OF_ERRORS = {each.__name__: each for each in (RobotError, MissingExtraError)}


def converted(form: RobotFormat, path: Path, text: str, asked: ConversionRequest) -> Urdf:
    """What `form.urdf` gives, or what it gave for the same content before.

    Raises
    ------
    RobotError, MissingExtraError
        As `RobotFormat.urdf`; or reading the file ends the process, takes too long or too much.
    """
    sources = form.sources(path, text, asked)
    key = None if sources is None else _key(form, path, sources, asked)
    kept = None if key is None else _kept(key)
    if kept is not None:
        return kept
    size = sum(min(source.stat().st_size, MAX_BYTES) for source in sources or (path,))
    found = None
    while found is None:
        try:
            found = _answered(form, path, text, asked, _SECONDS + size / _BYTES_PER_SECOND)
        except MissingPackageError as error:  # looked for here, where all may be seen
            asked = _without(error.name, path, asked)
    if key is not None:
        content = json.dumps(asdict(found)).encode()
        store_arrays(key, {"urdf": np.frombuffer(content, dtype=np.uint8)})
    return found


def _without(name: str, path: Path, asked: ConversionRequest) -> ConversionRequest:
    """The same, without a package that is nowhere; the one that the file lies in stands for it.

    Raises
    ------
    RobotError
        It is elsewhere, or the file lies in no package that may be read and lost its name.
    """
    allowed, own = allowed_files(path, asked.package_dirs), unnamed_package(path)
    stands = own is not None and allowed.has(own) and search_package(name, path) is None
    if not stands or not is_name(name) or name in asked.absent or len(asked.absent) >= _MOST_ABSENT:
        raise missing_package(name, allowed)
    return replace(asked, absent=(*asked.absent, name))


def _key(
    form: RobotFormat, path: Path, sources: Sequence[Path], asked: ConversionRequest
) -> str | None:
    digest = hashlib.sha256(f"{form.name}|{__version__}|{_FORM}|{path}|".encode())
    digest.update(json.dumps([asked.package_dirs, dict(asked.arguments)], default=str).encode())
    for source in sources:
        try:
            with source.open("rb") as file:
                content = hashlib.file_digest(file, "sha256").hexdigest()
        except OSError:
            return None
        digest.update(f"|{source}|{content}".encode())
    return digest.hexdigest()


def _kept(key: str) -> Urdf | None:
    arrays = stored_arrays(key)
    if arrays is None or "urdf" not in arrays:
        return None
    found = _urdf(json.loads(arrays["urdf"].tobytes()))
    return found if all(is_sound(Path(mesh)) for mesh in found.meshes) else None


def _urdf(content: dict[str, Any]) -> Urdf:
    lists = {name: tuple(content[name]) for name in ("folders", "notes", "meshes")}
    pairs = tuple((first, second) for first, second in content["ignored"])
    return Urdf(content["text"], **lists, ignored=pairs)


def _believed(found: Urdf, path: Path) -> Urdf:
    """Without folders that no conversion has a need of: what it says is read unconfined."""
    own = unnamed_package(path)
    known = {str(kept_meshes_folder()), *([] if own is None else [str(own)])}
    return replace(found, folders=tuple(each for each in found.folders if each in known))


def _answered(
    form: RobotFormat, path: Path, text: str, asked: ConversionRequest, seconds: float
) -> Urdf:
    """The answer of a process of its own, which may compute for so long [s]."""
    question = {
        "module": type(form).__module__,
        "format": type(form).__name__,
        "path": str(path),
        "text": text,
        "package_dirs": list(asked.package_dirs),
        "arguments": dict(asked.arguments),
        "absent": list(asked.absent),
        "seconds": seconds,
    }
    # Libraries leave their logs where they run: in a folder that goes with them.
    with tempfile.TemporaryDirectory(prefix="excite-") as folder:
        try:
            run = subprocess.run(
                command(__name__),
                input=json.dumps(question).encode(),
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,  # a file may have a library write without end
                env=environment(few=True),
                cwd=folder,
                timeout=_SLOWEST * seconds,
                process_group=0,  # Ctrl-C is for this process, which then ends the other
                check=False,
            )
            status, said = run.returncode, run.stdout
        except subprocess.TimeoutExpired:
            status, said = OUT_OF_TIME[-1], b""
    answer = json.loads(said) if status == 0 and said else {}
    if "text" in answer:
        return _believed(_urdf(answer), path)
    if "package" in answer:
        raise MissingPackageError(answer["package"])
    if "needed" in answer:
        name, folder, near = answer["needed"]
        allowed = allowed_files(path, asked.package_dirs)
        raise OutsideError(path.name, FolderRequest(name, Path(folder), near), allowed.own)
    if "error" in answer:
        raise _OF_ERRORS.get(answer["error"], RobotError)(answer["message"])
    how = "takes too long" if status in OUT_OF_TIME else "fails or takes too much memory"
    raise RobotError(
        f"{path.name}: reading it as {form.name} {how}. It is damaged, or too large: see whether "
        "the program that wrote it opens it."
    )


def confinement_notes(what: str, folders: Sequence[Path]) -> list[str]:
    """Confine this process to reading these folders; what the system cannot do, in words."""
    meshes = kept_meshes_folder()
    with contextlib.suppress(OSError):  # where it cannot be made, keeping a mesh says so
        meshes.mkdir(parents=True, exist_ok=True)
    lacking = confine(folders, (meshes, Path.cwd()))
    return [f"the process that read this {what} could not be confined: {each}" for each in lacking]


def serve() -> None:
    """In the process: the answer on stdout to the question on stdin."""
    question = json.load(sys.stdin.buffer)
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # whatever libraries print
    form = getattr(import_module(question["module"]), question["format"])()
    path = Path(question["path"])
    packages = tuple(question["package_dirs"])
    asked = ConversionRequest(packages, question["arguments"], tuple(question["absent"]))
    limit_memory(_MAX_MEMORY)
    set_alarm(question["seconds"])
    try:
        form.load_library()
        notes = confinement_notes(form.name, allowed_files(path, asked.package_dirs).folders)
        found = form.urdf(path, question["text"], asked)
        if len(found.text) > _MAX_TEXT:
            raise RobotError(
                f"{path.name}: what it expands to is larger than {_MAX_TEXT // 10**6} MB: no robot."
            )
        answer = asdict(replace(found, notes=(*found.notes, *notes)))
    except MissingPackageError as error:
        answer = {"package": error.name}
    except OutsideError as error:
        needed = error.needed
        answer = {"needed": [needed.name, str(needed.folder), needed.near]}
    except ExciteError as error:
        answer = {"error": type(error).__name__, "message": str(error)}
    out.write(json.dumps(answer))
    out.close()
