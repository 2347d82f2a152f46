# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Eyes that were open while filming: eyeballs fitted to the edges of the lids and to the iris, and the lids opened.

The closed head stays the head; open, its triangles and UVs are the same but parted between the lids.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import PchipInterpolator

from ...capture.eyes_record import SIDES, Eyeball
from ...capture.messages import Reporter
from ...face import lids
from ...geometry.meshes import Mesh
from .eye_looks import EyeLook
from .irises import CENTRE_SIGMA_M, GAZE_SIGMA_RAD
from .lid_marks import LidMarks, mark

RIM_SIGMA_M, IRIS_SIGMA_M = 0.0006, 0.0010
"""Deviation of the eyeball's surface from a mark of a lid's edge, and from the iris where it lies before it."""
RADIUS_SIGMA_SHARE = 0.06
"""Deviation of an eyeball's size from the head's around it, as a share: MakeHuman's eyes over its own heads."""
ROUNDS = 12
CORNER_REACH_M, RIM_REACH_M = 0.008, 0.006
"""Reach of the eye's corners on the face, about a centimetre, and of a lid's edge on the lid, about half of one."""
USUAL_OPENING, WIDEST_OPENING = 0.8, 1.4  # shares of MakeHuman's own opening


@dataclass(frozen=True)
class OpenEyes:
    """Fitted eyes.

    head: the closed head, its lids before the balls; opened: the same as filmed; openness: of the left and of the right
    eye, 1 being MakeHuman's; iris_radius [2] in metres, nan where unseen; measured: the number of views of the left and
    the right eye (0: by the other one, or by the head).
    """

    head: Mesh
    opened: lids.OpenHead
    openness: tuple[float, float]
    iris_radius: np.ndarray
    measured: tuple[int, int]

    def records(self) -> tuple[Eyeball, Eyeball]:
        """Return the left and the right eye as eyes.json keeps them."""

        def rounded(vector):
            return tuple(round(float(x), 6) for x in vector)

        posed = zip(self.opened.balls, self.openness, self.iris_radius, self.measured, strict=True)
        return tuple(
            Eyeball(
                rounded(ball.centre),
                round(ball.radius, 6),
                rounded(ball.gaze),
                round(openness, 3),
                round(float(np.nan_to_num(iris)), 6),
                views,
            )
            for ball, openness, iris, views in posed
        )


def mark_rims(
    looks: tuple[list[EyeLook], list[EyeLook]], head: Mesh, opening: float, report: Reporter
) -> tuple[LidMarks | None, LidMarks | None]:
    """Mark the edges of the left and the right lids of a closed head as far as the views show them.

    opening is height over width between the lids, as seen.
    """
    start = fit(head, (None, None), opening).opened
    return mark(looks[0], start, 0, report), mark(looks[1], start, 1, report)


def figures(report: Reporter, eyes: OpenEyes) -> None:
    for side, name in enumerate(SIDES):
        radius = float(eyes.iris_radius[side])
        report.figure(f"{name}_eye_views", eyes.measured[side])
        report.figure(f"{name}_eye_openness", round(eyes.openness[side], 2))
        report.figure(f"{name}_eyeball_radius_mm", round(1e3 * eyes.opened.balls[side].radius, 2))
        report.figure(f"{name}_iris_radius_mm", round(1e3 * radius, 2) if np.isfinite(radius) else None)


def fit(head: Mesh, rims: tuple[LidMarks | None, LidMarks | None], opening: float) -> OpenEyes:
    """Fit eyeballs and lids of a closed head to the marks of the left and the right eye.

    opening, height over width, is used for an eye without marks.
    """
    head = _move_corners(head, rims)
    balls = tuple(_place(head, side, rims[side]) for side in (0, 1))
    clear = head.vertices
    for ball in balls:
        near = np.linalg.norm(clear - ball.centre, axis=1) < 1.5 * ball.radius
        clear = np.where(near[:, None], lids.push_out(clear, ball), clear)
    head = replace(head, vertices=clear)
    openness = tuple(_openness(head, balls, side, rims[side], opening) for side in (0, 1))
    opened = lids.open_around(head, balls, openness)
    shift = np.zeros_like(opened.skin.vertices)
    for side, rim in enumerate(rims):
        if rim is not None:
            shift += _towards_rims(opened, side, rim)
    radius = np.array([rim.iris_radius if rim is not None else np.nan for rim in rims])
    return OpenEyes(
        head,
        lids.open_around(head, balls, openness, shift),
        openness,
        radius,
        tuple(rim.views if rim is not None else 0 for rim in rims),
    )


def _move_corners(head: Mesh, rims: tuple) -> Mesh:
    """Move the corners of the eyes to their marks, and the face close around along with them."""
    vertices = head.vertices.copy()
    for rim, (outer, inner) in zip(rims, lids.corners(), strict=True):
        if rim is not None:
            for corner, aim in ((outer, rim.upper[0]), (inner, rim.upper[-1])):
                near = np.exp(
                    -0.5 * (np.linalg.norm(head.vertices - head.vertices[corner], axis=1) / CORNER_REACH_M) ** 2
                )
                vertices += near[:, None] * (aim - head.vertices[corner])
    return replace(head, vertices=vertices)


