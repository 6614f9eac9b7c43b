"""YAML files, checked at the door: one class for each section."""
