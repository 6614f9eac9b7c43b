"""A run that is interrupted, by force or by hand, goes on to the numbers of one that was not."""

import shutil
import signal
import time
from pathlib import Path
from subprocess import Popen

import h5py
import numpy as np
import pytest

from excite_cli.store.result_file import read_result
from tests.cli.program import SMOKE, Installed

ASKED = ("optimize", SMOKE, "--motions", "3", "--set", "optimizer.max_iterations=40")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, cache: Path) -> Path:
    """Three motions in one go."""
    folder = tmp_path_factory.mktemp("whole")
    run = Installed(folder, cache)(*ASKED, "-o", "whole.h5")
    assert run.returncode == 0, run.stderr
    return folder / "whole.h5"


def interrupted(process: Popen[str], path: Path, number: int) -> str:
    """Send signal `number` once the first motion is on disk; return what stderr said."""
    until = time.monotonic() + 60.0
    while not path.exists():
        assert process.poll() is None, process.communicate()[1]
        assert time.monotonic() < until, "no motion within a minute"
        time.sleep(0.002)
    process.send_signal(number)
    return process.communicate(timeout=60)[1]


def assert_same_numbers(first: Path, second: Path) -> None:
    """Every dataset of both files to the last bit; seconds are nobody's numbers."""
    with h5py.File(first) as one, h5py.File(second) as other:
        names, others = list[str](), list[str]()
        one.visit(names.append)
        other.visit(others.append)
        assert names == others
        assert {"motions/3/coefficients", "tables/condition_number", "stack/R"} <= set(names)
        for name in names:
            if isinstance(one[name], h5py.Dataset):
                np.testing.assert_array_equal(one[name][()], other[name][()], err_msg=name)
            for key in set(one[name].attrs) - {"seconds"}:
                assert one[name].attrs[key] == other[name].attrs[key], f"{name}: {key}"
        for key in ("config", "seed", "robot_hash"):
            assert one.attrs[key] == other.attrs[key]


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT], ids=["killed", "ctrl-c"])
def test_an_interrupted_run_goes_on_to_the_same_numbers(
    excite: Installed, whole: Path, number: signal.Signals
) -> None:
    path = excite.folder / "cut.h5"
    process = excite.start(*ASKED, "-o", path)
    told = interrupted(process, path, number)
    left = read_result(path)
    ended = [motion for motion in left.motions if motion.status != "interrupted"]
    assert 1 <= len(left.motions) <= 3
    assert len(ended) < 3
    assert len(left.stack.factor) == len(left.base_selection)
    if number == signal.SIGINT:
        assert process.returncode == 130
        assert "interrupted; what was found so far is in the file" in told
        assert "Traceback" not in told
        assert [p.name for p in excite.folder.iterdir()] == ["cut.h5"]
    else:
        assert process.returncode == -signal.SIGKILL
    run = excite(*ASKED, "-o", path, "--resume")
    assert run.returncode == 0, run.stderr
    assert f"resuming after motion {len(ended)}" in run.stderr
    assert_same_numbers(path, whole)


def test_a_finished_run_has_nothing_to_go_on_with(excite: Installed, whole: Path) -> None:
    path = excite.folder / "done.h5"
    path.write_bytes(whole.read_bytes())
    answer = excite.answer(*ASKED, "-o", path, "--resume")
    assert [motion["index"] for motion in answer["motions"]] == [1, 2, 3]
    assert_same_numbers(path, whole)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("--set", "trajectory.harmonics=3"), "(different: trajectory)"),
        (("--seed", "4"), "(different: seed)"),
        # A prior is not in the stored stack, so to go on without a word would be to ignore it.
        (("--prior", "whole.h5"), "--prior"),
    ],
)
def test_what_the_file_was_not_made_with_is_refused(
    excite: Installed, whole: Path, change: tuple[str, ...], words: str
) -> None:
    for name in ("cut.h5", "whole.h5"):
        shutil.copy(whole, excite.folder / name)
    run = excite(*ASKED, *change, "--motions", "4", "-o", "cut.h5", "--resume")
    assert run.returncode == 2
    assert words in run.stderr
    assert (excite.folder / "cut.h5").read_bytes() == whole.read_bytes()
