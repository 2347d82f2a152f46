# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""State's figures on maps and looks whose answers are known, its captures by person, and figures that are kept."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("flip_evaluator")

from core.capture.capture import Capture  # noqa: E402
from core.face import template  # noqa: E402
from core.imaging import images  # noqa: E402
from core.light.spherical_harmonics import sh_basis  # noqa: E402
from research.benchmarks.captures import state_captures
from research.benchmarks.captures.state_captures import DELIT, SIZE, SOLVED  # noqa: E402
from research.benchmarks.delighting import (
    state,
    state_scores,  # noqa: E402
)
from research.benchmarks.maps.albedo_score import AlbedoTruth, HeadInView  # noqa: E402
from research.benchmarks.measures.references import FLAT, NOTHING, TRUE  # noqa: E402
from research.benchmarks.measures.tone import BEST_PSNR  # noqa: E402

SKIN = np.float32([0.45, 0.28, 0.2])


@dataclass
class Drawn:
    """Stand-in for a capture in state_scores."""

    name: str
    where: np.ndarray
    normals: np.ndarray
    capture: Capture

    def parts(self):
        return {"skin": self.where.copy(), "brows": (template.mask("brows", SIZE) > 0.5) & self.where}


@pytest.fixture(scope="module")
def person(tmp_path_factory):
    """Two captures of a person: filmed under opposite lights, delit with a tenth of each left, solved with a light that
    both share."""
    where = template.mask("face", SIZE) > 0.5
    y, x = (np.mgrid[0:SIZE, 0:SIZE] + 0.5) / SIZE * 2 - 1
    normals = np.stack([x, -np.ones_like(x), -y], -1) * where[..., None]
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-9)
    truth = SKIN * np.exp(0.05 * np.random.default_rng(7).standard_normal((SIZE, SIZE, 1)))
    truth = np.where(template.mask("brows", SIZE)[..., None] > 0.5, 0.4 * truth, truth).astype(np.float32)
    basis = sh_basis(normals)
    light, shared = (np.exp(basis @ (scale * np.eye(9)[k]))[..., None] for scale, k in ((0.8, 3), (0.5, 2)))
    maps = [
        {
            NOTHING: truth * lit,
            FLAT: np.broadcast_to(SKIN, truth.shape),
            TRUE: truth,
            DELIT: truth * lit**0.1,
            SOLVED: truth * shared,
        }
        for lit in (light, 1 / light)
    ]
    captures = [Drawn(name, where, normals, Capture(tmp_path_factory.mktemp(name))) for name in ("one", "two")]
    return captures, [{name: np.asarray(value, np.float32) for name, value in each.items()} for each in maps]


@pytest.fixture(scope="module")
def jointly(person):
    return state_scores.of_person(*person)


def test_a_shared_light_is_no_error_and_lights_that_differ_are(jointly, person):
    together, alone = jointly
    assert together[SOLVED]["psnr_shared"] == BEST_PSNR and together[SOLVED]["light_shared"] > 0.05
    assert together[NOTHING]["light_shared"] < 0.01 and alone[NOTHING]["one"] < 35
    assert set(alone[DELIT]) == {"one", "two"}
    single, _ = state_scores.of_person(person[0][:1], [{name: person[1][0][name] for name in (NOTHING, TRUE, DELIT)}])
    assert single[DELIT].get("agreement") is None and single[DELIT]["between_lights"] is None


def test_slope_and_agreement_of_a_person(jointly):
    together, _ = jointly
    slopes = {name: together[name]["light_slope"] for name in (NOTHING, DELIT, FLAT)}
    assert slopes == pytest.approx({NOTHING: 1, DELIT: 0.1, FLAT: 0}, abs=1e-3)
    assert together[FLAT]["agreement"] == BEST_PSNR == together[SOLVED]["agreement"]
    assert together[DELIT]["agreement"] > together[NOTHING]["agreement"] + 15
    assert together[TRUE]["lost"] == 0 and together[FLAT]["lost"] == pytest.approx(1, abs=1e-3)


