"""Robots and motions in three dimensions."""
