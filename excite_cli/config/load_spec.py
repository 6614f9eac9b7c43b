"""From a YAML file and `--set` overrides to a checked `Spec`, and back to text.

Errors name the key's path, what is allowed and the nearest known key.
"""

from collections.abc import Callable, Mapping
from pathlib import Path, PurePath
from typing import Any

import yaml
from pydantic import ValidationError

from excite_cli.config.explain import Path as Place
from excite_cli.config.explain import explain
from excite_cli.config.plain_yaml import composed, load_strict
from excite_cli.config.spec import Spec
from excite_cli.errors import ConfigError, nearest
from excite_cli.given_files import require_stored

# Plain values of a config that was put together in Python: what YAML could have said.

_DEEPEST = 50
_PLAIN = (str, int, float, bool, type(None))


def plain_values(given: Mapping[Any, Any], source: str) -> dict[str, Any]:
    """A copy in dicts, lists, texts and numbers; arrays become lists, paths texts.

    Raises
    ------
    ConfigError
        Something is none of these; the message names `source` and the key.
    """
    return {_key(key, source, ""): _plain(each, source, f"{key}") for key, each in given.items()}


def _plain(value: Any, source: str, place: str) -> Any:
    if place.count(".") >= _DEEPEST:
        raise ConfigError(f"{source}: {place[:100]}… is nested too deeply, or holds itself.")
    if isinstance(value, Mapping):
        return {
            _key(key, source, place): _plain(each, source, f"{place}.{key}")
            for key, each in value.items()
        }
    if hasattr(value, "tolist"):  # an array or a number of NumPy, which is not imported for that
        return _plain(value.tolist(), source, place)
    if isinstance(value, list | tuple):
        return [_plain(each, source, f"{place}.{k}") for k, each in enumerate(value)]
    if isinstance(value, PurePath):
        return str(value)
    if isinstance(value, _PLAIN):
        return value
    raise ConfigError(
        f"{source}: {place} is of type {type(value).__name__}. Allowed are what a YAML file holds: "
        "texts, numbers, true and false, None, lists and dicts of them."
    )


def _key(key: Any, source: str, place: str) -> str:
    if isinstance(key, str):
        return key
    where = f"{place}: " if place else ""
    raise ConfigError(f"{source}: {where}the key {key!r} is no text. Give names of settings.")


# On which line of a YAML text a key stands, for messages.


def line_at(text: str, path: tuple[Any, ...]) -> int | None:
    """The line, from 1, of the key or list item at `path`; None if the text does not have it.

    A path whose last key is missing (a required one) gives the line of its section.
    """
    try:
        node = composed(text)
    except (yaml.YAMLError, ValueError, RecursionError):
        return None
    line: int | None = None
    for depth, part in enumerate(path):
        found = _child(node, part)
        if found is None:
            return line if depth == len(path) - 1 else None
        line, node = found
    return line


def _child(node: Any, part: Any) -> tuple[int, Any] | None:
    """Line and node of what stands under `part`."""
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            if key.value == str(part):
                return key.start_mark.line + 1, value
    if isinstance(node, yaml.SequenceNode) and isinstance(part, int) and part < len(node.value):
        return node.value[part].start_mark.line + 1, node.value[part]
    return None


# The files that a config stands for: itself, and those that it names.


def files_of_config(spec: Spec, folder: Path, config: Path | None) -> tuple[Path, ...]:
    """The config (if it is a file), its URDF and other files that it names, there or not.

    Relative paths start from `folder`.
    """
    named = [spec.robot.urdf]
    if spec.uncertainty is not None and spec.uncertainty.fit is not None:
        named.append(spec.uncertainty.fit)
    named += [each for each in (spec.task.log, spec.task.plan) if each is not None]
    own = () if config is None else (config,)
    return (*own, *(folder / name for name in named))


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
