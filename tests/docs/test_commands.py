"""Every command of the documentation runs, page by page, as a reader would type it.

Planning is cut short by options that are appended; a command that another page runs too, on the
same files, is run once.
"""

import hashlib
import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.program import ROOT, Program, environment
from tests.docs.console import Command, Page, read_page, words_of
from tests.docs.samples import Samples

_BRIEF = ("--set", "optimizer.max_iterations=3", "--set", "optimizer.restarts=1")
SHORTER: dict[str, tuple[str, ...]] = {
    "optimize": _BRIEF,
    "compare-random": (*_BRIEF, "--candidates", "10"),
    "study": _BRIEF,
    "simulate": ("--rate", "200"),
    "check": ("--rate", "50"),
}
# Of what a shell does only this is not left to it: quotes, which shlex undoes as well.
SHELL = set("&|;<>$*?`(){}~")
# Four motions of ten seconds would be simulated for as long as all the rest takes.
BRIEF_UR10 = (
    *("--motions", "2", "--set", "trajectory.base_frequency=1.57"),
    *("--set", "sampling.cost={samples: 40}"),
    *("--set", "sampling.constraints={samples: 100}"),
)
# Tables of TALOS' meshes take minutes to make.
WITHOUT_MESHES = ("--set", "constraints.self_collision=null")
PAGES = [read_page(path) for path in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")))]
WITH_COMMANDS = [page for page in PAGES if page.commands]


class Shared:
    """What commands wrote, so that the same command on the same files is run once."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._cache = folder / "cache"
        self._written: dict[str, Path] = {}

    def run(self, command: Command, folder: Path) -> None:
        """Run it in `folder`, or bring what it wrote before; its exit status is the stated one."""
        before = _contents(folder)
        key = _key(command, before)
        if key in self._written:
            shutil.copytree(self._written[key], folder, dirs_exist_ok=True)
            return
        done = self._done(command, folder)
        told = f"{command.line}\n(line {command.number}) ended with {done.returncode}, not "
        assert done.returncode == command.status, f"{told}{command.status}:\n{done.stderr[-2000:]}"
        self._keep(key, before, folder)

    def _done(self, command: Command, folder: Path) -> subprocess.CompletedProcess[str]:
        line = shortened(command.line)
        words = words_of(line)
        if words[0] == "excite" and not SHELL & set(command.line):
            return Program(folder, self._cache)(*words[1:])
        programs = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', os.defpath)}"
        return subprocess.run(
            ["/bin/bash", "-c", line],
            cwd=folder,
            env={**environment(self._cache), "PATH": programs},
            capture_output=True,
            text=True,
            stdin=subprocess.DEVNULL,
            timeout=180,
            check=False,
        )

    def _keep(self, key: str, before: dict[str, str], folder: Path) -> None:
        """Keep the files that are new or others than before."""
        target = self.folder / f"written_{len(self._written)}"
        target.mkdir()
        for name, content in _contents(folder).items():
            if before.get(name) != content:
                (target / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(folder / name, target / name)
        self._written[key] = target


def shortened(line: str) -> str:
    """The command with options that make it quick."""
    line = line.partition("  #")[0]
    words = words_of(line)
    if "excite" not in words:
        return line
    at = words.index("excite")
    command = words[at + 1]
    more = SHORTER.get(command, ())
    if "ur10.yaml" in line and command == "optimize":
        more = (*more, *BRIEF_UR10)
    if "talos" in line and command in ("optimize", "check", "compare-random"):
        more = (*more, *WITHOUT_MESHES)
    if not more:
        return line
    # Before what a shell does with the command.
    ends = [line.index(mark) for mark in (" & ", " | ", " > ") if mark in line]
    end = min(ends, default=len(line))
    return f"{line[:end]} {shlex.join(more)}{line[end:]}"


def _contents(folder: Path) -> dict[str, str]:
    """Hash of every file, by its name in `folder`."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def _key(command: Command, contents: dict[str, str]) -> str:
    """The command and all files that it names; configs may name others, so these count whole."""
    named = [
        f"{name}={content}"
        for name, content in contents.items()
        if name in command.line or name.endswith((".yaml", ".urdf"))
    ]
    return "\n".join([command.line, *named])


@pytest.fixture(scope="module")
def samples(tmp_path_factory: pytest.TempPathFactory) -> Samples:
    return Samples(tmp_path_factory.mktemp("samples"))


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Shared:
    return Shared(tmp_path_factory.mktemp("shared"))


@pytest.mark.parametrize("page", WITH_COMMANDS, ids=lambda p: str(p.path.relative_to(ROOT)))
def test_commands_of_a_page(page: Page, samples: Samples, shared: Shared, tmp_path: Path) -> None:
    for name in page.needs:
        samples.put(name, tmp_path)
    for command in page.commands:
        shared.run(command, tmp_path)


def test_the_pages_that_matter_have_commands() -> None:
    names = {str(page.path.relative_to(ROOT)) for page in WITH_COMMANDS}
    assert {"README.md", "docs/tutorial.md", "docs/results.md", "docs/problem.md"} <= names
    assert {"docs/how-to/robot.md", "docs/how-to/data.md"} <= names
    assert sum(len(page.commands) for page in WITH_COMMANDS) > 30


def test_a_page_is_read_as_it_is_written(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "<!-- needs: arm.yaml data/ -->\n<!-- first: excite schema -->\n```console\n"
        "$ git clone x\n$ excite check a.yaml \\\n  b.h5  # why\noutput\n```\n<!-- status: 1 -->\n"
        "```sh\nexcite robots\n# a remark\n```\n<!-- not run: no clone -->\n```sh\nexcite x\n```\n"
        "```yaml\nexcite: y\n```\n",
        encoding="utf-8",
    )
    found = read_page(page)
    assert found.needs == ("arm.yaml", "data/")
    lines = [(each.line, each.status) for each in found.commands]
    assert lines == [
        ("excite schema", 0),
        ("excite check a.yaml b.h5  # why", 0),
        ("excite robots", 1),
    ]
