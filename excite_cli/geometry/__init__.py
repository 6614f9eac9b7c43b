"""Capsules, pairs of links, meshes and obstacles, and the distances between them."""
