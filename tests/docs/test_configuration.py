"""The generated reference is that of the code."""

from docs.make_configuration import TARGET, configuration


def test_configuration_page_is_up_to_date() -> None:
    message = "run: python -m docs.make_configuration"
    assert TARGET.read_text(encoding="utf-8") == configuration(), message
