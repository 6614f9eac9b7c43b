"""The generated references are those of the code."""

import re
from pathlib import Path
from types import ModuleType

import pytest

from docs import make_commands, make_configuration
from docs.make_configuration import slug
from excite_cli.config.spec import Spec
from excite_cli.effects.catalogue import catalogue

PAGES = [
    (make_configuration, make_configuration.configuration),
    (make_commands, make_commands.commands),
]


@pytest.mark.parametrize(("module", "page"), PAGES, ids=["configuration", "commands"])
def test_page_is_up_to_date(module: ModuleType, page: object) -> None:
    assert callable(page)
    message = f"run: python -m {module.__name__}"
    assert module.TARGET.read_text(encoding="utf-8") == page(), message


def test_every_key_is_explained_once() -> None:
    """No empty words, no heading twice, links that lead to a heading."""
    page = make_configuration.configuration()
    headings = re.findall(r"^## (.*)$", page, re.MULTILINE)
    assert len(set(map(slug, headings))) == len(headings) > 25
    assert {f"#{slug(heading)}" for heading in headings} >= set(re.findall(r"\((#[^)]*)\)", page))
    keys = re.findall(r"^- \*\*`(\w+)`\*\*(.*)<br>\*(.*)\*$", page, re.MULTILINE)
    assert len(keys) == len(re.findall(r"^- ", page, re.MULTILINE)) > 120
    for name, meaning, words in keys:
        assert words, name
        assert meaning or "](#" in words, f"{name} is not explained"
    definitions = Spec.model_json_schema()["$defs"]
    named = {name for schema in definitions.values() for name in schema.get("properties", ())}
    assert named <= {name for name, _, _ in keys}


def test_every_effect_is_in_the_catalogue_page() -> None:
    text = (Path(make_commands.__file__).parent / "effects.md").read_text(encoding="utf-8")
    missing = [kind for kind in catalogue() if f"\n### {kind}\n" not in text]
    assert not missing
