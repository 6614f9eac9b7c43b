"""requirements/ci.txt pins, with hashes, all that pyproject.toml asks for, within its ranges."""

import re
import tomllib
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[2]
PINNED = ROOT / "requirements" / "ci.txt"
AGAIN = "is out of date: run `make lock`"


def pins() -> dict[str, list[Requirement]]:
    """Pinned requirements by name; one with markers may have several versions."""
    found: dict[str, list[Requirement]] = {}
    for line in re.sub(r"\s*\\\n\s*", " ", PINNED.read_text(encoding="utf-8")).splitlines():
        if line.strip() and not line.lstrip().startswith("#"):
            assert " --hash=sha256:" in line, f"no hash: {line}"
            each = Requirement(line.split(" --hash")[0])
            found.setdefault(canonicalize_name(each.name), []).append(each)
    return found


def asked() -> list[Requirement]:
    """All requirements of the program, of its extras and of what builds it."""
    with (ROOT / "pyproject.toml").open("rb") as file:
        content = tomllib.load(file)
    project = content["project"]
    texts = [*project["dependencies"], *content["build-system"]["requires"]]
    texts += [text for extra in project["optional-dependencies"].values() for text in extra]
    found = map(Requirement, texts)
    return [each for each in found if canonicalize_name(each.name) != project["name"]]


def test_every_dependency_is_pinned_within_its_range() -> None:
    pinned = pins()
    for wanted in asked():
        there = pinned.get(canonicalize_name(wanted.name))
        assert there, f"{wanted.name} is not pinned: {PINNED.name} {AGAIN}"
        for each in there:
            (exact,) = each.specifier
            assert exact.operator == "=="
            assert wanted.specifier.contains(exact.version, prereleases=True), (
                f"{each} is not within {wanted}: {PINNED.name} {AGAIN}"
            )
