"""Formats of identified models by the name on the command line, and the suffixes of their files."""

MODEL_FORMATS = {"urdf": ".urdf", "mjcf": ".xml", "yaml": ".yaml", "c": ".c"}
