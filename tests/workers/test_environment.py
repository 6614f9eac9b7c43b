"""What workers elsewhere must have in common with this process."""

import pytest

from excite_cli.kernels import compiled as kernels
from excite_cli.workers.cluster import environment


def test_workers_without_the_compiled_loops_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernels, "KERNELS", object())
    here = environment.__wrapped__()
    monkeypatch.setattr(kernels, "KERNELS", None)
    there = environment.__wrapped__()
    assert here.against(here) == ""
    assert here.against(there) == "kernels compiled here, numpy there"
