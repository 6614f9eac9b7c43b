"""Writes docs/configuration.md from the classes that check the YAML file.

Run: python -m docs.make_configuration
"""

from pathlib import Path
from typing import Any, get_args

from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from excite_cli.config.section import Section
from excite_cli.config.spec import Spec

TARGET = Path(__file__).parent / "configuration.md"
HEAD = """# Every key of the YAML file

Made by `python -m docs.make_configuration` from the classes in `excite_cli/config/`; a test keeps
it up to date. `excite schema` prints the same as JSON Schema for editors. Unknown keys are errors.
"""


def configuration() -> str:
    """The page as Markdown."""
    parts = [HEAD]
    for title, section in _sections("", Spec):
        parts.append(f"\n## {title or 'top level'}\n\n{section.__doc__}\n")
        parts.append("| key | what | default |\n|---|---|---|")
        parts += [_row(name, field) for name, field in section.model_fields.items()]
    return "\n".join(parts) + "\n"


def _row(name: str, field: FieldInfo) -> str:
    words = _type_in_words(field.annotation)
    text = f"{field.description} ({words})" if field.description else words
    return f"| `{name}` | {text} | {_default(field)} |".replace("||", "|")


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "required"
    value = field.get_default(call_default_factory=True)
    if value is PydanticUndefined or isinstance(value, Section):
        return "see below"
    if value is None:
        return "none"
    return f"`{list(value)}`" if isinstance(value, tuple) else f"`{value}`"


def _type_in_words(annotation: Any) -> str:
    if annotation is type(None):
        return "null"
    if isinstance(annotation, type):
        named = {float: "number", int: "integer", str: "text", bool: "true or false"}
        return named.get(annotation, "a section" if issubclass(annotation, Section) else "…")
    origin, inner = getattr(annotation, "__origin__", None), get_args(annotation)
    if origin is dict:
        return f"a mapping of names to {_type_in_words(inner[1])}"
    if origin is tuple:
        if inner[-1] is Ellipsis:
            return f"a list of {_type_in_words(inner[0])}"
        return f"{len(inner)} of {_type_in_words(inner[0])}"
    if all(isinstance(word, str) for word in inner):
        return ", ".join(f"`{word}`" for word in inner)
    if hasattr(annotation, "__metadata__"):
        return _type_in_words(inner[0])
    return " or ".join(dict.fromkeys(_type_in_words(part) for part in inner))


def _sections(path: str, section: type[Section]) -> list[tuple[str, type[Section]]]:
    found = [(path, section)]
    for name, field in section.model_fields.items():
        for inner in _models(field.annotation):
            found += _sections(f"{path}.{name}" if path else name, inner)
    return found


def _models(annotation: Any) -> list[type[Section]]:
    if isinstance(annotation, type):
        return [annotation] if issubclass(annotation, Section) else []
    return [model for inner in get_args(annotation) for model in _models(inner)]


if __name__ == "__main__":
    TARGET.write_text(configuration(), encoding="utf-8")
