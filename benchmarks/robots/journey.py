"""One robot through the commands as a user types them, each a process with a limit of time.

Between planning and simulating an effect is drawn that the config does not declare. What came of it
is a record of plain values, for a JSON file.
"""

import contextlib
import json
import os
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path
from threading import Timer
from typing import Any

from benchmarks.battery.scoring import Name, Truth, answer_of_json, plant_of_record, score
from benchmarks.robots.sources import Source

ROOT = Path(__file__).resolve().parents[2]
_LONGEST = 900.0  # [s] of one command
_PROGRAM = "from excite_cli.cli.app import main; main()"
_GOOD = ("true", "alias", "identity", "companion")

Record = dict[str, Any]


class EndedError(Exception):
    """A command ended otherwise than with exit status 0."""


class _Steps:
    """Runs commands in a robot's folder, and keeps what the record says about them."""

    def __init__(self, folder: Path, record: Record) -> None:
        self.folder, self.record = folder, record

    def excite(self, verb: str, *arguments: str | Path) -> Any:
        words = ("-c", _PROGRAM, verb, *map(str, arguments), "--json")
        return self.run(verb, words)

    def run(self, step: str, words: tuple[str, ...]) -> Any:
        status, answer, message, seconds = self._ran(words)
        self.record["seconds"][step] = round(seconds, 1)
        if status != 0 and not (step == "diagnose" and status == 1 and answer is not None):
            self.record.update(failed=step, exit_status=status, message=message)
            raise EndedError
        return answer

    def _ran(self, words: tuple[str, ...]) -> tuple[int, Any, str, float]:
        """Exit status, answer, last message and processor seconds."""
        own = {
            "OPENBLAS_NUM_THREADS": "1",
            "PYTHONPATH": str(ROOT),
            "XDG_CACHE_HOME": str(self.folder / "cache"),  # empty: the first `init` is measured
        }
        with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
            process = subprocess.Popen(
                [sys.executable, "-P", *words],
                cwd=self.folder,
                env={**os.environ, **own},
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=err,
            )
            timer = Timer(_LONGEST, process.kill)
            timer.start()
            _, status, used = os.wait4(process.pid, 0)
            timer.cancel()
            process.returncode = os.waitstatus_to_exitcode(status)
            out.seek(0)
            err.seek(0)
            answer, told = out.read(), err.read()
        seconds = used.ru_utime + used.ru_stime
        if process.returncode < 0:
            killed = f"it took longer than {_LONGEST:g} s"
            message = killed if process.returncode == -9 else f"signal {-process.returncode}"
            return process.returncode, None, message, seconds
        given = json.loads(answer) if answer.strip() else None
        return process.returncode, given, _message(told), seconds


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
    proposal = steps.excite(
        "init", *source.given, "-o", "robot.yaml", "--allow-found", "--overwrite"
    )
    record["joints"] = len(proposal["joints"])
    record["base_parameters"] = proposal["base_parameters"]
    record["ignored_pairs"] = _ignored(steps.folder / "robot.yaml")
    plan = ("optimize", "robot.yaml", "-o", "motions.h5", "--overwrite", "--no-progress")
    last = steps.excite(*plan)["motions"][-1]
    record["condition_number"] = last["stacked_condition_number"]
    record["proved"] = all(last["certified"].values())
    steps.excite("check", "robot.yaml", "motions.h5")
    record["admissible"] = True
    draw = ("-m", "benchmarks.robots.planting", "robot.yaml", "motions.h5", str(seed))
    plant = steps.run("draw", draw)
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
    from excite_cli.config.load import load_spec

    own = load_spec(config).constraints.self_collision
    return 0 if own is None else len(own.ignore)
