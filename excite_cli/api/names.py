"""Names that a shell offers after Tab and pages of help list, those of other packages included.

Each imports what it needs, and no more: names of formats need little mathematics.
"""


def robot_names() -> list[str]:
    """Short names of the robots of example-robot-data; RobotError if that is not installed."""
    from excite_cli.robot.description import example_robots

    return list(example_robots())


def effects() -> list[str]:
    """Kinds of effects."""
    from excite_cli.effects.catalogue import EFFECTS

    return EFFECTS.names


def motion_formats() -> list[str]:
    """Formats of motions, as `excite export --format` takes them."""
    from excite_cli.motion_formats.catalogue import MOTION_FORMATS

    return MOTION_FORMATS.names


def export_formats() -> list[str]:
    """Formats of `excite export`, of motions first."""
    from excite_cli.export.exported import MODEL_FORMATS

    return [*motion_formats(), *MODEL_FORMATS]


def readers() -> list[str]:
    """Formats of measured data."""
    from excite_cli.measurement.catalogue import READERS

    return READERS.names
