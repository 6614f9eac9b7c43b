"""YAML problems: spoiled trees and texts of the shipped configs, bombs and depth.

The entry is what every command starts with: `load_spec`, then the problem itself for the small arm
(its capsules are in the cache after the first).
"""

from pathlib import Path

import numpy as np
import yaml

from benchmarks.trust.fuzz_mutations import (
    Rng,
    chance,
    odd_text,
    odd_value,
    pick,
    spoiled_bytes,
    spoiled_text,
    spoiled_tree,
)
from benchmarks.trust.fuzz_trial import Fuzzer
from excite_cli.config.load import load_spec, parse_spec, spec_as_yaml
from excite_cli.config.spec import Spec
from excite_cli.excitation.problem import build_problem

_ROOT = Path(__file__).resolve().parents[2]
_ARM = str(_ROOT / "data" / "smoke_arm.urdf")
_WORDS = (
    b": ",
    b"- ",
    b"{",
    b"}",
    b"[",
    b"]",
    b"&a ",
    b"*a",
    b"!!python/name:os.system ",
    b"? ",
    b"|",
    b">",
    b"%YAML 9.9\n",
    b"---\n",
    b"...\n",
    b"<<: ",
    b"\t",
    b"'",
    b'"',
    b"#",
)


def _keys(schema: object) -> set[str]:
    """All keys that the schema knows."""
    found: set[str] = set()
    if isinstance(schema, dict):
        for key, value in schema.items():
            if key == "properties":
                found |= set(value)
            found |= _keys(value)
    elif isinstance(schema, list):
        for item in schema:
            found |= _keys(item)
    return found


class ConfigFuzzer(Fuzzer):
    """Configs."""

    name = "config"
    named = False  # what contradicts the robot is told by its key

    def open(self, bases: Path) -> None:
        """The shipped configs, as text and as trees; the words of the schema."""
        paths = sorted((_ROOT / "configs").glob("*.yaml"))
        self._texts = [path.read_bytes() for path in paths]
        self._trees = [yaml.safe_load(text) for text in self._texts]
        self._small = yaml.safe_load((_ROOT / "configs" / "smoke.yaml").read_bytes())
        self._small["robot"]["urdf"] = _ARM
        self._words = sorted(_keys(Spec.model_json_schema()))
        spec = parse_spec(yaml.safe_dump(self._small))
        build_problem(spec, _ROOT / "configs")

    def make(self, rng: np.random.Generator, folder: Path) -> tuple[Path, str]:
        """A spoiled config."""
        path = folder / "problem.yaml"
        way = int(rng.integers(20))
        if way < 8:
            made, data = "small tree", self._tree(rng, self._small)
        elif way < 12:
            made, data = "tree", self._tree(rng, pick(rng, self._trees))
        elif way < 15:
            made, data = "text", spoiled_text(rng, pick(rng, self._texts), _WORDS)
        elif way < 17:
            made, data = "bytes", spoiled_bytes(rng, pick(rng, self._texts))
        elif way == 17:
            made, data = "any value", _dumped(odd_value(rng))
        else:
            made, data = _hostile(rng)
        path.write_bytes(data)
        return path, made

    def _tree(self, rng: Rng, tree: object) -> bytes:
        return _dumped(spoiled_tree(rng, tree, self._words))

    def enter(self, path: Path) -> None:
        """Read; what is read is the same when written and read again; build the small arm's."""
        spec = load_spec(path)
        again = parse_spec(spec_as_yaml(spec))
        if again != spec:
            raise AssertionError("written and read again, it is another problem")
        if spec.robot.urdf == _ARM:
            build_problem(spec, path.parent)


def _dumped(tree: object) -> bytes:
    try:
        return yaml.safe_dump(tree, allow_unicode=True, sort_keys=False).encode("utf-8", "replace")
    except yaml.YAMLError:
        return repr(tree).encode("utf-8", "replace")


def _hostile(rng: Rng) -> tuple[str, bytes]:
    """What is meant to run code, to fill memory or to take for ever."""
    size = int(10 ** rng.uniform(1, 5.5))
    way = int(rng.integers(13))
    if way == 0:
        levels = [b"a0: &a0 [x]"]
        levels += [
            b"a%d: &a%d [%s]" % (k, k, b", ".join([b"*a%d" % (k - 1)] * 9)) for k in range(1, 10)
        ]
        return "bomb", b"\n".join(levels)
    if way == 1:
        return "depth", pick(rng, (b"[", b"{a: ", b"- ", b"? ")) * size
    if way == 2:
        return "depth of lines", b"".join(b" " * k + b"a:\n" for k in range(min(size, 1300)))
    if way == 3:
        return "many keys", b"".join(b"k%d: 1\n" % k for k in range(min(size, 80_000)))
    if way == 4:
        return "long key", b"a" * size + b": 1"
    if way == 5:
        return "long number", b"seed: " + b"9" * size
    if way == 6:
        return "code", b"robot: !!python/object/apply:os.system ['touch /nowhere/x']"
    if way == 7:
        return "long list", b"robot: {urdf: a, joints: [" + b"x, " * min(size, 300_000) + b"]}"
    if way == 8:
        return "blank", pick(rng, (b"", b"\n" * size, b" " * size, b"\xef\xbb\xbf", b"\0" * size))
    if way == 9:
        return "recursion", b"&a [*a]" if chance(rng, 0.5) else b"robot: &a {urdf: *a}"
    if way == 10:
        return "merge", b"<<: {robot: {urdf: x}}\nseed: 1"
    if way == 11:
        return "wide text", "robot: {urdf: ex}".encode(pick(rng, ("utf-16", "utf-32", "utf-7")))
    text = _dumped({"robot": {"urdf": odd_text(rng)}, odd_text(rng): 1})
    return "odd names", text
