"""From a YAML file and `--set` overrides to a checked `Spec`, and back to text.

Errors name the key's path, what is allowed and the nearest known key.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from excite_cli.config.explain import Path as Place
from excite_cli.config.explain import explain
from excite_cli.config.lines import line_at
from excite_cli.config.spec import Spec
from excite_cli.config.strict_yaml import load_strict
from excite_cli.config.values import plain_values
from excite_cli.errors import ConfigError, nearest
from excite_cli.given_files import require_stored

MAX_BYTES = 1_000_000
# What is given by mistake for a config, by its suffix.
_KINDS = {
    ".h5": "an HDF5 file (a result, a fit or measured data)",
    ".urdf": "a URDF",
    ".csv": "a table of data",
    ".db3": "a bag",
    ".mcap": "a bag",
    ".npz": "a NumPy file",
}


def load_spec(path: Path, overrides: list[str] | None = None) -> Spec:
    """Read a problem from `path`, with `key.path=value` overrides applied.

    Raises
    ------
    ConfigError
        The file is missing, too large, not YAML, or says something that is not allowed.
    FileError
        It is a named pipe, a socket or a device.
    """
    if path.is_dir():
        raise ConfigError(
            f"{path} is a folder, not a config. The config, a YAML file, comes first: "
            "excite COMMAND CONFIG FILE."
        )
    if path.exists():
        require_stored(path)
    if not path.is_file():
        raise ConfigError(f"There is no config file {path}.{_near(path)}")
    what = _KINDS.get(path.suffix.lower())
    if what is not None:
        raise ConfigError(
            f"{path} is {what}, not a config. The config, a YAML file, comes first: excite "
            "COMMAND CONFIG FILE."
        )
    if path.stat().st_size > MAX_BYTES:
        raise ConfigError(f"{path} is larger than {MAX_BYTES // 1000} kB: not a config.")
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(
            f"{path} cannot be read as text, so it is not a config ({error}). The config comes "
            "first: excite COMMAND CONFIG FILE."
        ) from error
    return parse_spec(text, str(path), overrides)


def _near(path: Path) -> str:
    """The config in the same folder whose name is nearest, and how to get one."""
    folder = path.parent
    there = [each.name for each in folder.glob("*.y*ml")] if folder.is_dir() else []
    return nearest(path.name, there) + " `excite init` writes one for a robot of yours."


def parse_spec(text: str, source: str = "config", overrides: list[str] | None = None) -> Spec:
    """As `load_spec`, from YAML text; `source` is named in messages."""
    tree = load_strict(text, source)
    if not isinstance(tree, dict):
        raise ConfigError(f"{source}: a problem is a mapping with at least the key 'robot'.")
    for override in overrides or []:
        apply_override(tree, override)
    changed = [override.partition("=")[0].strip() for override in overrides or []]

    def line_of(place: Place) -> int | None:
        written = ".".join(map(str, place))
        if any(f"{written}.".startswith(f"{key}.") for key in changed):
            return None  # it is not the file that says this
        return line_at(text, place)

    return parsed_spec(tree, source, line_of)


def spec_of(
    values: Mapping[str, Any], overrides: list[str] | None = None, source: str = "config"
) -> Spec:
    """As `load_spec`, from what a YAML file would hold; `source` is named in messages."""
    tree = plain_values(values, source)
    for override in overrides or []:
        apply_override(tree, override)
    return parsed_spec(tree, source)


def parsed_spec(
    tree: dict[str, Any],
    source: str = "config",
    line_of: Callable[[Place], int | None] = lambda place: None,
) -> Spec:
    """The checked problem of plain values; messages name `source` and the line.

    Raises
    ------
    ConfigError
        They say something that is not allowed.
    """
    try:
        return Spec.model_validate(tree)
    except ValidationError as error:
        raise ConfigError(explain(error, tree, source, line_of)) from error


def spec_as_yaml(spec: Spec) -> str:
    """The full resolved problem as YAML text; loading it gives the same `Spec`."""
    return yaml.safe_dump(spec.model_dump(mode="json"), sort_keys=False, allow_unicode=True)


def apply_override(tree: dict[str, Any], override: str) -> None:
    """Set one `key.path=value`; the value is YAML."""
    key, separator, text = override.partition("=")
    if not separator or not key.strip():
        raise ConfigError(
            f"--set {override}: write key.path=value, for example optimizer.max_seconds=20."
        )
    parts = [part.strip() for part in key.split(".")]
    if not all(parts):
        raise ConfigError(
            f"--set {override}: '{key}' has an empty part between its dots; write "
            "key.path=value, for example optimizer.max_seconds=20."
        )
    node: Any = tree
    for part in parts[:-1]:
        if node.get(part) is None:
            node[part] = {}
        node = node[part]
        if not isinstance(node, dict):
            raise ConfigError(f"--set {override}: '{part}' holds a value, not further keys.")
    node[parts[-1]] = load_strict(text, f"--set {key}")
