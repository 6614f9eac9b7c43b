"""What moves and what only flickers, on positions made by hand."""

import numpy as np

from excite_cli.measurement.moving import moves

COUNT = 1e-3  # rad of the encoder


def test_counts_of_a_coarse_encoder_add_up_to_a_way_and_those_of_a_flicker_do_not() -> None:
    """Seven counts of the same way are within what noise can do, thirty are not."""
    k = np.arange(400)
    slow = COUNT * np.floor(k / 40)
    flicker = COUNT * (k % 7 < 3)
    assert moves(np.column_stack([slow, flicker]), 150, 250).tolist() == [False, False]
    fast = COUNT * np.floor(k / 10)
    assert moves(np.column_stack([fast, flicker]), 150, 250).tolist() == [True, False]


def test_steps_that_are_like_the_one_before_are_a_motion_and_noise_is_not() -> None:
    """Both as wide as a few of their steps: a slow wave, and noise."""
    k, rng = np.arange(400), np.random.default_rng(0)
    wave = np.sin(2 * np.pi * k / 15)
    noise = rng.normal(size=len(k))
    still = np.zeros(len(k))
    assert moves(np.column_stack([wave, noise, still]), 150, 250).tolist() == [True, False, False]


def test_of_one_sample_nothing_is_said() -> None:
    assert moves(np.zeros((1, 2)), 0, 1).tolist() == [False, False]
