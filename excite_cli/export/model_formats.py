"""Formats of identified models by the name on the command line, and the suffixes of their files."""

MODEL_FORMATS = {
    "urdf": ".urdf",
    "mjcf": ".xml",
    "yaml": ".yaml",
    "c": ".c",
    "randomization": "_randomization.json",
    "isaaclab": "_isaaclab.py",
    "mjlab": "_mjlab.py",
    "bam": "_bam.json",
}
OF_DRIVES = ("isaaclab", "mjlab", "bam")  # of robots that follow set points only
