"""A seeded share of `benchmarks/trust/fuzz.py`: every input is accepted or refused with a message.

The benchmark makes thousands; these find what breaks at once.
"""

from pathlib import Path

import pytest

from benchmarks.trust.fuzz import FUZZERS
from benchmarks.trust.trial import attempt, generator
from excite_cli.errors import ConfigError, ExciteError
from tests.trust.refusals import Entry

# How many inputs; those of results need a plan and a diagnosis first.
SHARES = {"config": 60, "csv": 100, "hdf5": 60, "bags": 40, "motions": 40, "urdf": 50}


@pytest.mark.parametrize("name", SHARES)
def test_random_inputs_are_accepted_or_refused(name: str, tmp_path: Path) -> None:
    fuzzer = FUZZERS[name]()
    fuzzer.prepare(tmp_path)
    fuzzer.open(tmp_path)
    ends = set()
    for index in range(SHARES[name]):
        folder = tmp_path / f"input_{index}"
        folder.mkdir()
        path, made = fuzzer.make(generator(0, fuzzer, index), folder)
        verdict = attempt(fuzzer, path, index, made)
        assert verdict.good, verdict
        ends.add(verdict.end)
    assert ends == {"accepted", "refused"}  # neither only rubbish, nor nothing spoiled


def test_every_parser_has_a_share() -> None:
    assert set(FUZZERS) - set(SHARES) == {"results"}


@pytest.mark.parametrize(
    ("raised", "end"),
    [
        (ZeroDivisionError("x"), "ZeroDivisionError"),
        (MemoryError(), "MemoryError"),
        (ExciteError(""), "no message"),
        (ExciteError("something is wrong"), "file not named"),
        (ExciteError("log.csv is wrong"), "refused"),
        (ConfigError("robot.urdf: is wrong"), "refused"),
        (ExciteError("log.csv" + " x" * 5_000), "long message"),
    ],
)
def test_the_judge_tells_faults_from_refusals(raised: BaseException, end: str) -> None:
    def enter(path: Path) -> None:
        raise raised

    assert attempt(Entry(enter), Path("log.csv"), 0, "").end == end
