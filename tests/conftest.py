"""Which tests are long: left to `make test-all`, beside those that are marked one by one."""

from pathlib import Path

import pytest

# Whole ways through the program: minutes, and hardly one of them fails alone.
_LONG = {"benchmarks", "docs", "end_to_end", "examples", "trust", "trust_files"}


def _is_long(path: Path) -> bool:
    inside = path.relative_to(Path(__file__).parent).parts
    return inside[:1] in {(each,) for each in _LONG} or inside == ("cli", "test_help_examples.py")


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Nor are they imported where none of them is run."""
    return (config.option.markexpr == "not long" and _is_long(collection_path)) or None


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if _is_long(item.path):
            item.add_marker(pytest.mark.long)
