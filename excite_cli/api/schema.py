"""The JSON Schema of the YAML problem, for editors: `excite schema`."""

import json
from pathlib import Path

from excite_cli.api.arguments import checked
from excite_cli.api.outputs import held
from excite_cli.atomic import write_text_atomically
from excite_cli.config.spec import Spec
from excite_cli.shown.answer import Answer


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
