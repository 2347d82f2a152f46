# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair that a parser sees is no skin: it leaves the texture, in all views what most of them show and in one what that
one shows, and it leaves the scan."""

from dataclasses import replace
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

pytest.importorskip("OpenImageIO")

from core.capture.messages import Reporter  # noqa: E402
from core.face import template  # noqa: E402
from core.face.head import Head  # noqa: E402
from core.geometry import meshes, raster  # noqa: E402
from core.imaging import images  # noqa: E402
from core.stages.registration import hair  # noqa: E402
from core.stages.texture import foreign, parts_shown  # noqa: E402
from core.stages.texture.held_picture import hold  # noqa: E402
from core.stages.texture.projection import observe  # noqa: E402
from research.people.painted_head import person, place_camera  # noqa: E402

SIZE, AZIMUTHS = 256, (-50, -20, 0, 20, 50)
SCALP = (template.mask("scalp", SIZE) > 0.5).astype(np.float32)
RIM = cv2.dilate(SCALP, np.ones((25, 25))) - cv2.erode(SCALP, np.ones((25, 25)))
"""Texels near the scalp's border, where views blur it."""


@pytest.fixture(scope="module")
def views(tmp_path_factory):
    folder, made = tmp_path_factory.mktemp("frames"), []
    for i, azimuth in enumerate(AZIMUTHS):
        view = replace(place_camera(azimuth), name=f"{i}.png", path=folder / f"{i}.png")
        images.write_srgb(view.path, np.full((view.height, view.width, 3), (i + 1) / 10, np.float32))
        made.append(view)
    return made


@pytest.fixture(scope="module")
def head():
    return Head(person()[0].mesh)


@pytest.fixture(scope="module")
def unweighted(views, head):
    surface = head.unfold(SIZE)
    return [observe(view, hold(np.full((view.height, view.width, 3), 0.5)), surface, 1.0) for view in views]


@pytest.fixture
def observations(unweighted, head):
    return [replace(each) for each in unweighted], head.unfold(SIZE)


def sees(monkeypatch, module, views, head, mask, otherwise=None):
    """The parser sees a UV mask of the head as hair in every view; in some, by number, it sees another picture [H,
    W]."""
    shown = {}
    for i, view in enumerate(views):
        face, bary, _ = raster.render_view(head.caster, view)
        uv = raster.interpolate(head.mesh.uvs, head.mesh.face_uvs, face, bary)
        at = np.stack([uv[..., 0], 1 - uv[..., 1]], -1).reshape(-1, 2) * len(mask)
        share = (raster.sample(mask, at).reshape(face.shape) * (face >= 0)).astype(np.float32)
        shown[i] = (otherwise or {}).get(i, lambda share: share)(share)

    def parse(srgb, landmarks):
        assert landmarks.shape == (468, 2)
        share = shown[round(float(srgb.mean()) * 10) - 1]
        return SimpleNamespace(
            of=lambda *names: share if "hair" in names else 0 * share, known=lambda: np.ones_like(share)
        )

    monkeypatch.setattr(module.parser, "parse", parse)


def leave_out(observations, surface):
    shown = parts_shown.tell_parts(observations, surface, Reporter("texture"))
    return foreign.leave_out_hair(observations, shown, surface), shown


def test_what_most_views_show_as_hair_is_left_out_of_all(monkeypatch, views, head, observations):
    before = [o.weight.copy() for o in observations[0]]
    sees(monkeypatch, parts_shown, views, head, SCALP, {2: lambda share: 0 * share})
    hidden, shown = leave_out(*observations)
    inner = np.minimum(SCALP, 1 - RIM) > 0.5
    for o, was in zip(observations[0], before, strict=True):
        there = inner & (was > 0)
        assert o.weight[there].max(initial=0) < 0.05 * was.max(), "also in the view that shows none"
        skin = (RIM + SCALP < 0.5) & (was > 0)
        assert np.allclose(o.weight[skin], was[skin]) and skin.any()
    anywhere = np.max(before, axis=0) > 0
    assert hidden[inner & anywhere].mean() > 0.8 and np.array_equal(shown.judged, anywhere)
    share = shown.shares[..., parts_shown.ASKED.index("hair")]
    assert np.median(share[inner & shown.judged]) > 0.7 and share[~shown.judged].max() == 0
    assert shown.shares[..., parts_shown.ASKED.index("brows")].max() == 0


def test_a_strand_that_one_view_shows_counts_in_that_one(monkeypatch, views, head, observations):
    before = [o.weight.copy() for o in observations[0]]

    def with_strand(share):
        share = share.copy()
        share[:, share.shape[1] // 2 - 12 : share.shape[1] // 2 + 12] = 1
        return share

    sees(monkeypatch, parts_shown, views, head, SCALP, {1: with_strand})
    leave_out(*observations)
    face = (template.mask("face", SIZE) > 0.5) & (RIM + SCALP < 0.5)
    lost = [
        (face & (was > 0) & (o.weight < 0.5 * was)).sum() / (face & (was > 0)).sum()
        for o, was in zip(observations[0], before, strict=True)
    ]
    assert lost[1] > 0.05 and max(lost[:1] + lost[2:]) < 0.02


def test_where_hardly_any_hair_is_seen_nothing_changes(monkeypatch, views, head, observations):
    before = [o.weight.copy() for o in observations[0]]
    dot = np.zeros((SIZE, SIZE), np.float32)
    dot[100:104, 100:104] = 1
    sees(monkeypatch, parts_shown, views, head, dot)
    assert not leave_out(*observations)[0].any()
    assert all((o.weight == was).all() for o, was in zip(observations[0], before, strict=True))


def test_hair_leaves_the_scan_and_a_picture_that_is_all_hair_does_not(monkeypatch, views, head):
    scan, report = meshes.Mesh(head.mesh.vertices, head.mesh.faces), Reporter("registration")
    sees(monkeypatch, hair, views, head, SCALP)
    kept = hair.without_hair(scan, views, head.mesh, report)
    gone = np.setdiff1d(np.arange(len(scan.vertices)), np.unique(kept.faces))
    uv = np.zeros((len(scan.vertices), 2))
    uv[head.mesh.faces] = head.mesh.uvs[head.mesh.face_uvs]
    on_scalp = raster.sample(SCALP, np.stack([uv[:, 0], 1 - uv[:, 1]], 1) * SIZE) > 0.5
    assert len(gone) > 100 and on_scalp[gone].mean() > 0.9 and report.figures["hair_in_scan_percent"] > 5
    sees(monkeypatch, hair, views, head, np.ones((SIZE, SIZE), np.float32))
    front = meshes.Mesh(scan.vertices, scan.faces[(scan.vertices[scan.faces, 1] < -0.01).all(1)])
    assert hair.without_hair(front, views, head.mesh, report) is front
