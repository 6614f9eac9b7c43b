"""Versions of the program and of the libraries that decide its numbers."""

from importlib import metadata

from excite_cli import __version__

_LIBRARIES = ("pin", "coal", "numpy", "scipy", "h5py", "clarabel", "mujoco", "example-robot-data")


def versions() -> dict[str, str]:
    """Installed version of each library, `missing` where there is none."""
    found = {"excite-cli": __version__}
    for name in _LIBRARIES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "missing"
    return found
