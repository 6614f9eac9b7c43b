"""Mistakes of set-up, found before any physics: one file for each."""
