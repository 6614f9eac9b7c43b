"""One wheel for all versions of Python on a platform; without a compiler, one for all platforms."""

import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
_LEFT_OUT = shutil.ignore_patterns("*.so", "__pycache__")


def wheel(folder: Path, compiler: str) -> Path:
    """The wheel that `compiler` makes of the package."""
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, folder)
    shutil.copytree(ROOT / "excite_cli", folder / "excite_cli", ignore=_LEFT_OUT)
    subprocess.run(
        [sys.executable, "setup.py", "--quiet", "bdist_wheel"],
        cwd=folder,
        env={**os.environ, "CC": compiler},
        capture_output=True,
        check=True,
        timeout=300,
    )
    (found,) = (folder / "dist").iterdir()
    return found


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler on this machine")
def test_with_a_compiler(tmp_path: Path) -> None:
    pytest.importorskip("setuptools")
    built = wheel(tmp_path, "cc")
    python, abi, platform = built.stem.split("-")[-3:]
    assert (python, abi) == ("py3", "none")
    assert platform != "any"
    with zipfile.ZipFile(built) as archive:
        (library,) = (name for name in archive.namelist() if name.endswith(".so"))
        archive.extract(library, tmp_path)
    assert "excite_cli/kernels/_kernels" in library
    # No name that Python would have to give is asked for; the one found is its own.
    names = re.findall(rb"\x00(_?Py\w*_\w+)(?=\x00)", (tmp_path / library).read_bytes())
    assert set(names) == {b"PyInit__kernels"}


def test_without_a_compiler(tmp_path: Path) -> None:
    """Links of its page lead to the repository."""
    pytest.importorskip("setuptools")
    built = wheel(tmp_path, "/bin/false")
    assert built.stem.endswith("-py3-none-any")
    with zipfile.ZipFile(built) as archive:
        names = archive.namelist()
        (metadata,) = (each for each in names if each.endswith("/METADATA"))
        page = archive.read(metadata).decode()
    assert "excite_cli/kernels/compiled.py" in names
    assert not any(name.endswith(".so") for name in names)
    home = re.findall(r"^Project-URL: Homepage, (.*)$", page, re.MULTILINE)[0]
    links = re.findall(r"\]\(([^)]+)\)", page)
    assert f"{home}/blob/main/docs/tutorial.md" in links
    assert f"{home}/raw/main/docs/images/talos_arms.gif" in links
    assert [link for link in links if not link.startswith("https://")] == []