def _place(head: Mesh, side: int, lid_marks: LidMarks | None) -> lids.PosedEyeball:
    """Fit an eyeball by least squares to the edges of the lids and of the iris, with the head around as the prior."""
    centre, radius = lids.carry_ball(head, side)
    if lid_marks is None:
        return lids.place_ball(side, centre, radius, lids.FORWARD)
    edge = np.concatenate([lid_marks.upper[2:-2], lid_marks.lower[2:-2]])  # near the corners the lids leave the ball
    clearance = _clearance(head, side, lids.place_ball(side, centre, radius, lids.FORWARD), lid_marks)
    start, size = centre, radius
    for _ in range(ROUNDS):
        out, ahead = edge - centre, lid_marks.iris - centre
        far, front_far = np.linalg.norm(out, axis=1), np.linalg.norm(ahead)
        # where a ring of the iris' radius lies on the ball
        front = np.sqrt(max(radius**2 - lid_marks.iris_radius**2, 1e-9))
        rows = np.concatenate(
            [
                np.column_stack([-out / far[:, None], -np.ones(len(out))]) / RIM_SIGMA_M,
                np.append(-ahead / front_far, -radius / front)[None] / IRIS_SIGMA_M,
                np.column_stack([-np.eye(3)[[0, 2]] / front_far, [0, 0]]) / GAZE_SIGMA_RAD,
                np.column_stack([np.diag(1 / CENTRE_SIGMA_M), np.zeros(3)]),
                np.array([[0, 0, 0, 1 / (RADIUS_SIGMA_SHARE * size)]]),
            ]
        )
        residuals = np.concatenate(
            [
                (radius + clearance - far) / RIM_SIGMA_M,
                [(front - front_far) / IRIS_SIGMA_M],
                -ahead[[0, 2]] / front_far / GAZE_SIGMA_RAD,
                (start - centre) / CENTRE_SIGMA_M,
                [(size - radius) / (RADIUS_SIGMA_SHARE * size)],
            ]
        )
        step = np.linalg.lstsq(rows, residuals, rcond=None)[0]
        centre, radius = centre + step[:3], radius + step[3]
    ahead = lid_marks.iris - centre
    return lids.place_ball(side, centre, float(radius), ahead / np.linalg.norm(ahead))


def _clearance(head: Mesh, side: int, ball: lids.PosedEyeball, lid_marks: LidMarks) -> np.ndarray:
    """Return how far before this head's eyeball the lids' edges lie, metres, at the marks but two at either end."""
    opened = lids.open_around(
        head, (ball, ball), (USUAL_OPENING, USUAL_OPENING)
    )  # the other side's lids are not looked at
    outer, inner = (opened.skin.vertices[corner] for corner in lids.corners()[side])
    clearances = []
    for rim, marks in zip(opened.rims[side], (lid_marks.upper, lid_marks.lower), strict=True):
        points = opened.skin.vertices[rim][::-1]  # as the marks: from the outer corner on
        clear = np.linalg.norm(points - ball.centre, axis=1) - ball.radius
        clearances.append(np.interp(_along(marks[2:-2], marks[0], marks[-1]), _along(points, outer, inner), clear))
    return np.concatenate(clearances)


def _along(points: np.ndarray, outer: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """Return how far from the outer corner to the inner one points [N, 3] lie, 0 to 1."""
    return (points - outer) @ (inner - outer) / ((inner - outer) ** 2).sum()


def _openness(head: Mesh, balls: tuple, side: int, lid_marks: LidMarks | None, opening: float) -> float:
    """Return the opening of an eye as a share of MakeHuman's.

    It brings the upper lid's edge nearest to its marks, or the height between the lids to `opening` times the width.
    """
    steps = np.linspace(0.0, WIDEST_OPENING, 29)
    miss = []
    for step in steps:
        opened = lids.open_around(head, balls, (step, step))
        upper, lower = (opened.skin.vertices[rim] for rim in opened.rims[side])
        if lid_marks is None:
            outer, inner = (opened.skin.vertices[corner] for corner in lids.corners()[side])
            height = np.sort(np.linalg.norm(upper - lower, axis=1))[-len(upper) // 3 :].mean()
            miss.append(abs(height / np.linalg.norm(outer - inner) - opening))
        else:
            miss.append(np.abs((_aims(opened, side, 0, lid_marks) - upper)[:, 2]).mean())
    return float(steps[np.argmin(miss)])


def _aims(opened: lids.OpenHead, side: int, lid: int, lid_marks: LidMarks) -> np.ndarray:
    """Return targets [N, 3] of an edge's vertices on the curve through its marks, as far along as on the head."""
    outer, inner = (opened.skin.vertices[corner] for corner in lids.corners()[side])
    share = np.clip(_along(opened.skin.vertices[opened.rims[side][lid]], outer, inner), 0, 1)
    marks = (lid_marks.upper, lid_marks.lower)[lid]
    place = np.maximum.accumulate(_along(marks, marks[0], marks[-1]) + 1e-6 * np.arange(len(marks)))
    return PchipInterpolator(place, marks)(share)


def _towards_rims(opened: lids.OpenHead, side: int, lid_marks: LidMarks) -> np.ndarray:
    """Return the shift [V + C + P, 3] that brings the edges to their marks and, fading, the lids beside them."""
    vertices = opened.skin.vertices
    shift = np.zeros_like(vertices)
    for lid, rim in enumerate(opened.rims[side]):
        gaps = _aims(opened, side, lid, lid_marks) - vertices[rim]
        members = lids.rows_of_lid(side, lid)
        gap = np.linalg.norm(vertices[members, None] - vertices[rim][None], axis=2)
        weight = np.exp(-0.5 * (gap / RIM_REACH_M) ** 2)
        near = np.exp(-0.5 * (gap / 0.0015) ** 2) + 1e-12  # which of the edge's vertices a lid's vertex goes with
        shift[members] += weight.max(1, keepdims=True) * (near @ gaps) / near.sum(1, keepdims=True)
    return shift
