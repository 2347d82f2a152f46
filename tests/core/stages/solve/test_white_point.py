# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The white point: a ColorChecker drawn into a frame under a known light, a grey card and paper that are pointed at,
and what is neither."""

import cv2
import numpy as np
import pytest

from core.__main__ import main
from core.capture import stages
from core.capture.capture import Capture
from core.capture.messages import Reporter
from core.imaging import images
from core.settings.colour_values import parse_white_point
from core.settings.settings import Settings, from_json
from tests.fixtures.recorded import changed, record
from tests.fixtures.refused import refused

white_point = pytest.importorskip("core.stages.solve.white_point")
LIGHT = np.array([0.9, 0.8, 0.6])
QUAD = [[120, 140], [340, 160], [330, 300], [115, 285]]
CHART = np.frombuffer(
    bytes.fromhex(
        "735244c29682627a9d576c438580b167bdaad67e2c505ba6c15a635e3c6c9dbc40e0a32e"
        "383d96469449af363ce7c71fbb56950885a1f3f3f2c8c8c8a0a0a07a7a79555555343434"
    ),
    np.uint8,
).reshape(24, 3) / np.float32(255)
"""The published sRGB of a ColorChecker Classic's patches."""


def frame(light=None, quad=QUAD, width=480, height=400) -> np.ndarray:
    """A noisy, uneven sRGB frame, with a chart lit by `light` (linear) where one is given."""
    rng = np.random.default_rng(3)
    coarse = rng.uniform(0.05, 0.4, (6, 7, 3)).astype(np.float32)
    picture = cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)
    if light is not None:
        chart = np.full((200, 296, 3), 0.012, np.float32)
        for k, colour in enumerate(images.srgb_to_linear(CHART)):
            row, column = divmod(k, 6)
            chart[8 + 48 * row : 48 + 48 * row, 8 + 48 * column : 48 + 48 * column] = colour
        turn = cv2.getPerspectiveTransform(np.float32([[0, 0], [296, 0], [296, 200], [0, 200]]), np.float32(quad))
        cover = cv2.warpPerspective(np.ones((200, 296), np.float32), turn, (width, height))[..., None]
        picture = picture * (1 - cover) + cover * cv2.warpPerspective(chart * np.float32(light), turn, (width, height))
    return np.clip(images.linear_to_srgb(picture) + rng.normal(0, 0.006, picture.shape), 0, 1).astype(np.float32)


def filmed(root, *pictures) -> Capture:
    capture = Capture(root / "a.wildcap")
    for k, picture in enumerate(pictures):
        images.write_srgb(capture.frames / f"{k:05d}.jpg", picture, quality=95)
    return capture


@pytest.mark.parametrize(
    ("light", "quad"),
    [(LIGHT, [QUAD[2], QUAD[3], QUAD[0], QUAD[1]]), ([0.5, 0.7, 0.85], QUAD), ([1.3, 1.2, 1.0], QUAD)],
    ids=["warm, upside down", "cold", "burnt white"],
)
def test_a_chart_gives_its_light_within_two_percent(light, quad):
    found = white_point.measure_chart_white(frame(light, quad))
    assert np.abs(found / light - 1).max() < 0.02


def test_the_tool_finds_the_chart_in_whichever_frame_and_says_where_there_is_none(tmp_path, capsys):
    report = Reporter("white_point")
    refused(lambda: white_point.run(filmed(tmp_path, frame()), Settings(), report), "No ColorChecker")
    capture = filmed(tmp_path, frame(), frame(LIGHT))
    white_point.run(capture, Settings(), report)
    assert report.figures["white_point_frame"] == "00001.jpg"
    assert np.abs(np.array(report.figures["white_point"]) / LIGHT - 1).max() < 0.02
    assert main(["white", str(capture.root)]) == 0 and "--white-point 0." in capsys.readouterr().out


@pytest.mark.parametrize(("card", "reflectance"), [("grey", 0.18), ("white", 0.88)])
def test_a_card_that_is_pointed_at_gives_its_light(tmp_path, capsys, card, reflectance):
    picture = frame()
    picture[100:160, 200:280] = images.linear_to_srgb(reflectance * LIGHT)
    assert np.abs(white_point.measure_card_white(picture, 240, 130, card) / LIGHT - 1).max() < 0.01
    capture = filmed(tmp_path, picture)
    assert main(["white", str(capture.root), "--frame", "00000.jpg", "--at", "240", "130", "--card", card]) == 0
    found = np.array([float(v) for v in capsys.readouterr().out.split()[-1].split(",")])
    assert np.abs(found / LIGHT - 1).max() < 0.02


@pytest.mark.parametrize(
    ("where", "colour", "said"),
    [((900, 20), 0.5, "outside"), ((20, 20), 1.0, "overexposed"), ((20, 20), None, "not of one colour")],
)
def test_a_place_that_tells_nothing_is_refused(where, colour, said):
    picture = np.full((60, 80, 3), 0.5 if colour is None else colour, np.float32)
    picture[:, 20:] = 0.2 if colour is None else colour
    refused(lambda: white_point.measure_card_white(picture, *where, "grey"), said)


@pytest.mark.parametrize(
    ("words", "said"),
    [(["--frame", "00000.jpg"], "go together"), (["--frame", "9.jpg", "--at", "1", "1"], "There is no frame")],
)
def test_the_command_says_what_is_missing(tmp_path, capsys, words, said):
    assert main(["white", str(filmed(tmp_path, frame()).root), *words]) == 2 and said in capsys.readouterr().err


def test_a_white_point_that_is_none_is_refused():
    assert parse_white_point("auto") is None
    assert np.allclose(parse_white_point("0.9,0.8,1.6"), [0.9, 0.8, 1.6])
    for wrong in ("white", "1,1", "0,1,1", "1,nan,1"):
        refused(lambda wrong=wrong: parse_white_point(wrong), "is not a colour")


@pytest.mark.parametrize(
    ("options", "touched"), [({"white_point": "0.9,0.8,0.6"}, ["solve"]), ({"low_memory": True}, [])]
)
def test_a_new_white_point_touches_the_solve_alone_and_how_much_memory_it_takes_touches_nothing(
    tmp_path, options, touched
):
    capture = filmed(tmp_path, frame())
    for stage in stages.STAGES:
        record(capture, stage, Settings())
    assert [stage.name for stage in stages.STAGES if changed(capture, stage, from_json({"solve": options}))] == touched
