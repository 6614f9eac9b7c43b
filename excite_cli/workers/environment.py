"""What must be the same on every machine that takes part, and what better is.

The same task gives the same numbers only with the same program and libraries. The last digits
also depend on the instructions that the linear algebra library picks for a processor: that is
seen by trying, and told.
"""

import hashlib
import platform
import struct
from dataclasses import dataclass
from functools import cache
from importlib import import_module, metadata
from pathlib import Path

import excite_cli

_LIBRARIES = ("numpy", "scipy", "pin", "coal", "clarabel")


@dataclass(frozen=True)
class Environment:
    """Versions of the libraries, the digest of our own source, and how numbers are rounded.

    Among the versions is whether the inner loops are the compiled ones.
    """

    versions: tuple[tuple[str, str], ...]
    rounding: str

    def against(self, other: "Environment") -> str:
        """In words, what differs from `other` and must not; empty if nothing does."""
        mine, theirs = dict(self.versions), dict(other.versions)
        return ", ".join(
            f"{name} {mine[name]} here, {theirs.get(name, 'none')} there"
            for name in mine
            if mine[name] != theirs.get(name)
        )


@cache
def environment() -> Environment:
    """Those of this process."""
    versions = [("Python", platform.python_version()), ("excite", _own_source())]
    for name in _LIBRARIES:
        try:
            versions.append((name, metadata.version(name)))
        except metadata.PackageNotFoundError:
            versions.append((name, "none"))
    versions.append(("kernels", _kernels()))
    return Environment(tuple(versions), _rounding())


def _kernels() -> str:
    """Which inner loops are in use; by name, since their package is above this one."""
    found = import_module("excite_cli.kernels.compiled").KERNELS
    return "numpy" if found is None else "compiled"


def _own_source() -> str:
    """Version and the first letters of a digest of all our Python files."""
    folder, digest = Path(excite_cli.__file__).parent, hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        digest.update(str(path.relative_to(folder)).encode())
        digest.update(path.read_bytes())
    return f"{excite_cli.__version__} ({digest.hexdigest()[:8]})"


def _rounding() -> str:
    """Digest of a small computation of each kind that the program does."""
    import numpy as np
    from scipy.linalg import cho_factor, cho_solve, qr
    from threadpoolctl import threadpool_limits

    rng = np.random.default_rng(1)
    a = rng.normal(size=(200, 60))
    digest = hashlib.sha256()
    with threadpool_limits(limits=1):
        gram = a.T @ a
        parts = [
            gram,
            qr(a, mode="r")[0],
            np.linalg.eigvalsh(gram),
            np.linalg.svd(a, compute_uv=False),
            cho_solve(cho_factor(gram), a[0]),
            np.sin(a) + np.exp(a) + np.log(np.abs(a)) + np.sqrt(np.abs(a)),
            np.array([a.sum()]),
        ]
    for part in parts:
        digest.update(struct.pack(f"{part.size}d", *np.ascontiguousarray(part).ravel()))
    return digest.hexdigest()[:12]
