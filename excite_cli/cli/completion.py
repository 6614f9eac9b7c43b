"""What the shell offers after Tab: robots, formats, kinds of effects, keys of the config.

Nothing here loads mathematics but the kinds of effects, and errors end in no offer: a Tab must
neither wait nor print.
"""

from collections.abc import Callable

MOTION_FORMATS = ("csv", "ros2", "rosbag2", "mcap", "moveit", "npz")
MODEL_FORMATS = ("urdf", "mjcf", "yaml", "c")


def complete_format(incomplete: str) -> list[str]:
    """Formats of `excite export`."""
    return [name for name in (*MOTION_FORMATS, *MODEL_FORMATS) if name.startswith(incomplete)]


def complete_robot(incomplete: str) -> list[str]:
    """Short names of the robots of example-robot-data."""
    return _quietly(lambda: [name for name in _robots() if name.startswith(incomplete)])


def complete_effect(incomplete: str) -> list[str]:
    """`kind@` of every effect that can be planted."""
    return _quietly(lambda: [f"{kind}@" for kind in _kinds() if kind.startswith(incomplete)])


def complete_key(incomplete: str) -> list[str]:
    """Keys of the config, section by section: `optimizer.max_iterations=`."""
    return _quietly(lambda: _keys(incomplete))


def _robots() -> list[str]:
    from excite_cli.api.schema import robot_names

    return robot_names()


def _kinds() -> list[str]:
    from excite_cli.api.schema import effect_kinds

    return effect_kinds()


def _keys(incomplete: str) -> list[str]:
    from excite_cli.config.section import Section
    from excite_cli.config.spec import Spec

    *path, last = incomplete.split(".")
    section: type[Section] | None = Spec
    for part in path:
        section = section.child(part, None) if section is not None else None
    if section is None:
        return []
    start = "".join(f"{part}." for part in path)
    names = [name for name in section.model_fields if name.startswith(last)]
    return [start + name + ("." if section.child(name, None) else "=") for name in names]


def _quietly(offer: Callable[[], list[str]]) -> list[str]:
    try:
        return offer()
    except Exception:
        return []
