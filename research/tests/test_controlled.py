# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A lamp at the camera, divided out of frames of an egg whose paint is known; and the table of the gap to a controlled
capture."""

import json

import numpy as np
import pytest

pytest.importorskip("flip_evaluator")

from core.capture.capture import Capture  # noqa: E402
from core.face.head import Head  # noqa: E402
from core.geometry import meshes, raster
from core.geometry.views import read_views  # noqa: E402
from core.imaging import images  # noqa: E402
from research.benchmarks.light import (
    flash_light,  # noqa: E402
)
from tests.fixtures import photographed_head  # noqa: E402
from tests.fixtures.egg import egg  # noqa: E402

ROUGHNESS, F0 = 0.5, 0.04


def microfacets(normal, light, view) -> np.ndarray:
    """GGX with height-correlated masking over Lambert's 1 / pi, for a reflectance of 1 at every angle (Heitz 2014,
    equations 71 and 99)."""
    half = light + view
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    nl, nv, nh = (np.maximum((normal * v).sum(-1), 1e-3) for v in (light, view, half))
    a2 = ROUGHNESS**4
    shadowing = 2 * nl * nv / (nv * np.sqrt(a2 + (1 - a2) * nl**2) + nl * np.sqrt(a2 + (1 - a2) * nv**2))
    return np.pi * a2 / (np.pi * (nh**2 * (a2 - 1) + 1) ** 2) * shadowing / (4 * nl * nv)


@pytest.fixture(scope="module")
def dark_room(tmp_path_factory):
    """A capture with the lamp at each camera; its head; per frame the true albedo, linear [H, W, 3], and where it is
    judged."""
    capture, mesh, paint = Capture(tmp_path_factory.mktemp("egg")), egg(40, 28), photographed_head.skin(256)
    azimuths = (-36, -12, 12, 36)
    names = [f"{i:05d}.jpg" for i in range(len(azimuths))]
    capture.frames.mkdir(parents=True)
    records = [
        {"name": n, "video_frame": i, "time_s": i, "sharpness": 1.0, "selected": True} for i, n in enumerate(names)
    ]
    capture.frames_json.write_text(json.dumps({"frames": records}))
    photographed_head.write_cameras(capture.cameras, names, azimuths, 0.42, 0.05)
    caster, true = raster.RayCaster(mesh), []
    for view in read_views(capture):
        face, bary, distance = raster.render_view(caster, view)
        hit, albedo = face >= 0, photographed_head.photograph(caster, view, paint, 1)
        normal = raster.interpolate(meshes.vertex_normals(mesh), mesh.faces, face, bary)
        normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-9)
        towards = view.centre - raster.interpolate(mesh.vertices, mesh.faces, face, bary)
        towards /= np.linalg.norm(towards, axis=-1, keepdims=True)
        cosine = np.clip((normal * towards).sum(-1), 0, 1)
        light = 0.12 / np.where(hit, distance, 1)[..., None] ** 2
        reflected = albedo + F0 * microfacets(normal, towards, towards)[..., None]
        seen = reflected * cosine[..., None] * light
        images.write_srgb(view.path, images.linear_to_srgb(np.where(hit[..., None], seen, 0)), quality=98)
        true.append((albedo, hit & (cosine > 0.35)))
    return capture, Head(mesh), true


def error(picture: np.ndarray, albedo: np.ndarray, where: np.ndarray) -> np.ndarray:
    """|log(picture / albedo)| of green at the pixels that are judged, but for one gain."""
    ratio = np.log(np.maximum(picture[where][:, 1], 1e-4) / albedo[where][:, 1])
    return np.abs(ratio - np.median(ratio))


def test_a_known_flash_leaves_the_albedo(dark_room, tmp_path, monkeypatch):
    capture, head, true = dark_room
    monkeypatch.setattr(flash_light, "read_head", lambda capture: head)
    monkeypatch.setattr(flash_light, "SIZE", 64)
    found = flash_light.write_delit(capture, tmp_path)
    assert found.roughness == ROUGHNESS
    middle, lit = found.strength[28:36, 30:34], F0 * 0.12  # the frames' exposure is part of their light
    assert np.median(middle) == pytest.approx(lit, rel=0.1)
    gains = []
    for view, (albedo, where) in zip(read_views(capture), true, strict=True):
        picture = images.read_linear((tmp_path / view.name).with_suffix(".png"))
        off, before = error(picture, albedo, where), error(images.read_linear(view.path), albedo, where)
        assert np.median(off) < 0.02 and np.percentile(off, 95) < 0.06 < 0.5 < np.percentile(before, 95)
        gains.append(np.median(np.log(picture[where] / albedo[where])))
    assert np.ptp(gains) < 0.01  # the frames share one exposure


def test_without_a_highlight_none_is_found(dark_room):
    (capture, head, true), frames = dark_room, []
    for view, (albedo, _) in zip(read_views(capture), true, strict=True):
        frame = flash_light.lit(view, albedo, head)
        frames.append(flash_light.lit(view, albedo * frame.shading[..., None], head))
    found = flash_light.highlight(frames, head.unfold(64))
    assert np.median(found.strength[24:40, 24:40]) < 0.1 * F0
