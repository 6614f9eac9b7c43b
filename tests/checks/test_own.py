"""A check of one's own, as docs/how-to/check.md writes it."""

import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excite_cli.checks.all_checks import look, rows_in_order
from excite_cli.checks.catalogue import CHECKS
from excite_cli.config.load_spec import load_spec
from excite_cli.identification.prepare import prepare_all
from excite_cli.identification.processing import choose_processing
from tests.effects import own_package
from tests.registries import read_anew
from tests.simulation.arms import arm, played

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "check.md"
SPEC = load_spec(Path(__file__).parents[2] / "configs" / "ur10.yaml")


def block(language: str) -> str:
    (found,) = re.findall(rf"```{language}\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    return str(found)


_read_anew = read_anew(CHECKS)


@pytest.mark.long
def test_the_check_of_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    points = tomllib.loads(block("toml"))["project"]["entry-points"][CHECKS.group]
    own_package.install(tmp_path, block("python"), points, monkeypatch, "my_checks", CHECKS.group)
    robot = arm()
    (run,) = played(robot, torque_noise=0.01).dataset.runs
    processing = choose_processing([run], SPEC.measurement.filter)
    for low, told in ((47.0, []), (41.0, ["the supply sagged to 41 V in"])):
        runs = [replace(run, extra={"voltage": np.linspace(low, 48.0, len(run.t))})]
        found = look(robot, runs, prepare_all(runs, processing), SPEC)
        assert [each.evidence[: len("the supply sagged to 41 V in")] for each in found] == told
        row = next(e for e in rows_in_order(found, True, SPEC) if e.name == "voltage of the supply")
        assert row.status == ("fault" if told else "ok")
