"""The tag of the wheel and the page at the registry; everything else stands in pyproject.toml.

The compiled library holds no symbol of Python, so that one wheel per platform serves every version.
Where no compiler was found there is nothing to tie the wheel to a platform either.
"""

import re
import tomllib
from pathlib import Path

from setuptools import setup
from setuptools.command.bdist_wheel import bdist_wheel

ROOT = Path(__file__).resolve().parent


class WheelOfItsPlatform(bdist_wheel):
    """`py3-none-PLATFORM` with the compiled library, `py3-none-any` without."""

    def get_tag(self) -> tuple[str, str, str]:
        """Python, ABI and platform."""
        platform = super().get_tag()[2]
        compiled = any(Path(self.bdist_dir).glob("**/_kernels*"))
        return "py3", "none", platform if compiled else "any"


def page() -> str:
    """The README with links and pictures that lead to the repository, as the registry lacks it."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    home = project["urls"]["Homepage"]
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    pictures = re.sub(r"(!\[[^\]]*\]\()(?!https?:|#)", rf"\1{home}/raw/main/", text)
    return re.sub(r"(?<!!)(\[[^\[\]]*\]\()(?!https?:|#)", rf"\1{home}/blob/main/", pictures)


setup(
    cmdclass={"bdist_wheel": WheelOfItsPlatform},
    long_description=page(),
    long_description_content_type="text/markdown",
)
