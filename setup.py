"""The tag of the wheel; everything else stands in pyproject.toml.

The compiled library holds no symbol of Python, so that one wheel per platform serves every version.
Where no compiler was found there is nothing to tie the wheel to a platform either.
"""

from pathlib import Path

from setuptools import setup
from setuptools.command.bdist_wheel import bdist_wheel


class WheelOfItsPlatform(bdist_wheel):
    """`py3-none-PLATFORM` with the compiled library, `py3-none-any` without."""

    def get_tag(self) -> tuple[str, str, str]:
        """Python, ABI and platform."""
        platform = super().get_tag()[2]
        compiled = any(Path(self.bdist_dir).glob("**/_kernels*"))
        return "py3", "none", platform if compiled else "any"


setup(cmdclass={"bdist_wheel": WheelOfItsPlatform})
