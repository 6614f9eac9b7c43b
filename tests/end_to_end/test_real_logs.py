"""Real robots, from the rigid-body model alone: what each lacks is found by the installed program.

Figures are those of the logs' authors: data sheets, publications, and fits with the effects known.
"""

import re
import shutil
from pathlib import Path
from typing import Any

import pytest

from benchmarks.real_robots import percent
from docs.gallery_page import escaped
from docs.make_gallery import written
from excite_cli.diagnosis.words import title_of
from tests.cli.program import ROOT, Installed
from tests.docs.test_links import broken

DATA = ROOT / "data"


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Runs `excite diagnose --json` on a log with the config beside it: the URDF alone."""
    folder = tmp_path_factory.mktemp("logs")
    program = Installed(folder, folder / "cache")
    known: dict[tuple[str, ...], Any] = {}

    def run(robot: str, file: str, *options: str) -> Any:
        key = (robot, file, *options)
        if key not in known:
            config = DATA / robot / f"{robot}.yaml"
            output = ("-o", folder / f"{len(known)}.h5")
            known[key] = program.answer("diagnose", config, DATA / robot / file, *options, *output)
        return known[key]

    return run


def named(answer: Any, kind: str, among: str = "effects") -> dict[tuple[str, ...], Any]:
    return {tuple(e["joints"]): e["parameters"] for e in answer[among] if e["kind"] == kind}


class TestTx40:
    """Published: f_v and f_s of each joint, and the coupled friction of the wrist's motors."""

    VISCOUS = (8.05, 5.53, 1.97, 1.11, 1.86, 0.65)
    COULOMB = (7.14, 8.26, 6.34, 2.48, 3.03)

    def test_error_and_friction_as_published(self, diagnosed: Any) -> None:
        answer = diagnosed("tx40", "tx40.h5")
        assert answer["error"]["before"]["mean_relative_moving"] > 0.9
        assert answer["error"]["after"]["mean_relative_moving"] <= 0.10
        lines = {line["joint"]: line for line in answer["friction_lines"]}
        for name, values in (("viscous", self.VISCOUS), ("coulomb", self.COULOMB)):
            for k, value in enumerate(values):
                found = lines[f"joint_{k + 1}"][name]["value"]
                assert found == pytest.approx(value, rel=0.1)
        sure = [e["joints"] for e in answer["effects"]
                if e["kind"] == "coupled_friction" and e["verdict"] == "confirmed"]  # fmt: skip
        assert sure == [["joint_5", "joint_6"]]
        found = named(answer, "coupled_friction")["joint_5", "joint_6"]
        assert found["viscous"]["value"] == pytest.approx(0.616, rel=0.1)
        assert found["coulomb"]["value"] == pytest.approx(1.95, rel=0.1)

    def test_its_page_of_the_gallery_says_what_the_answer_says(
        self, diagnosed: Any, tmp_path: Path
    ) -> None:
        answer = diagnosed("tx40", "tx40.h5")
        shutil.copy(answer["output"]["diagnosis"], tmp_path / "tx40-1.h5")
        rows = written("tx40", tmp_path, tmp_path / "pages")
        page = tmp_path / "pages" / "tx40.md"
        text = page.read_text(encoding="utf-8")
        before, textbook, after = (
            answer["error"][which] for which in ("before", "textbook", "after")
        )
        for joint, share in after["relative_moving"].items():
            row = rf"^\| {joint} \| \S+ \| (\S+) \| (\S+) \| (\S+) \|"
            (cells,) = re.findall(row, text, re.MULTILINE)
            shares = (each["relative_moving"][joint] for each in (before, textbook, after))
            assert cells == tuple(f"{each:.2%}" for each in shares)
            assert f"- **{joint}**: {share:.1%} of its torque is left where it moves." in text
        assert rows[0][1:3] == tuple(percent(e["mean_relative_moving"]) for e in (before, after))
        told = re.findall(r"^\| ([^|]+) \| ([\w, ]+) \| ", text, re.MULTILINE)
        lines = answer["friction_lines"]
        rubbing = {
            (kind, line["joint"]) for line in lines if line["verdict"] for kind in line["kinds"]
        }
        assert rubbing
        for effect in answer["effects"]:
            every = len(effect["joints"]) == len(after["relative_moving"])
            where = "all joints" if every else ", ".join(effect["joints"])
            rubs = (effect["kind"], where) in rubbing
            title = "friction" if rubs else title_of(effect["kind"])
            joints = r"((?:joint_\d(?:, (?=joint_\d))?)+|all joints)"
            small = re.findall(rf"\b{re.escape(title)} on {joints}", text)
            assert (title, where) in told or where in small
        for finding in answer["findings"]:
            assert escaped(f"{finding['severity']}: {finding['text']}") in text
        assert len(list(page.parent.glob("tx40-1-*.png"))) == text.count("](tx40-1-") == 5
        assert broken(page) == []