def test_one_captures_figures(person):
    found = state_scores.in_uv(person[0][0], person[1][0])
    assert found[TRUE]["psnr_uv"] == BEST_PSNR == found[NOTHING]["psnr_alone"] and found[NOTHING]["psnr_uv"] < 30
    assert found[DELIT]["kept_brows"] == pytest.approx(1, abs=0.05)
    assert found[FLAT]["kept_brows"] == pytest.approx(0, abs=1e-3)
    assert found[FLAT]["bias_brows"] - found[FLAT]["bias_skin"] == pytest.approx(-np.log(0.4), abs=0.02)


def look_at(albedo, face, shadow=None) -> HeadInView:
    """A picture that shows the whole map, [S, S, 3] linear."""
    side = len(face)
    y, x = (np.mgrid[0:side, 0:side] + 0.5) / side
    truth = AlbedoTruth(0, images.linear_to_srgb(albedo), face, shadow)
    return HeadInView(truth, np.ones((side, side), bool), np.stack([x.ravel(), 1 - y.ravel()], 1))


def test_pictures_are_judged_as_the_maps_are_seen():
    side, rng = 160, np.random.default_rng(3)
    truth = (SKIN * np.exp(0.1 * rng.standard_normal((side, side, 1)))).astype(np.float32)
    y, x = (np.mgrid[0:side, 0:side] + 0.5) / side
    face, shadow = (np.abs(x - 0.5) < 0.45) & (np.abs(y - 0.5) < 0.45), x > 0.5
    filmed = truth * np.where(shadow, 0.4, 1.0)[..., None]
    answers = {NOTHING: filmed, TRUE: truth, FLAT: np.broadcast_to(SKIN, truth.shape)}
    found = state_scores.in_pictures(answers, [look_at(truth, face, shadow)])
    assert found[TRUE]["psnr"] > 50 and found[TRUE]["overshoot"] < 0.01
    assert found[TRUE]["detail"] == pytest.approx(1, abs=1e-3) and found[FLAT]["detail"] == 0
    assert found[NOTHING]["shadow_step"] == pytest.approx(-np.log(0.4), abs=0.02)
    assert found[NOTHING]["edge_step"] == pytest.approx(-np.log(0.4), abs=0.05)
    assert found[FLAT]["psnr"] < found[TRUE]["psnr"]


def filled(folder: Path, name: str, head: str | None) -> None:
    capture = Capture(folder / f"{name}.wildcap")
    capture.claim()
    capture.texture.write_text("texture")
    (folder / name / "albedo").mkdir(parents=True)
    if head is not None:
        (folder / name / "head.obj").write_text(head)


def test_captures_of_one_true_head_are_one_person(tmp_path):
    for name, head in (("anna", "A"), ("anna_flash", "A"), ("ben", "B"), ("scan", None)):
        filled(tmp_path, name, head)
    Capture(tmp_path / "new.wildcap").claim()
    found = state_captures.find(tmp_path, tmp_path, tmp_path / "state")
    people = [(filmed.name, filmed.person) for filmed in found]
    assert people == [("anna", "anna"), ("anna_flash", "anna"), ("ben", "ben"), ("scan", "scan")]


