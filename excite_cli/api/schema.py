"""The JSON Schema of the YAML problem, for editors: `excite schema`."""

import json
from pathlib import Path

from excite_cli.api.arguments import checked
from excite_cli.api.outputs import held
from excite_cli.atomic import write_text_atomically
from excite_cli.config.spec import Spec
from excite_cli.robot.description import example_robots
from excite_cli.shown.answer import Answer

# What a shell offers after Tab: names of robots, kinds of effects. Nothing else is imported.


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


def config_schema() -> str:
    """The schema as JSON text."""
    return json.dumps(Spec.model_json_schema(), indent=2, ensure_ascii=False)


@checked()
def save_schema(path: str | Path, overwrite: bool = False) -> Answer:
    """Write the schema; what is returned says how an editor finds it.

    Raises
    ------
    FileError
        The file exists, or cannot be written.
    """
    with held({"output": path}, overwrite):
        write_text_atomically(Path(path), config_schema() + "\n")
    hint = f"First line of a config: # yaml-language-server: $schema={path}"
    return Answer((str(path), hint), {"output": str(path)})
