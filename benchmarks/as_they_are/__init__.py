"""Robots as they are: geared arms with few and plain recordings, and what is said of them."""
