"""What a confined process can no longer do, tried in one of its own."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

TRY = """
import json, os, socket, subprocess, sys
from pathlib import Path
from excite_cli.robot.confinement import confine
own, made, other = map(Path, sys.argv[1:])
ways = {
    "read own": lambda: (own / "f").read_text(),
    "write made": lambda: (made / "g").write_text("x"),
    "import late": lambda: __import__("xml.dom.minidom"),
    "read other": lambda: (other / "f").read_text(),
    "read by a link": lambda: (own / "link").read_text(),
    "list other": lambda: os.listdir(other),
    "write own": lambda: (own / "g").write_text("x"),
    "remove own": lambda: (own / "f").unlink(),
    "read the environment": lambda: Path("/proc/self/environ").read_bytes(),
    "TCP": lambda: socket.socket(),
    "UDP": lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM),
    "local socket": lambda: socket.socket(socket.AF_UNIX),
    "a program": lambda: subprocess.run([sys.executable, "-V"], check=True),
    "a shell": lambda: os.execv("/bin/sh", ["sh", "-c", "true"]),
}
lacking = confine([own], [made])
done = []
for name, way in ways.items():
    try:
        way()
        done.append(name)
    except OSError:
        pass
print(json.dumps([lacking, done]))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux can confine a process")
def test_a_confined_process_has_its_own_files_only(tmp_path: Path) -> None:
    folders = [tmp_path / name for name in ("own", "made", "other")]
    for folder in folders:
        folder.mkdir()
        (folder / "f").write_text("x")
    (folders[0] / "link").symlink_to(folders[2] / "f")
    run = subprocess.run(
        [sys.executable, "-c", TRY, *map(str, folders)], capture_output=True, check=True
    )
    lacking, done = json.loads(run.stdout)
    if any("files" in each for each in lacking):
        pytest.skip(f"this kernel cannot: {lacking}")
    if any("network" in each for each in lacking):
        done = [each for each in done if each not in ("UDP", "local socket")]
    assert done == ["read own", "write made", "import late"]
    assert (folders[0] / "f").exists()
