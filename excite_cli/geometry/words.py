"""Pairs that are not checked, in words, the same ones wherever they are reported."""

from excite_cli.geometry.reasons import DroppedPair, Reason, Standing, Why

_WHY = {
    Why.SAME_BODY: "same body",
    Why.IGNORED: "ignored in the config",
    Why.BY_MESHES: "checked by their meshes, as configured",
    Why.ADJACENT: "adjacent",
    Why.NEVER_NEAR: "never near",
    Why.MESHES_NEVER_NEAR: "meshes never near",
    Why.ALWAYS_TOUCHING: "always in contact",
    Why.ALWAYS_NEAR: "always nearer than the margin",
    Why.UNGUARDED: "unguarded: capsules always overlap",
    Why.OUT_OF_REACH: "out of reach",
}
_STANDING = {
    Standing.JUDGED: "",
    Standing.ALWAYS_TOUCHING: "always in contact",
    Standing.AT_POSTURE: "in contact at the posture",
    Standing.BY_HAND: "capsule given by hand",
}


def why_in_words(why: Why) -> str:
    """A kind of reason, without figures."""
    return _WHY[why]


def standing_in_words(standing: Standing) -> str:
    """Why contact of two meshes breaks nothing; empty where it does."""
    return _STANDING[standing]


def reason_in_words(reason: Reason) -> str:
    """A reason with its figures: `never near (at least 0.12 m found)`."""
    figures = []
    if reason.distance is not None:
        figures = [_FIGURES[reason.why].format(reason.distance)]
    if reason.apart:
        links = (f"{each.first} – {each.second} {each.percent}%" for each in reason.apart)
        figures.append(f"meshes separated: {', '.join(links)}")
    return why_in_words(reason.why) + (f" ({'; '.join(figures)})" if figures else "")


_FIGURES = {
    Why.NEVER_NEAR: "at least {:.2f} m found",
    Why.MESHES_NEVER_NEAR: "at least {:.3f} m found",
    Why.ALWAYS_TOUCHING: "up to {:.3f} m deep",
    Why.UNGUARDED: "up to {:.3f} m deep",
    Why.ALWAYS_NEAR: "distance at least {:.3f} m",
}


def dropped_in_words(pair: DroppedPair) -> str:
    """`upper_arm – base: adjacent`."""
    return f"{pair.first} – {pair.second}: {reason_in_words(pair.reason)}"
