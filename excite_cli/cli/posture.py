"""The posture of --from."""

from excite_cli.errors import ConfigError


def start_from(text: str | None, entry: bool) -> dict[str, float] | None:
    """Positions by joint of `joint=value,joint=value`; None without --entry.

    Raises
    ------
    ConfigError
        The text cannot be read, or is given without --entry.
    """
    if text is not None and not entry:
        raise ConfigError("--from says where --entry starts: give both.")
    given: dict[str, float] = {}
    for part in () if text is None else (piece.strip() for piece in text.split(",")):
        name, equals, value = part.partition("=")
        try:
            number = float(value)
        except ValueError:
            equals = ""
        if not equals:
            raise ConfigError(f"--from: '{part}' is not joint=value [rad or m].")
        if name.strip() in given:
            raise ConfigError(f"--from: {name.strip()} is given twice.")
        given[name.strip()] = number
    return given if entry else None
