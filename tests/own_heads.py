# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A head of another topology laid over the registered built-in head of one person, in fewer steps than the stage
takes."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from core.capture.capture import Capture
from core.capture.messages import Reporter
from core.face import template as built_in
from core.geometry import meshes
from core.geometry.meshes import Mesh
from core.settings.settings import from_json
from core.stages import registration
from core.stages.registration import own_mesh, own_template, render_landmarks


@cache
def person() -> tuple[Mesh, own_template.BuiltIn]:
    """The registered built-in head, and its model."""
    model = registration.load_model()
    vertices = model.shape(np.random.default_rng(5).normal(0, 0.7, len(model.identity))) * 1.03 + [0.01, 0.02, -0.03]
    return model.mesh.moved(vertices), own_template.BuiltIn(model, *registration.weights_of(model))


def lay_over(template: Path, folder: Path, steps: tuple[int, int] = (6, 3), **options) -> tuple[Capture, Reporter]:
    """The capture in `folder` with the fitted head, and what the stage reported. `steps`: of the fit, and of laying the
    built-in head over the template; `options` of the registration."""
    capture, report = Capture(folder), Reporter("registration")
    with pytest.MonkeyPatch.context() as patched:
        for name, value in zip(("ITERATIONS", "COVER_ITERATIONS"), steps, strict=True):
            patched.setattr(own_template, name, value)
        patched.setattr(render_landmarks, "VIEWS_DEG", render_landmarks.VIEWS_DEG[:5])
        settings = from_json({"registration": {"template": str(template), **options}, "transfer": {"size": 1024}})
        own_template.run(capture, settings, *person(), report)
    return capture, report


def check_fitted(path: Path, capture: Capture, report: Reporter, shapes: int, median: float, p95: float) -> None:
    """Holds what `lay_over` left against the artist's file; median and p95: most millimetres from the built-in head."""
    own = own_mesh.read(str(path), report)
    assert report.figures["own_shapes"] == shapes == len(own.shapes) and report.figures["own_uvs"] == "the artist's"
    assert report.figures["own_to_head_median_mm"] < median and report.figures["own_to_head_p95_mm"] < p95
    assert report.figures["own_flipped_triangles"] == 0

    def lines(path, kind):
        return [line.split()[1:] for line in path.read_text().splitlines() if line.startswith(kind)]

    assert lines(capture.own_head, "vt ") == lines(own.path, "vt "), "the artist's UVs to the letter"
    corners = [[corner.split("/")[:2] for corner in face] for face in lines(own.path, "f ")]
    assert [[corner.split("/") for corner in face] for face in lines(capture.own_head, "f ")] == corners, "and polygons"
    fitted = meshes.read_obj(capture.own_head).vertices
    middle = built_in.landmark_points(person()[0]).mean(0)
    assert fitted.shape == own.mesh.vertices.shape and np.linalg.norm(fitted - middle, axis=1).min() < 0.02
