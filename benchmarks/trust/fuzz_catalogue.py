"""The fuzzers, one for every parser."""

from benchmarks.trust.fuzz_bags import BagFuzzer
from benchmarks.trust.fuzz_config import ConfigFuzzer
from benchmarks.trust.fuzz_csv import CsvFuzzer
from benchmarks.trust.fuzz_hdf5 import Hdf5Fuzzer
from benchmarks.trust.fuzz_motions import MotionFuzzer
from benchmarks.trust.fuzz_results import ResultFuzzer
from benchmarks.trust.fuzz_trial import Fuzzer
from benchmarks.trust.fuzz_urdf import UrdfFuzzer

FUZZERS: tuple[type[Fuzzer], ...] = (
    ConfigFuzzer,
    CsvFuzzer,
    Hdf5Fuzzer,
    ResultFuzzer,
    BagFuzzer,
    MotionFuzzer,
    UrdfFuzzer,
)


def fuzzer_named(name: str) -> Fuzzer:
    """A new fuzzer of the parser `name`."""
    return next(fuzzer for fuzzer in FUZZERS if fuzzer.name == name)()
