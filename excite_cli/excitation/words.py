"""What a search tells, in words."""

from excite_cli.excitation.progress import Figure, Measure


def figure_in_words(figure: Figure) -> str:
    """What is improved, briefly: `cond 5.48`."""
    if figure.measure is Measure.CONDITION_NUMBER:
        return f"cond {figure.value:.2f}"
    if figure.measure is Measure.TORQUE_DEVIATION:
        return f"torque to {figure.value:.3g} of a sample's noise"
    return f"divergence {figure.value:.3g}"
