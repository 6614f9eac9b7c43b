"""URDFs and meshes made to read other files, to fill memory, to take for ever or to crash."""

import struct
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from benchmarks.trust.robot_files import VALID, binary_stl
from excite_cli.config.robot_spec import RobotSpec
from excite_cli.errors import RobotError
from excite_cli.geometry.link_meshes import link_meshes
from excite_cli.robot import mesh_trial
from excite_cli.robot.description import load_description
from excite_cli.robot.mesh_paths import check_mesh_paths
from excite_cli.robot.mesh_trial import faults
from excite_cli.robot.model import build_robot
from excite_cli.robot.urdf_check import MAX_DEPTH, MAX_LINKS, MAX_MOVABLE
from tests.robot.test_messages import joint, link, mesh, urdf
from tests.trust.refusals import refused

BOMB = '<!ENTITY a "aaaaaaaaaa">' + "".join(
    f'<!ENTITY {chr(98 + k)} "{f"&{chr(97 + k)};" * 10}">' for k in range(9)
)
# Faces that name a corner that there is not: what reads them in this process takes it down.
CRASHING = VALID["ply"].replace(b"3 0 2 1", b"3 0 1000000000000000000000000000000 1")


def built(path: Path) -> None:
    link_meshes(build_robot(RobotSpec(urdf=str(path)), path.parent))


def hostile(folder: Path, text: str) -> Path:
    path = folder / "arm.urdf"
    path.write_text(text, encoding="utf-8")
    return path


def stl(path: Path, mark: bytes) -> Path:
    """A good mesh that no other test has."""
    path.write_bytes(mark + binary_stl()[4:])
    return path


def chain(links: int, kind: str) -> str:
    parts = "".join(link(f"l{k}") for k in range(links))
    joints = "".join(joint(f"j{k}", f"l{k}", f"l{k + 1}", kind) for k in range(links - 1))
    return f'<robot name="c">{parts}{joints}</robot>'


ISLAND = link("x") + link("y") + joint("a", "x", "y") + joint("b", "y", "x")


def beside(more: str) -> str:
    """The arm, with more in it."""
    return urdf().replace("</robot>", f"{more}</robot>")


HOSTILE = {
    "billion laughs": (f"<!DOCTYPE robot [{BOMB}]><robot>&j;</robot>", "entities"),
    "external entity": (
        '<!DOCTYPE r [<!ENTITY e SYSTEM "file:///etc/passwd">]><robot>&e;</robot>',
        "entities",
    ),
    "depth": (
        "<robot>" + "<link name='a'>" * 5000 + "</link>" * 5000 + "</robot>",
        f"{MAX_DEPTH} lev",
    ),
    "elements": ("<robot>" + "<link/>" * 250_000 + "</robot>", "too large"),
    "links": (chain(MAX_LINKS + 1, "fixed"), f"up to {MAX_LINKS:,} links"),
    "joints": (chain(MAX_MOVABLE + 2, "revolute"), f"{MAX_MOVABLE} movable joints"),
    "cycle": (beside(joint("back", "hand", "base")), "no first link"),
    "loop": (beside(joint("twin", "base", "hand")), "two joints lead"),
    "twin joints": (
        urdf().replace('name="wrist"', 'name="elbow"'),
        "two joints are called 'elbow'",
    ),
    "far": (urdf().replace('xyz="0 0 0.5"', 'xyz="0 0 1e300"', 1), "not three numbers"),
    "nan": (urdf().replace('xyz="0 0 0.5"', 'xyz="0 nan 0"', 1), "not three numbers"),
    "axis": (urdf().replace('xyz="0 1 0"', 'xyz="1e308 1e308 0"', 1), "has the axis"),
    "turn": (urdf().replace("<origin ", '<origin rpy="inf 0 0" ', 1), "<origin rpy"),
    **{
        f"mass {each}": (
            urdf().replace('mass value="1"', f'mass value="{each}"', 1),
            "a mass not negative",
        )
        for each in ("-1", "nan", "1e300", "heavy")
    },
    "inertia": (urdf().replace('ixx="0.1"', 'ixx="nan"', 1), "finite numbers"),
    "radius": (urdf().replace('radius="0.05"', 'radius="-1"', 1), "not a number"),
    "island": (beside(ISLAND), "go round in a circle"),
}


@pytest.mark.parametrize(("text", "word"), HOSTILE.values(), ids=HOSTILE)
def test_urdf(text: str, word: str, tmp_path: Path) -> None:
    assert word in refused(built, hostile(tmp_path, text))


@pytest.mark.parametrize("target", ["/etc/passwd", "/dev/zero", "hand.stl", "none"])
def test_symbolic_links(target: str, tmp_path: Path) -> None:
    (tmp_path / "hand.stl").symlink_to(target)
    message = refused(built, hostile(tmp_path, urdf(collision=mesh("hand.stl"))))
    assert "leaves the robot's own folders" in message or "was not found" in message


@pytest.mark.parametrize("name", ["a" * 5000 + ".stl", "a\t.stl", ".", ""])
def test_names_that_no_file_has(name: str, tmp_path: Path) -> None:
    message = refused(built, hostile(tmp_path, urdf(collision=mesh(name))))
    assert "was not found" in message
    assert len(message) < 1000


