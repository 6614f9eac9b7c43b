"""What the shell offers after Tab: robots, formats, kinds of effects, keys of the config.

Nothing here loads mathematics but the kinds of effects and names within a config, and errors end in
no offer: a Tab must neither wait nor print.
"""

from collections.abc import Callable

from excite_cli.api import names


def complete_format(incomplete: str) -> list[str]:
    """Formats of `excite export`."""
    return _named("export_formats", incomplete)


def complete_robot(incomplete: str) -> list[str]:
    """Short names of the robots of example-robot-data."""
    return _named("robot_names", incomplete)


def complete_effect(incomplete: str) -> list[str]:
    """`kind@` of every effect that can be planted."""
    return [f"{kind}@" for kind in _named("effects", incomplete)]


def complete_key(incomplete: str) -> list[str]:
    """Keys of the config, section by section, and names that they may have: `criterion.kind=`."""
    return _quietly(lambda: _keys(incomplete))


def _named(family: str, incomplete: str) -> list[str]:
    """Names of `api.names` that begin so."""
    offer = getattr(names, family)
    return _quietly(lambda: [name for name in offer() if name.startswith(incomplete)])


def _words(key: str) -> tuple[list[str], list[str]]:
    from excite_cli.api.schema import words_at

    return words_at(key.split("."))


def _keys(incomplete: str) -> list[str]:
    from excite_cli.config.section import Section
    from excite_cli.config.spec import Spec

    key, equals, value = incomplete.partition("=")
    if equals:
        return [f"{key}={name}" for name in _words(key)[1] if name.startswith(value)]
    *path, last = incomplete.split(".")
    section: type[Section] | None = Spec
    for part in path:
        section = section.child(part, None) if section is not None else None
    start = "".join(f"{part}." for part in path)
    if section is None:  # below a mapping whose keys are names, as those of constraints
        keys = _words(start[:-1])[0]
        return [f"{start}{name}" for name in keys if name.startswith(last)]
    found = [name for name in section.model_fields if name.startswith(last)]
    return [start + name + ("." if section.child(name, None) else "=") for name in found]


def _quietly(offer: Callable[[], list[str]]) -> list[str]:
    try:
        return offer()
    except Exception:
        return []
