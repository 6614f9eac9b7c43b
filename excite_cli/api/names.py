"""Names that a shell offers after Tab and pages of help list, those of other packages included.

Each imports what it needs, and no more: names of formats need little mathematics.
"""


def robot_names() -> list[str]:
    """Short names of the robots of example-robot-data.

    Raises
    ------
    RobotError
        The package is not installed.
    """
    from excite_cli.robot.description import example_robots

    return list(example_robots())


def effect_kinds() -> list[str]:
    """Kinds of effects."""
    from excite_cli.effects.catalogue import EFFECTS

    return list(EFFECTS.members)


def export_formats() -> list[str]:
    """Formats of `excite export`, of motions first."""
    from excite_cli.export.model_formats import MODEL_FORMATS

    return [*motion_formats(), *MODEL_FORMATS]


def motion_formats() -> list[str]:
    """Names of the formats of motions."""
    from excite_cli.motion_formats.catalogue import MOTION_FORMATS

    return list(MOTION_FORMATS.members)


def motion_titles() -> list[str]:
    """What the formats of motions are called."""
    from excite_cli.motion_formats.catalogue import MOTION_FORMATS

    return [found.title for found in MOTION_FORMATS.members.values()]


def reader_titles() -> list[str]:
    """Formats of measured data."""
    from excite_cli.measurement.catalogue import READERS

    return list(READERS.members)