NOT_FINITE = struct.pack("<12fH", *[float("nan")] * 12, 0)
MESHES = {
    "4e9 triangles": ("stl", binary_stl(2**32 - 1), "cannot be loaded"),
    "cut": ("stl", binary_stl()[:100], "cannot be loaded"),
    "empty": ("stl", b"", "cannot be loaded"),
    "crash": ("ply", CRASHING, "reading it fails"),
    "claims": ("dae", VALID["dae"].replace(b'count="4"', b'count="99999999999"'), "cannot be load"),
    "format": ("blend", VALID["stl"], "of no known format"),
    "nan": ("stl", binary_stl()[:84] + NOT_FINITE * 4, "not finite"),
}


@pytest.mark.parametrize(("suffix", "data", "word"), MESHES.values(), ids=MESHES)
def test_meshes(suffix: str, data: bytes, word: str, tmp_path: Path) -> None:
    (tmp_path / f"hand.{suffix}").write_bytes(data)
    path = hostile(tmp_path, urdf(collision=mesh(f"hand.{suffix}")))
    message = refused(built, path)
    assert word in message
    assert f"hand.{suffix}" in message


def test_a_crashing_mesh_that_is_only_seen_is_refused_too(tmp_path: Path) -> None:
    (tmp_path / "hand.ply").write_bytes(CRASHING)
    shape = mesh("hand.ply").replace("collision", "visual")
    path = hostile(tmp_path, urdf().replace(link("hand"), link("hand", shape)))
    with pytest.raises(RobotError, match="reading it fails"):
        check_mesh_paths(load_description(str(path)), "visual")


def test_good_meshes_are_read(tmp_path: Path) -> None:
    for suffix, data in VALID.items():
        (tmp_path / f"hand.{suffix}").write_bytes(data)
        built(hostile(tmp_path, urdf(collision=mesh(f"hand.{suffix}"))))


def test_a_slow_mesh_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With no time at all, the process is ended, and says so."""
    path = stl(tmp_path / "hand.stl", b"slow")
    mesh_trial._trial.close()
    monkeypatch.setattr(mesh_trial, "_SLOWEST", 1e-6)
    assert "takes too long" in faults([path], [tmp_path])[path]


def test_what_lies_in_the_current_folder_is_not_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "json.py").write_text("open('ran', 'w')\nraise SystemExit(3)\n", encoding="utf-8")
    mesh_trial._trial.close()
    monkeypatch.chdir(tmp_path)
    assert not faults([stl(tmp_path / "hand.stl", b"here")], [tmp_path])
    assert not (tmp_path / "ran").exists()


def test_after_an_interruption_the_next_answer_is_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    good, bad = stl(tmp_path / "good.stl", b"good"), tmp_path / "bad.stl"
    bad.write_bytes(binary_stl()[:100] + b"bad")
    assert not faults([good], [tmp_path])
    process = mesh_trial._trial._process
    assert process is not None
    read = process.stdout

    def interrupted() -> bytes:
        raise KeyboardInterrupt

    monkeypatch.setattr(process, "stdout", SimpleNamespace(readline=interrupted, close=read.close))
    with pytest.raises(KeyboardInterrupt):
        mesh_trial._trial.reading(bad, [str(tmp_path)])
    monkeypatch.setattr(process, "stdout", read)
    assert mesh_trial._trial.reading(good, [str(tmp_path)]).fault == ""
    assert process.poll() is not None


@pytest.mark.skipif(not Path("/proc/self/limits").exists(), reason="Linux tells the limits so")
def test_what_is_loaded_already_does_not_count_to_the_memory_of_meshes(tmp_path: Path) -> None:
    """Threads of linear algebra reserve tens of MiB each: as many as there are cores."""
    assert not faults([stl(tmp_path / "hand.stl", b"room")], [tmp_path])
    process = mesh_trial._trial._process
    assert process is not None
    limits = Path(f"/proc/{process.pid}/limits").read_text(encoding="ascii")
    line = next(line for line in limits.splitlines() if line.startswith("Max address space"))
    assert int(line.split()[3]) > 2 * mesh_trial._MAX_MEMORY + 2**26
    assert b"OPENBLAS_NUM_THREADS=1\0" in Path(f"/proc/{process.pid}/environ").read_bytes()


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="Linux tells the peak so")
def test_a_script_with_a_large_array_can_read_meshes(tmp_path: Path) -> None:
    """A process begins with the peak memory of the one that started it, by one of two counts."""
    stl(tmp_path / "palm.stl", b"room")
    script = (
        "import sys\n"
        "from pathlib import Path\n"
        "from excite_cli.robot import mesh_trial\n"
        "full = bytearray(mesh_trial._MAX_MEMORY + 2**26)\n"
        "full[::4096] = bytes([1]) * len(full[::4096])\n"
        "del full\n"
        "folder = Path(sys.argv[1])\n"
        "print(mesh_trial.faults([folder / 'palm.stl'], [folder]))\n"
    )
    run = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path)], capture_output=True, text=True, check=True
    )
    assert run.stdout.strip() == "{}"
