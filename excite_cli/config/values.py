"""Plain values of a config that was put together in Python: what YAML could have said."""

from collections.abc import Mapping
from pathlib import PurePath
from typing import Any

from excite_cli.errors import ConfigError

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
