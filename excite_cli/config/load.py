"""From a YAML file and `--set` overrides to a checked `Spec`, and back to text.

YAML is read with the safe loader, within limits of size and depth and without aliases, so that a
foreign file can neither run code nor grow in memory. Errors name the key's path, what is allowed
and the nearest known key.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from excite_cli.config.explain import Path as Place
from excite_cli.config.explain import explain
from excite_cli.config.lines import line_at
from excite_cli.config.spec import Spec
from excite_cli.errors import ConfigError, nearest

MAX_BYTES = 1_000_000
MAX_DEPTH = 30
# What is given by mistake for a config, by its suffix.
_KINDS = {
    ".h5": "an HDF5 file (a result, a fit or measured data)",
    ".urdf": "a URDF",
    ".csv": "a table of data",
    ".db3": "a bag",
    ".mcap": "a bag",
    ".npz": "a NumPy file",
}


class _StrictLoader(yaml.SafeLoader):
    """Safe loader that refuses aliases and duplicate keys."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Refuse aliases: they make small files huge."""
        if self.check_event(yaml.AliasEvent):
            event = self.peek_event()
            raise yaml.MarkedYAMLError(None, None, "aliases (*) are not allowed", event.start_mark)
        return super().compose_node(parent, index)

    def construct_mapping(self, node: Any, deep: bool = False) -> Any:
        """Refuse a key given twice."""
        seen = set()
        for key_node, _ in node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                mark = key_node.start_mark
                raise yaml.MarkedYAMLError(None, None, "a key must be a plain word", mark)
            key = key_node.value
            if key in seen:
                mark = key_node.start_mark
                raise yaml.MarkedYAMLError(None, None, f"key '{key}' is given twice", mark)
            seen.add(key)
        return super().construct_mapping(node, deep)


def load_spec(path: Path, overrides: list[str] | None = None) -> Spec:
    """Read a problem from `path`, with `key.path=value` overrides applied.

    Raises
    ------
    ConfigError
        The file is missing, too large, not YAML, or says something that is not allowed.
    """
    if path.is_dir():
        raise ConfigError(
            f"{path} is a folder, not a config. The config, a YAML file, comes first: "
            "excite COMMAND CONFIG FILE."
        )
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
            f"{path} cannot be read as text, so it is no config ({error}). The config comes first: "
            "excite COMMAND CONFIG FILE."
        ) from error
    return parse_spec(text, str(path), overrides)


def _near(path: Path) -> str:
    """The config in the same folder whose name is nearest, and how to get one."""
    folder = path.parent
    there = [each.name for each in folder.glob("*.y*ml")] if folder.is_dir() else []
    return nearest(path.name, there) + " `excite init` writes one for a robot of yours."


def parse_spec(text: str, source: str = "config", overrides: list[str] | None = None) -> Spec:
    """As `load_spec`, from YAML text; `source` is named in messages."""
    tree = _load(text, source)
    if not isinstance(tree, dict):
        raise ConfigError(f"{source}: a problem is a mapping with at least the key 'robot'.")
    for override in overrides or []:
        _apply(tree, override)
    changed = [override.partition("=")[0].strip() for override in overrides or []]

    def line_of(place: Place) -> int | None:
        written = ".".join(map(str, place))
        if any(f"{written}.".startswith(f"{key}.") for key in changed):
            return None  # it is not the file that says this
        return line_at(text, place)

    return parsed_spec(tree, source, line_of)


def parsed_spec(
    tree: dict[str, Any],
    source: str = "config",
    line_of: Callable[[Place], int | None] = lambda place: None,
) -> Spec:
    """The checked problem of plain values; `source` and the lines of places are told in messages.

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


def _load(text: str, source: str) -> Any:
    if _too_deep(text):
        raise ConfigError(f"{source}: nested deeper than {MAX_DEPTH} levels.")
    try:
        return yaml.load(text, Loader=_StrictLoader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        where = f", line {mark.line + 1}" if mark else ""
        raise ConfigError(f"{source}{where}: not valid YAML: {error.problem}") from error
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        raise ConfigError(f"{source}: not valid YAML: {error}") from error


def _too_deep(text: str) -> bool:
    depth = 0
    try:
        for event in yaml.parse(text, Loader=yaml.SafeLoader):
            if isinstance(event, yaml.CollectionStartEvent):
                depth += 1
                if depth > MAX_DEPTH:
                    return True
            elif isinstance(event, yaml.CollectionEndEvent):
                depth -= 1
    except (yaml.YAMLError, RecursionError):
        return False  # told with its line by the loader
    return False


def _apply(tree: dict[str, Any], override: str) -> None:
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
    node[parts[-1]] = _load(text, f"--set {key}")
