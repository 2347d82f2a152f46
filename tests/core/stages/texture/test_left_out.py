# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What leaves the texture: hair that a parser sees, in all views what most of them show and in one what that one shows,
and in the scan as well; and around an eye the frames in which it blinks."""

from dataclasses import replace
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from core.capture.capture import Capture
from core.capture.eyes_record import read_eyes, write_eyes
from core.capture.messages import Reporter
from core.face import faces, lids, template
from core.face.head import Head, read_filmed_head, read_head
from core.geometry import meshes, raster
from core.imaging import images
from core.stages.registration import eyeballs, hair
from core.stages.texture import blinks, foreign, parts_shown
from core.stages.texture.held_picture import hold
from core.stages.texture.projection import observe
from research.people.lifelike import shape
from research.people.painted_head import person, place_camera

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


SEED, TURNS, EYES_PX = 4, (-20, -8, 8, 20, 70), 128


@pytest.fixture
def filmed(tmp_path, monkeypatch):
    """A capture with open eyes, five views of it, and what would be found in each: the second shuts the left eye, and
    the last is a profile."""
    capture = Capture(tmp_path / "face.wildcap")
    capture.claim()
    closed = shape.person_mesh(SEED)
    opened = lids.open_lids(closed, 0.9, np.zeros(2))
    meshes.write_obj(capture.head, closed)
    meshes.write_obj(capture.head_open, opened.skin)
    write_eyes(capture, *eyeballs.OpenEyes(closed, opened, (0.9, 0.9), np.full(2, 0.0059), (4, 4)).records())
    head = read_filmed_head(capture)
    surface, found, observations = head.unfold(EYES_PX), {}, []
    for i, azimuth in enumerate(TURNS):
        view = replace(place_camera(azimuth), name=f"{i}.png", path=tmp_path / f"{i}.png")
        images.write_srgb(view.path, np.full((view.height, view.width, 3), 0.5, np.float32))
        seen = []
        for side in (0, 1):
            edges = (
                edge[np.linspace(0, len(edge) - 1, 9).round().astype(int)]
                for edge in lids.edges(head.mesh.vertices, side)
            )
            seen.append(faces.Eye(*(view.project(edge)[0] for edge in edges), np.zeros(2), 0.0))
        if i == 1:
            seen[0] = replace(seen[0], upper=seen[0].lower + 0.3 * (seen[0].upper - seen[0].lower))
        if i == 4:
            seen[1] = replace(seen[1], upper=seen[1].lower)
        found[view.name] = (-azimuth, *seen)
        observations.append(observe(view, hold(np.full((view.height, view.width, 3), 0.5)), surface, 1.0))
    monkeypatch.setattr(blinks, "_eyes_in", lambda view: found[view.name])
    return capture, observations, surface


def around(surface, capture, side):
    ball = read_eyes(capture)[side]
    near = np.linalg.norm(surface.points - ball.centre, axis=1) < 1.4 * ball.radius
    return surface.spread(near.astype(np.float32)) > 0


def test_a_blink_is_left_out_around_its_eye_alone(filmed):
    capture, observations, surface = filmed
    before = [o.weight.copy() for o in observations]
    assert blinks.leave_out_blinks(capture, observations, surface, Reporter("texture")) == ["1.png"]
    left, right = (around(surface, capture, side) for side in (0, 1))
    assert before[1][left].max() > 0
    assert observations[1].weight[left].max() == observations[1].quality[left].max() == 0
    assert (observations[1].weight[right] == before[1][right]).all()
    assert (observations[1].weight > 0).sum() > 0.8 * (before[1] > 0).sum()
    for i in (0, 2, 3, 4):
        assert (observations[i].weight == before[i]).all()


def test_an_eye_keeps_what_it_has_where_no_other_view_shows_it(filmed):
    capture, observations, surface = filmed
    blind = np.zeros_like(observations[0].weight)
    only = [replace(observations[0], weight=blind), observations[1], replace(observations[2], weight=blind)]
    assert blinks.leave_out_blinks(capture, only, surface, Reporter("texture")) == []


def test_closed_eyes_do_not_blink(filmed):
    capture, observations, _ = filmed
    assert blinks.leave_out_blinks(capture, observations, read_head(capture).unfold(EYES_PX), Reporter("texture")) == []
