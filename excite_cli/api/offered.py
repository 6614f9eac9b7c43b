"""What a shell offers after Tab: names of robots, kinds of effects. Nothing else is imported."""

from excite_cli.robot.description import example_robots


def robot_names() -> list[str]:
    """Short names of the robots of example-robot-data.

    Raises
    ------
    RobotError
        The package is not installed.
    """
    return list(example_robots())


def effect_kinds() -> list[str]:
    """Kinds of effects, those of other packages included."""
    from excite_cli.effects.catalogue import catalogue  # names of robots need no mathematics

    return list(catalogue())
