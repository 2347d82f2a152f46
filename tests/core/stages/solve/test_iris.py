# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The colour of irises, measured in pictures of a head whose irises are known, under coloured light, with a catchlight
and a blink."""

from dataclasses import replace

import numpy as np
import pytest
from skimage.color import deltaE_ciede2000, rgb2lab

pytest.importorskip("OpenImageIO")

from core.capture.eyes_record import Eyeball  # noqa: E402
from core.capture.messages import Reporter  # noqa: E402
from core.face import lids  # noqa: E402
from core.face.eye_reader import SIDE_PX, EyeShares  # noqa: E402
from core.face.head import FilmedHead  # noqa: E402
from core.geometry import meshes, raster  # noqa: E402
from core.imaging import images  # noqa: E402
from core.stages.solve import iris, iris_colours  # noqa: E402
from research.people.lifelike import eyes, shape  # noqa: E402
from research.people.painted_head import place_camera  # noqa: E402

SEED, SKIN = 4, np.array([0.42, 0.26, 0.19])
LID_SHADE = 0.58  # of the light on the eyes, under which measured people's whites are as dark as they are
AZIMUTHS = (-24, -8, 8, 24)


class Painted:
    """A head of one tone with open eyes, seen by four cameras."""

    def __init__(self, folder, colour, tone=SKIN, lit=(1.0, 0.8, 0.5), blink: int | None = None):
        closed = shape.person_mesh(SEED)
        self.opened = lids.open_lids(closed, 0.9, np.zeros(2))
        self.picture = eyes.paint_eyes(np.array(colour), self.opened.balls[0].radius, SEED, 512)
        self.albedo = np.tile(np.float32(tone), (256, 256, 1))
        self.head = self._filmed(closed, self.opened)
        shut = self._filmed(closed, lids.open_lids(closed, 0.0, np.zeros(2)))
        views = []
        for i, azimuth in enumerate(AZIMUTHS):
            view = replace(place_camera(azimuth, 0.03, scale=2.5), name=f"{i}.png", path=folder / f"{i}.png")
            images.write_srgb(view.path, self._photograph(view, shut if i == blink else self.head, np.array(lit)))
            views.append(view)
        self.views = views

    @staticmethod
    def _filmed(closed, opened) -> FilmedHead:
        return FilmedHead(closed, opened.skin, [ball.mesh for ball in opened.balls])

    def _photograph(self, view, head, lit) -> np.ndarray:
        whole = head.caster.mesh
        face, bary, _ = raster.render_view(head.caster, view)
        normal = raster.interpolate(meshes.vertex_normals(whole), whole.faces, face, bary)
        colour, lids_leave = np.tile(self.albedo[0, 0], (*face.shape, 1)), np.ones((*face.shape, 1))
        first = len(self.opened.skin.faces)
        for ball in self.opened.balls:
            of_ball = (face >= first) & (face < first + len(ball.mesh.faces))
            corners = ball.mesh.uvs[ball.mesh.faces[face[of_ball] - first]]
            uv = (corners * bary[of_ball][:, :, None]).sum(1)
            colour[of_ball] = raster.sample(self.picture, np.stack([uv[:, 0], 1 - uv[:, 1]], 1) * 512)
            lids_leave[of_ball] = LID_SHADE
            first += len(ball.mesh.faces)
        shade = 0.5 + 0.4 * np.clip(normal @ np.array([0.3, -0.9, 0.3]), 0, 1)
        picture = colour * lids_leave * shade[..., None] * lit
        for ball in self.opened.balls:  # a window in the cornea
            x, y = view.project((ball.centre + ball.radius * ball.gaze + [0.0015, 0, 0.0015])[None])[0][0].astype(int)
            picture[y - 3 : y + 3, x - 3 : x + 3] = 1
        return images.linear_to_srgb((picture * (face >= 0)[..., None]).astype(np.float32))

    def eyeball(self, side: int) -> Eyeball:
        ball = self.opened.balls[side]
        return Eyeball(tuple(ball.centre), ball.radius, tuple(ball.gaze), 0.9, eyes.IRIS_MM / 1000, 5)

    def found(self, side: int):
        return iris.measure_iris_colour(self.views, self.head, side, self.eyeball(side), self.albedo, Reporter("solve"))

    def true(self) -> np.ndarray:
        """The median of the picture between pupil and rim, as the lids show it."""
        y, x = (np.mgrid[0:512, 0:512] + 0.5) / 512 - 0.5
        angle = np.pi * (2 * np.hypot(x, y)).clip(0, 1) ** (1 / 0.6)
        share = np.sin(angle) * self.opened.balls[0].radius * 1000 / eyes.IRIS_MM
        return LID_SHADE * np.median(self.picture[(share > 0.55) & (share < 0.85) & (angle < 1)], axis=0)


def apart(found, true) -> float:
    return float(
        deltaE_ciede2000(*(rgb2lab(images.linear_to_srgb(np.float32(v)).reshape(1, 1, 3)) for v in (found, true)))[0, 0]
    )


def test_two_irises_have_the_middle_of_what_was_measured_but_for_a_brown_and_a_blue_one():
    """One in the shade of its lid, the other with the sky in it."""
    dim, bright = (0.02, 0.01, 0.004), (0.08, 0.04, 0.009)
    assert iris.even_colours(dim, bright) == ((0.04, 0.02, 0.006),) * 2
    brown, blue = (0.05, 0.024, 0.010), (0.048, 0.078, 0.115)
    assert iris.even_colours(brown, blue) == (brown, blue)
    assert iris.even_colours(blue, blue) == (blue, blue)


def test_an_eye_in_the_shade_takes_half_of_it_from_the_other(monkeypatch):
    told = [(0.03, 0.04, 0.05), (0.12, 0.16, 0.20)]
    monkeypatch.setattr(iris, "measure_iris_colour", lambda views, head, side, *_: told[side])

    def found():
        return iris.measure_both_irises([], None, (None, None), None, Reporter("solve"))

    assert found() == ((0.06, 0.08, 0.1),) * 2
    told[1] = None  # no frame shows it
    assert found() == (told[0],) * 2
    told[0] = None
    assert found() is None


@pytest.fixture(scope="module")
def brown(tmp_path_factory) -> Painted:
    return Painted(tmp_path_factory.mktemp("brown"), (0.05, 0.024, 0.010))


def test_the_colour_of_an_iris_is_found_under_warm_light_and_none_where_no_frame_faces_it(brown):
    for side in (0, 1):
        assert apart(brown.found(side), brown.true()) < 6
    behind = replace(brown.eyeball(0), gaze=(0.0, 1.0, 0.0))
    assert iris.measure_iris_colour(brown.views, brown.head, 0, behind, brown.albedo, Reporter("solve")) is None


def test_an_iris_does_not_follow_the_tone_that_was_chosen(brown):
    skin, found = brown.albedo, brown.found(0)
    brown.albedo = skin * np.float32([0.2, 0.15, 0.1])
    assert np.abs(np.divide(brown.found(0), found) - 1).max() < 0.01
    brown.albedo = skin


def test_the_white_tells_more_of_an_iris_than_skin_does_and_hidden_it_is_not_asked():
    """Of people of measured eyes: where the white is hidden a dark iris beside fair skin may be fair skin in the shade."""
    people = iris_colours.read_measured_eyes()
    drawn = np.exp(np.random.default_rng(0).multivariate_normal(people.mean, people.covariance, 400))
    irises, whites, skins = drawn[:, :3], drawn[:, 3:6], drawn[:, 6:]
    both = [iris_colours.expect_iris(*ratios) for ratios in zip(irises / skins, irises / whites, strict=True)]
    alone = [iris_colours.expect_iris(ratio) for ratio in irises / skins]
    nobody = np.tile(np.exp(people.mean[:3]), (400, 1))
    off = [np.sqrt(np.square(np.log(answer / irises)).mean()) for answer in (both, alone, nobody)]
    assert off[0] < 0.6 * off[1] and off[1] < 0.9 * off[2], off


def test_a_blue_iris_is_found_beside_dark_skin_past_a_blink(tmp_path):
    dark = np.array([0.06, 0.035, 0.022])
    person = Painted(tmp_path, (0.048, 0.078, 0.115), tone=dark, lit=(0.9, 0.9, 0.9), blink=2)
    assert apart(person.found(0), person.true()) < 6


def test_the_iris_is_what_lids_and_pupil_leave_of_it():
    """Of an eyeball that looks into the camera, where the reader sees the lower half of the iris alone."""
    view = place_camera(0, 0.0, scale=2.5)
    eye = Eyeball((0.0, 0.0, 0.0), 0.012, tuple(view.centre / np.linalg.norm(view.centre)), 0.9, 0.0059, 5)
    shape = (view.height, view.width, 3)
    (middle,), (depth,) = view.project(np.zeros((1, 3)))
    disc = depth - np.sqrt(0.012**2 - 0.0059**2)  # how far away the iris lies
    radius = 0.0059 * view.camera.mean_focal_length() / disc
    move = np.array([[1.0, 0, SIDE_PX / 2 - middle[0]], [0, 1.0, SIDE_PX / 2 - middle[1]]])
    share = np.zeros((SIDE_PX, SIDE_PX), np.float32)
    share[SIDE_PX // 2 :] = 1
    (rows, columns), _ = iris.find_eye_pixels(view, eye, EyeShares(share, share, move), shape)
    x, y = columns + 0.5 - middle[0], rows + 0.5 - middle[1]
    assert len(rows) == pytest.approx(np.pi * radius**2 * (0.85**2 - 0.55**2) / 2, rel=0.1)
    assert (np.hypot(x, y) / radius > 0.54).all() and (np.hypot(x, y) / radius < 0.86).all() and y.min() > -1.5
    shut = EyeShares(share, np.zeros_like(share), move)
    assert not len(iris.find_eye_pixels(view, eye, shut, shape)[0][0])
    unseen = replace(eye, iris_radius=0.0)
    assert not len(iris.find_eye_pixels(view, unseen, EyeShares(share, share, move), shape)[0][0])
