"""One robot through the commands as a user types them, each a process with a limit of time.

Between planning and simulating an effect is drawn that the config does not declare. What came of it
is a record of plain values, for a JSON file.
"""

import contextlib
import json
import sys
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.battery.scoring import Name, Truth, answer_of_json, plant_of_record, score
from benchmarks.program import EXCITE, ran
from benchmarks.robots.sources import Source

_LONGEST = 900.0  # [s] of one command
_GOOD = ("true", "alias", "identity", "companion")

Record = dict[str, Any]


class EndedError(Exception):
    """A command ended otherwise than with exit status 0."""


class _Steps:
    """Runs commands in a robot's folder, and keeps what the record says about them."""

    def __init__(self, folder: Path, record: Record) -> None:
        self.folder, self.record = folder, record

    def excite(self, verb: str, *arguments: str | Path) -> Any:
        return self.run(verb, [*EXCITE, verb, *arguments, "--json"])

    def run(self, step: str, words: Sequence[str | Path]) -> Any:
        # The cache is empty: the first `init` is measured.
        done = ran(words, self.folder, _LONGEST, XDG_CACHE_HOME=str(self.folder / "cache"))
        self.record["seconds"][step] = round(done.processor, 1)
        told = done.status == 1 and step == "diagnose" and done.answer is not None
        if done.status != 0 and not told:
            message = _message(done.errors) if done.status > 0 else f"signal {-done.status}"
            if done.status == -9:
                message = f"it took longer than {_LONGEST:g} s"
            self.record.update(failed=step, exit_status=done.status, message=message)
            raise EndedError
        return done.answer


def _message(told: str) -> str:
    """The error of a command with --json, else the end of what it told."""
    last = (told.strip().splitlines() or [""])[-1]
    try:
        return str(json.loads(last)["error"])
    except (ValueError, KeyError, TypeError):
        return last[-300:]


def travelled(source: Source, folder: Path, seed: int) -> Record:
    """What a user sees who types the commands for one robot."""
    record: Record = {"robot": source.name, "format": source.format, "seconds": {}}
    folder.mkdir(parents=True, exist_ok=True)
    own = zlib.crc32(f"{seed} {source.name}".encode())
    with contextlib.suppress(EndedError):
        _travel(source, _Steps(folder, record), own)
    return record


def _travel(source: Source, steps: _Steps, seed: int) -> None:
    record = steps.record
    begin = ("init", *source.given, "-o", "robot.yaml", "--allow-found", "--overwrite")
    proposal = steps.excite(*begin)
    record["joints"] = len(proposal["joints"])
    record["base_parameters"] = proposal["base_parameters"]
    record["ignored_pairs"] = _ignored(steps.folder / "robot.yaml")
    plan = ("optimize", "robot.yaml", "-o", "motions.h5", "--overwrite", "--no-progress")
    last = steps.excite(*plan)["motions"][-1]
    record["condition_number"] = last["stacked_condition_number"]
    record["proved"] = all(last["certified"].values())
    steps.excite("check", "robot.yaml", "motions.h5")
    record["admissible"] = True
    draw = (sys.executable, "-m", "benchmarks.robots.planting", "robot.yaml", "motions.h5")
    plant = steps.run("draw", [*draw, str(seed)])
    record["planted"] = plant
    effects = [word for text in plant["effects"] for word in ("--effect", text)]
    played = ("robot.yaml", "motions.h5", "-o", "measured.h5", "--seed", str(seed), "--overwrite")
    steps.excite("simulate", *played, *effects)
    record["diagnosis"] = judged(steps.excite("diagnose", "robot.yaml", "measured.h5"), plant)


def judged(answer: dict[str, Any], plant: dict[str, Any]) -> Record:
    """What was named, and whether that is the planted effect alone."""
    told = answer_of_json(answer)
    friction = "declared" if plant["friction"] else "none"
    result = score(Truth([plant_of_record(plant)], plant["moved"], friction), told)
    return {
        "named": [_words(each.called.name) for each in told.named],
        "verdicts": list(result.names),
        "right": result.right,
        "alone": result.right and _is_alone(result.names),
        "wrong": result.wrong,
        "detected": result.detected,
        "sentence": answer["answer"],
        "before": answer["error"]["before"]["mean_relative_moving"],
        "after": answer["error"]["after"]["mean_relative_moving"],
    }


def _is_alone(verdicts: tuple[str, ...]) -> bool:
    """Whether nothing but the planted effect is named: once, or as the parts that it is made of."""
    once = sum(name in ("true", "alias") for name in verdicts) <= 1
    return once and all(name in _GOOD for name in verdicts)


def _words(name: Name) -> str:
    return f"{name.kind} of {', '.join(name.joints)}"


def _ignored(config: Path) -> int:
    """Number of pairs of links that the proposed config leaves out."""
    from excite_cli.config.load_spec import load_spec

    own = load_spec(config).constraints.self_collision
    return 0 if own is None else len(own.ignore)
