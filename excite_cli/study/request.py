"""What a case asks for, as one digest: the settings, and the contents of the files they name."""

import hashlib
from collections.abc import Callable, Sequence
from pathlib import Path

from excite_cli.config.load import load_spec, spec_as_yaml
from excite_cli.config.spec import Spec
from excite_cli.errors import RobotError

_MISSING = "missing"


def contents_of(path: Path) -> str:
    """SHA-256 of a file, or of the names and contents of all files of a folder."""
    if not path.exists():
        return _MISSING
    if path.is_file():
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    inside = sorted(each for each in path.rglob("*") if each.is_file())
    parts = [f"{each.relative_to(path)} {contents_of(each)}" for each in inside]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def request_of(
    config: Path,
    overrides: Sequence[str],
    log: Path | None,
    diagnosed: bool,
    contents: Callable[[Path], str] = contents_of,
) -> str:
    """Digest of the resolved config, its folder, the URDF, the fit of `uncertainty`, and the log.

    Files are taken by their contents: those of a worker may be copies. A missing one is for the
    case itself to tell.

    Raises
    ------
    ConfigError
        The config is missing or says what is not allowed.
    """
    spec, folder = load_spec(config, list(overrides)), config.absolute().parent
    asked = [spec_as_yaml(spec), str(folder), _robot(spec, folder)]
    if spec.uncertainty is not None and spec.uncertainty.fit is not None:
        asked.append(contents(folder / spec.uncertainty.fit))
    if log is not None:
        asked += [str(log), contents(log), str(diagnosed)]
    return hashlib.sha256("\n".join(asked).encode()).hexdigest()


def _robot(spec: Spec, folder: Path) -> str:
    from excite_cli.robot.description import load_description

    try:
        return load_description(
            spec.robot.urdf, spec.robot.package_dirs, folder, spec.robot.xacro_args
        ).sha256
    except RobotError:
        return _MISSING