class TestUr10:
    """Straight from the bag: offsets of the wrist's torques; friction that saturates with speed."""

    BAG = "ur10_exciting_trajectory.db3"

    def test_error_and_names(self, diagnosed: Any) -> None:
        answer = diagnosed("ur10_cb", self.BAG)
        error = answer["error"]
        assert error["before"]["mean_relative_moving"] > 0.75
        assert error["after"]["mean_relative_moving"] <= 0.07
        assert error["after"]["mean_relative_moving"] < error["textbook"]["mean_relative_moving"]
        offsets = {joint for (joint,) in named(answer, "torque_offset")}
        assert {"wrist_1_joint", "wrist_2_joint", "wrist_3_joint"} <= offsets
        curved = "nonlinear_viscous_friction"  # by a name, or as what comes near it
        both = named(answer, curved) | named(answer, curved, "approximations")
        assert both[("shoulder_pan_joint",)]["power"]["value"] < 1


class TestKr300:
    """A hydraulic spring on axis 2; armatures of the data sheet on axes 2 and 3."""

    CAD = ("--set", "identification.inertias=cad")

    @pytest.mark.parametrize("held_out", ["A", "C"])
    def test_better_than_the_textbook(self, diagnosed: Any, held_out: str) -> None:
        """Without a word on inertias: the spring is found all the same."""
        error = diagnosed("kr300", "kr300.h5", "--held-out", held_out)["error"]
        assert error["after"]["mean_relative_moving"] < 0.06
        textbook = error["textbook"]["mean_relative_moving"]
        assert error["after"]["mean_relative_moving"] < 1.02 * textbook

    def test_names(self, diagnosed: Any) -> None:
        answer = diagnosed("kr300", "kr300.h5", "--held-out", "C")
        lines = {each["joint"]: each for each in answer["friction_lines"]}
        assert sorted(lines) == [f"axis_{k}" for k in range(1, 7)]
        for each in lines.values():
            for size in (each["viscous"], each["coulomb"]):
                assert size["value"] > 4 * size["std"]
        assert ("axis_3",) in named(answer, "armature")
        assert ("axis_2",) in named(answer, "spring")

    @pytest.mark.parametrize("held_out", ["A", "B", "C"])
    def test_kept_inertias(self, diagnosed: Any, held_out: str) -> None:
        answer = diagnosed("kr300", "kr300.h5", "--held-out", held_out, *self.CAD)
        assert answer["error"]["after"]["relative_moving"]["axis_2"] < 0.07
        stiffness = named(answer, "spring")[("axis_2",)]["stiffness"]["value"]
        assert stiffness == pytest.approx(7000, rel=0.1)
        armature = named(answer, "armature")
        assert armature[("axis_2",)]["inertia"]["value"] == pytest.approx(844, rel=0.1)
        assert armature[("axis_3",)]["inertia"]["value"] == pytest.approx(751, rel=0.1)
