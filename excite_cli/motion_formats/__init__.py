"""Formats of motions for controllers: each is read and written."""
