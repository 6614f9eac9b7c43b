"""Measured files and motions of others, read and checked."""
