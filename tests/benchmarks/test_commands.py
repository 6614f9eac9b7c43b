"""Every module of the benchmarks can be imported, and documents name only those that exist."""

import importlib.util
import pkgutil
import re
from pathlib import Path

import pytest

import benchmarks

ROOT = Path(__file__).parents[2]
# Programs for interpreters of other tools: they import what is installed there.
OTHERS = {"figaroh_driver", "figaroh_motion_driver", "sysid_driver", "urdf_driver", "wls_driver"}
MODULES = [
    module.name
    for module in pkgutil.walk_packages(benchmarks.__path__, "benchmarks.")
    if module.name.split(".")[-1] not in OTHERS
]
PAGES = (
    ROOT / "Makefile",
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *ROOT.glob("docs/**/*.md"),
)


@pytest.mark.parametrize("name", MODULES)
def test_a_module_can_be_imported(name: str) -> None:
    importlib.import_module(name)


def test_commands_of_documents_exist() -> None:
    named = {
        name
        for page in PAGES
        for name in re.findall(r"-m (benchmarks[.\w]*\w)", page.read_text(encoding="utf-8"))
    }
    assert named
    assert not {name for name in named if importlib.util.find_spec(name) is None}