def test_a_subjects_own_parts_come_before_the_built_in_heads(tmp_path):
    filled(tmp_path, "anna", "A")
    beard, brows = np.zeros((64, 64), np.float32), np.zeros((64, 64), np.float32)
    beard[40:50, 20:40], brows[20:24, 20:40] = 0.4, 1.0  # as thin as it grows
    for name, mask in (("beard", beard), ("brows", brows)):
        images.write_data(tmp_path / "anna" / "maps" / f"part_{name}.png", mask)
    parts = state_captures.find(tmp_path, tmp_path, tmp_path / "state")[0].parts()
    assert parts["beard"][SIZE * 45 // 64, SIZE * 30 // 64]
    assert parts["beard"].sum() == pytest.approx(200 * (SIZE / 64) ** 2, rel=0.15)
    assert parts["brows"].sum() == pytest.approx(80 * (SIZE / 64) ** 2, rel=0.2) and parts["lips"].any()
    assert not (parts["skin"] & (parts["beard"] | parts["brows"] | parts["lips"])).any() and parts["skin"].any()


def test_normals_are_in_the_axes_of_the_head():
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    points = np.random.default_rng(0).normal(size=(40, 3))
    assert state_captures.rotation_between(points @ turn.T + 3, points) == pytest.approx(turn.T, abs=1e-9)


def test_figures_in_pictures_are_kept_until_something_changes(tmp_path, monkeypatch):
    filled(tmp_path, "anna", "A")
    filmed, calls = state_captures.find(tmp_path, tmp_path, tmp_path / "state")[0], []
    monkeypatch.setattr(state, "looks", lambda capture, truth: ([], []))
    monkeypatch.setattr(state, "in_pictures", lambda answers, seen: calls.append(1) or {NOTHING: {"psnr": 30.0}})

    def change(path):
        path.parent.mkdir(exist_ok=True)
        path.write_text("drawn anew")

    paths = [filmed.capture.texture, filmed.truth / "face" / "0001.png", filmed.truth / "shadow" / "0001.png"]
    for step, path in enumerate(paths, start=1):
        for _ in range(2):
            assert state.seen_in_pictures(filmed, {NOTHING: np.zeros(1)}) == {NOTHING: {"psnr": 30.0}}
        assert len(calls) == step
        change(path)


def test_people_measured_before_by_the_same_code_stay_in_the_record():
    code, row = {"solve": "a", "measures": "b"}, {"psnr": 30.0}
    record = {"people": {DELIT: {"anna": row}}, "captures": {"anna": {DELIT: row}}, "code": code}
    now = {SOLVED: {"ben": row}, DELIT: {"ben": row}}
    scores, by_capture = state.merge_earlier(record, now, {"ben": {DELIT: row}}, code)
    assert scores == {DELIT: {"anna": row, "ben": row}, SOLVED: {"ben": row}}
    assert list(scores) == [DELIT, SOLVED] and set(by_capture) == {"anna", "ben"}
    assert state.merge_earlier(record, {}, {}, {**code, "solve": "c"}) == ({}, {})


def test_words_in_the_measures_change_no_figure_and_their_code_does(monkeypatch, tmp_path):
    written = tmp_path / "measure.py"

    def hashed(text):
        written.write_text(text)
        return state.measuring()["measure.py"]

    monkeypatch.setattr(state.state_scores, "__file__", str(written))
    before = hashed('"""Words."""\nWIDTH = 3  # pixels\n')
    assert hashed('"""Other words."""\n\nWIDTH = 3\n') == before != hashed("WIDTH = 4\n")
    assert {"albedo_score.py", "delight_measures.py", "state_captures.py", "edges.py"} < state.measuring().keys()


def test_what_the_truth_shows_before_the_neck_is_no_facial_skin_of_the_head():
    """A beard's strands hide the neck: no picture may judge the neck there."""
    side = 128
    face = template.mask("face", side) > 0.5
    look = look_at(np.broadcast_to(SKIN, (side, side, 3)), np.ones((side, side), bool))
    tinted = SKIN * np.where(np.indices((side, side)).sum(0)[..., None] % 2, 1.0, 0.8)
    beside = np.where(face[..., None], SKIN, tinted).astype(np.float32)
    within = np.where(face[..., None], tinted, SKIN).astype(np.float32)
    scores = state_scores.in_pictures({NOTHING: beside, DELIT: within}, [look])
    assert scores[NOTHING]["psnr"] > scores[DELIT]["psnr"] + 6
