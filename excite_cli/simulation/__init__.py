"""Motions played on a MuJoCo robot that differs from its model."""
