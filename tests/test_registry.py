"""Families that packages may add to: thin bases, the same registry, the same messages."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from excite_cli.checks.catalogue import CHECKS
from excite_cli.constraints.catalogue import CONSTRAINTS
from excite_cli.criteria.catalogue import CRITERIA
from excite_cli.effects.catalogue import EFFECTS
from excite_cli.errors import ConfigError, ExciteWarning
from excite_cli.measurement.catalogue import READERS
from excite_cli.measurement.torque_sources.catalogue import TORQUE_SOURCES
from excite_cli.motion_formats.catalogue import MOTION_FORMATS
from excite_cli.registry import Registry
from tests.effects import own_package
from tests.registries import forget

FAMILIES = {
    registry.group: registry
    for registry in (
        EFFECTS,
        CONSTRAINTS,
        CRITERIA,
        READERS,
        MOTION_FORMATS,
        CHECKS,
        TORQUE_SOURCES,
    )
}
EVERY = pytest.mark.parametrize("group", FAMILIES)
MOST = 15  # modules of the program that a base imports


def declare(
    registry: Registry[Any], folder: Path, code: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A package whose entry point `mine` leads to `Mine` of a module with this code."""
    module = f"of_{registry.group.partition('.')[2]}"
    names = {"mine": f"{module}:Mine"}
    own_package.install(folder, code, names, monkeypatch, module, registry.group)
    forget(registry)


@pytest.fixture(autouse=True)
def _read_anew() -> Any:
    yield
    for registry in FAMILIES.values():
        forget(registry)


def a_member(registry: Registry[Any]) -> tuple[str, type]:
    """The first of the program's own whose name is stated by its class."""
    return next(
        (name, found)
        for name, found in registry.members.items()
        if getattr(found, registry.needed[0]) == name
    )


@EVERY
def test_a_base_imports_next_to_nothing(group: str) -> None:
    base = FAMILIES[group].base.__module__
    count = "sum(name.split('.')[0] == 'excite_cli' for name in sys.modules)"
    code = f"import sys, {base}; print({count})"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert int(run.stdout) <= MOST


@EVERY
def test_own_members_are_listed_by_the_names_that_they_state(group: str) -> None:
    registry = FAMILIES[group]
    sections = {"joint_limits", "torque"}  # of the config: several constraints each
    for name, found in registry.members.items():
        assert issubclass(found, registry.base)
        assert name in sections or getattr(found, registry.needed[0]) == name
    assert registry.names == list(registry.members)


@EVERY
def test_a_member_of_a_package_is_found(
    group: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    registry = FAMILIES[group]
    name, own = a_member(registry)
    imported = f"from {own.__module__} import {own.__name__} as Own"
    code = f"{imported}\nclass Mine(Own): {registry.needed[0]} = 'mine'"
    declare(registry, tmp_path, code, monkeypatch)
    assert registry.named("mine", "here").__name__ == "Mine"
    assert list(registry.foreign) == ["mine"]
    assert registry.names[-1] == "mine"
    assert registry.foreign_first[0] is registry.members["mine"]
    assert registry.named(name, "here") is own


@EVERY
@pytest.mark.parametrize("case", ["taken", "import", "abstract", "nameless", "another"])
def test_one_that_cannot_be_used_is_set_aside(
    group: str, case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    registry = FAMILIES[group]
    name, own = a_member(registry)
    base, word = registry.base, registry.word
    inherit = f"from {own.__module__} import {own.__name__} as Own\n"
    code, why = {
        "taken": (f"{inherit}Mine = Own", f"there is another {word} '{name}'"),
        "import": ("import nothing_of_that_name", "it cannot be loaded .ModuleNotFoundError"),
        "abstract": (
            f"from {base.__module__} import {base.__name__} as Base\nclass Mine(Base): pass",
            f"it lacks {min(base.__abstractmethods__)}",  # type: ignore[attr-defined]
        ),
        "nameless": (
            f"{inherit}class Mine(Own): {registry.needed[0]} = ''",
            f"it does not state its {registry.needed[0]}",
        ),
        "another": ("Mine = 3", f"it is not a subclass of {base.__name__}"),
    }[case]
    declare(registry, tmp_path, code, monkeypatch)
    with pytest.warns(ExciteWarning, match=f"{word} 'mine' .* of a package is set aside: {why}"):
        assert not registry.foreign
    with pytest.raises(ConfigError, match=f"^here: there is no {word} 'mine'. A package has one"):
        registry.named("mine", "here")


@EVERY
def test_an_unknown_name_is_told_with_the_nearest(group: str) -> None:
    registry = FAMILIES[group]
    name, _ = a_member(registry)
    with pytest.raises(ConfigError) as caught:
        registry.named(f"{name}x", "here")
    start = f"here: there is no {registry.word} '{name}x'. Did you mean '{name}'? Known: "
    assert str(caught.value).startswith(start)
    assert str(caught.value).endswith(f"{', '.join(registry.members)}.")
