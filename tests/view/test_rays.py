"""Rays that meet surfaces, and light."""

import sys

import numpy as np
import pytest

from excite_cli.errors import MissingExtraError
from excite_cli.view.rays import Tracer, embree_part
from excite_cli.view.studio import Lights
from excite_cli.view.surface import ball_profile, box_triangles, round_triangles, smooth_surface

pytest.importorskip("embreex")
BALL = smooth_surface(round_triangles(ball_profile(1.0, 0.0)))
BOX = smooth_surface(box_triangles(np.array([0.5, 0.5, 0.5]))).moved(
    np.eye(3), np.array([0.0, 5.0, 0.0])
)


def test_first_hits() -> None:
    tracer = Tracer([BALL, BOX], first_part=7)
    origins = np.array([[4.0, 0.3, 0.2], [4, 5, 0.1], [4, 9, 0], [-4, 0, 0]])
    directions = np.tile([-1.0, 0, 0], (4, 1))
    hits = tracer.first_hits(origins, directions)
    assert hits.part.tolist() == [7, 8, -1, -1]
    across = np.sqrt(1 - 0.13)
    np.testing.assert_allclose(hits.distance[:2], [4 - across, 3.5], atol=0.02)
    assert np.isinf(hits.distance[2:]).all()
    np.testing.assert_allclose(hits.normal[0], [across, 0.3, 0.2], atol=0.03)
    np.testing.assert_allclose(hits.normal[1], [1, 0, 0], atol=1e-6)
    # Normals are towards the eye on meshes inside out.
    turned = type(BOX)(BOX.points, -BOX.normals, BOX.faces[:, ::-1])
    hits = Tracer([turned]).first_hits(np.array([[4.0, 5, 0]]), directions[:1])
    np.testing.assert_allclose(hits.normal, [[1, 0, 0]], atol=1e-6)
    assert Tracer([]).first_hits(origins, directions).part.tolist() == [-1] * 4


def test_blocked_and_lit() -> None:
    """Open ground is fully lit and nooks are not."""
    origins = np.array([[0.0, 5, -3], [0, 5, 3], [0, 0, -3], [0, 8, 0]])
    up = np.array([0.0, 0, 1])
    assert Tracer([BALL, BOX]).blocked(origins, up).tolist() == [True, False, True, False]
    assert not Tracer([]).blocked(origins, up).any()
    lights, ball = Lights.beside(35.0, 6, 16), [Tracer([BALL])]
    far, below = np.array([[90.0, 0, -1.01]]), np.array([[0.0, 0, -1.01]])
    assert lights.on(far, up[None], ball, 1e-4) == pytest.approx(1.0)
    assert lights.on(below, up[None], ball, 1e-4) < 0.3


def test_a_missing_embree_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "embreex.rtcore_scene", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'excite-cli\[view\]'"):
        embree_part("rtcore_scene")
