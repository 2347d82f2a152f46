# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The solve stage on a small capture with the shipped prior: its maps, the tone control, cancel, kill and resume, what bad
inputs, masks of little use and holes in the texture give."""

import json
import random
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from core.capture.capture import Capture
from core.capture.files import write_json
from core.capture.messages import CancelledError, Failed, Preview, Progress, Reporter
from core.capture.stages import MAPS
from core.face import template
from core.face.head import read_head
from core.imaging import images
from core.settings.settings import from_json
from core.solver import start
from core.solver.evidence import soften_mask
from core.solver.objective import albedo
from core.solver.recipes import RECIPES
from core.stages import solve
from core.stages.solve import drawing, tone
from core.stages.solve.capture_evidence import read_evidence
from core.stages.solve.head_cells import make_head_cells
from core.stages.solve.prior_files import WEIGHTS, load
from core.worker.client import Worker
from core.worker.job import write_job
from research.people.identities import reserved_seeds
from tests.fixtures.painted_skin import SHORT, SIZE, TONE, X, Y, as_setting, make, mean_face, settings, solved, tone_of
from tests.fixtures.refused import refused
from tests.fixtures.tiny_chain import follow

ASKED = 0.7 * TONE


@pytest.fixture
def capture(tmp_path):
    return make(tmp_path / "Zoë's face.wildcap")


@pytest.fixture
def evidence(capture):
    return read_evidence(capture, read_head(capture), SIZE)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A solved capture of a large exposure, filmed in half of it; the pictures that it showed on the way, its losses."""
    capture, shown, drawn = make(tmp_path_factory.mktemp("finished") / "a.wildcap"), [], []
    texture = 1.4 * images.read_linear(capture.texture)
    images.write_linear(capture.texture, texture)
    images.write_srgb(capture.texture_filmed, images.linear_to_srgb(0.5 * texture))

    def hear(message) -> None:
        if isinstance(message, Preview):
            shown.append((message.path, (capture.root / message.path).read_bytes()))

    report, curve = Reporter("solve", hear), drawing.draw_loss_curve
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(drawing, "draw_loss_curve", lambda losses, steps: drawn.append(losses) or curve(losses, steps))
        solve.run(capture, settings(skin_tone=as_setting(ASKED)), report)
    json.dumps(report.figures)
    return capture, shown, drawn[-1]


def test_solve_writes_all_maps_of_the_asked_tone(finished):
    capture = finished[0]
    for name in MAPS:
        values = images.read_data(capture.maps / name)
        assert values.shape[:2] == (SIZE, SIZE) and np.isfinite(values).all(), name
    diffuse = images.read_linear(capture.maps / "diffuse_albedo.exr")
    assert np.abs(tone_of(diffuse) / ASKED - 1).max() < 0.01
    assert np.abs(images.read_linear(capture.maps / "diffuse_albedo.png") - diffuse).max() < 0.002
    shading, texture = images.read_linear(capture.maps / "shading.exr"), images.read_linear(capture.texture)
    skin = template.mask("skin", SIZE) * (1 - template.mask("eyes", SIZE)) > 0.5
    assert np.abs(diffuse * shading - texture)[skin].mean() < 0.05 * texture[skin].mean()
    normal = images.read_data(capture.maps / "normal.png")[..., :3] * 2 - 1
    assert np.abs(np.linalg.norm(normal, axis=-1) - 1).max() < 0.01 and (normal[..., 2] > 0.5).mean() > 0.95
    weight = images.read_mask(capture.skin_weight)
    assert weight.shape == (SIZE, SIZE) and np.median(weight[skin]) > 0.99, "of what follows another tone"
    assert capture.picture("solve", "texture_albedo_shading").is_file()
    assert not (capture.checkpoints / "solve.safetensors").exists()


def test_what_the_solve_is_compared_with_has_the_albedos_exposure(finished):
    """The delit and the filmed texture in comparison/, whatever exposure they came in: the facial skin is as bright on
    average, its light still there."""
    capture, skin = finished[0], template.mask("skin", SIZE) * (1 - template.mask("eyes", SIZE))
    paths = (capture.maps / "diffuse_albedo.exr", capture.comparison / "delit.png", capture.comparison / "filmed.png")
    luminances = [images.read_linear(path) @ np.float32([0.2126, 0.7152, 0.0722]) for path in paths]
    means = np.array([np.average(luminance, weights=skin) for luminance in luminances])
    assert np.abs(means / means[0] - 1).max() < 0.03, means
    texture = images.read_linear(capture.texture).mean(-1)
    assert np.corrcoef(luminances[2].ravel(), texture.ravel())[0, 1] > 0.99


def test_a_solve_shows_pictures_that_change_and_how_its_loss_falls(finished):
    capture, shown, losses = finished
    for name in ("albedo", "shading", "loss"):
        assert len({content for path, content in shown if path == f"preview/{name}.png"}) > 1, name
    assert [step for step, _ in losses] == list(range(1, 9)) and losses[-1][1] < 0.7 * losses[0][1]
    assert images.read_data(capture.preview / "loss.png").shape[:2] == drawing.CURVE_PX


def test_the_loss_curve_falls_from_the_upper_left_to_the_lower_right():
    losses = [(step, 0.1 ** (step / 5)) for step in range(1, 11)]
    picture = drawing.draw_loss_curve(losses, 10)
    rows, columns = np.nonzero(picture[..., 0] > 0.8)  # orange
    assert rows[columns < 10].mean() < 20 and rows[columns > picture.shape[1] - 10].mean() > picture.shape[0] - 20
    assert not (drawing.draw_loss_curve(losses[:5], 10)[:, 140:, 0] > 0.8).any(), "what is still to come is empty"
    assert np.isfinite(drawing.draw_loss_curve([(1, 0.0)], 10)).all()


def test_a_cancelled_run_goes_on_to_the_same_bytes_and_another_run_does_not_go_on_from_it(capture):
    def cancel(step: int, chosen) -> None:
        with pytest.raises(CancelledError):
            solved(capture, chosen, until=f"sampling, step {step} of")

    images.write_data(capture.shadow_mask, images.read_mask(capture.shadow_mask_auto))
    options = settings(guidance="dps", steps=5)
    solved(capture, options)
    unbroken = {name: (capture.maps / name).read_bytes() for name in MAPS}
    cancel(3, options)
    assert (capture.checkpoints / "solve.safetensors").is_file()
    proposal = capture.shadow_mask_auto.read_bytes()
    cancel(1, from_json({"delight": {"delighter": "none"}}, options))
    images.write_data(capture.shadow_mask_auto, np.zeros((SIZE, SIZE), np.float32))
    cancel(1, options)  # another proposal, under the mask that was painted
    capture.shadow_mask_auto.write_bytes(proposal)
    assert "Going on after step 2 of 5." in solved(capture, options)
    assert {name: (capture.maps / name).read_bytes() for name in MAPS} == unbroken


def test_the_artists_masks_win(capture, evidence):
    """The painted mask replaces the proposal, and what is protected is no shadow."""
    assert evidence.alpha.max() == 1 and evidence.added.max() == 0
    painted = np.zeros((SIZE, SIZE), np.float32)
    painted[60:80, 30:50] = 1
    images.write_data(capture.shadow_mask, painted)
    alone = read_evidence(capture, read_head(capture), SIZE)
    assert torch.equal(alone.alpha, torch.from_numpy(soften_mask(painted)) * evidence.covered)
    assert alone.added.numpy() == pytest.approx(painted, abs=0.01)
    images.write_data(capture.protect_mask, np.ones_like(painted))
    assert read_evidence(capture, read_head(capture), SIZE).alpha.max() == 0


def test_a_shadow_that_the_artist_added_to_the_proposal_is_taken_away(capture, full_light):
    """After a delighter the lights are held back, for a proposal takes dark skin along; where the artist has added to
    it, they are not."""
    proposal, distance, kept = images.read_mask(capture.shadow_mask_auto), np.hypot(X - 0.66, Y - 0.55), []
    images.write_data(capture.shadow_mask, proposal)
    inside, around = distance < 0.07, (distance > 0.11) & (distance < 0.15)
    for proposed in (proposal, 0 * proposal):
        images.write_data(capture.shadow_mask_auto, proposed)
        solved(capture, settings(steps=6))
        diffuse = images.read_linear(capture.maps / "diffuse_albedo.exr")
        step = [np.log(a[inside].mean() / a[around].mean()) for a in (diffuse, mean_face())]
        kept.append((step[0] - step[1]) / np.log(0.5))
    assert kept[1] < 0.2 < kept[0], kept


def test_the_border_of_a_shadow_on_the_neck_tells_what_is_missing_there(capture):
    distance = np.hypot(X - 0.88, Y - 0.9)
    shadow = 1 / (1 + np.exp((distance - 0.06) / 0.003))
    images.write_linear(capture.texture, TONE * (1 - 0.3 * shadow[..., None]).astype(np.float32))
    images.write_data(capture.shadow_mask_auto, (distance < 0.06).astype(np.float32))
    evidence = read_evidence(capture, read_head(capture), SIZE)
    recipe = replace(RECIPES["wildcap"], faint=1.0, reference="uniform", protect_marks=False)
    begun = start.start_solve(load(), evidence, torch.from_numpy(TONE), 8.0, recipe, make_head_cells)
    neck = (shadow > 0.9) & (template.mask("neck", SIZE) > 0.9) & evidence.covered.numpy()
    assert neck.sum() > 50 and begun.observations[1].missing.numpy()[neck].mean() > 0.12


def test_a_light_that_was_known_is_not_fitted_again(tmp_path):
    """What the frames of a torch leave is skin, and a change from left to right stays in the albedo."""
    capture = make(tmp_path / "torch.wildcap")
    images.write_linear(capture.texture, mean_face() * (0.7 + 0.3 * X)[..., None].astype(np.float32))
    images.write_data(capture.shadow_mask_auto, np.zeros((SIZE, SIZE), np.float32))
    write_json(capture.torchlight, {})
    solved(capture)
    shading = images.read_linear(capture.maps / "shading.exr").mean(-1)
    middle = shading[SIZE // 3 : 2 * SIZE // 3, SIZE // 4 : 3 * SIZE // 4]
    assert np.ptp(middle) < 0.02 * middle.mean()


def test_a_cancel_is_heard_and_something_is_said_before_the_first_step(capture):
    """While the light's scales are searched, and at each of the 72 penumbras that are tried."""
    said, looks = [], []

    def cancelled() -> bool:
        looks.extend(text for text in said[-1:] if text.startswith("telling skin from light"))
        return len(looks) >= 75 or any("sampling" in text for text in said[-1:])

    with pytest.raises(CancelledError):
        solve.run(capture, settings(), Reporter("solve", lambda message: said.append(message.text), cancelled))
    assert said[-1].startswith("telling skin from light")


def test_under_the_light_that_the_split_tells_the_skin_has_its_tone(evidence):
    """Even light, and a face redder on one side: no part of its mean is light's level."""
    prior, asked = load(), torch.from_numpy(TONE)
    side, redder = torch.sigmoid((torch.linspace(0, 1, SIZE) - 0.6) / 0.02), torch.tensor([0.1, 0.4, 0.5])
    face = start.make_reference(prior, asked, evidence, "mean")
    evidence = replace(evidence, texture=albedo(face) * (1 - redder[:, None, None] * side), alpha=0 * evidence.alpha)
    begun = start.start_solve(prior, evidence, asked, 8.0, RECIPES["wildcap"], make_head_cells)
    assert "grid" in {phase for phase, _, _ in begun.recipe.phases}, "the split's light is taken"
    o, skin = begun.observations[1], evidence.skin
    found = start.mean_tone(o.texture / o.shader.main(begun.state.lights), skin)
    assert torch.allclose(found / begun.working_tone, torch.ones(3), atol=0.003), found


def test_unusable_inputs_are_problems(capture):
    images.write_data(capture.texture_confidence, np.zeros((SIZE, SIZE), np.float32))
    refused(lambda: solved(capture), "No texel")
    images.write_data(capture.texture_confidence, np.ones((32, 32, 2), np.float32))
    refused(lambda: solved(capture), "texture_confidence.exr 32 x 32")


def test_auto_tone_ignores_what_is_masked(evidence):
    covered = evidence.alpha == 1
    assert covered.sum() > 100
    blackened = replace(evidence, texture=torch.where(covered, 0.001, evidence.texture))
    assert tone.estimate_from_texture(blackened) == tone.estimate_from_texture(evidence)


def test_a_hard_mask_gets_a_soft_border():
    mask = np.zeros((256, 256), np.float32)
    mask[64:128, 64:128] = 1
    soft = soften_mask(mask)
    assert soft[96, 96] == 1 and soft[0, 0] == 0
    assert 0.5 < soft[96, 64] < 1 and 0 < soft[96, 63] < 0.5


def test_the_prior_has_not_seen_the_subjects_that_it_is_tested_on():
    card = json.loads(WEIGHTS.with_suffix(".json").read_text(encoding="utf-8"))
    trained, kept = set(card["seeds"]), set(card["held_out_seeds"])
    assert trained and kept and not trained & kept and not reserved_seeds() & (trained | kept)


def test_the_nearest_skin_is_the_one_that_was_filmed(capture, evidence):
    """Under another light, another tone and a shadow that M covers."""
    prior, asked = load(), torch.from_numpy(TONE)
    light = evidence.texture / albedo(start.tint_face(prior.mean_face, asked, evidence.skin)).clamp_min(1e-3)
    face = start.tint_face(prior.references[3], asked, evidence.skin)
    found = start.make_reference(prior, asked, replace(evidence, texture=albedo(face) * light), "nearest")
    assert torch.equal(found, face)


ROOT = Path(__file__).resolve().parents[4]


def test_killed_at_any_step_it_goes_on_where_it_was(tmp_path, full_light):
    """The real worker on the real stage; test_solve.py compares the bytes."""
    capture, step = make(tmp_path / "a.wildcap"), random.randint(3, SHORT["steps"] - 2)
    job = write_job(capture, first="solve", last="solve", settings={"solve": SHORT, "device": "cpu"})
    worker = Worker(Path(sys.executable), ROOT, job, capture.logs / "worker.log")
    worker.start()
    follow(worker, until=lambda m: isinstance(m, Progress) and f"step {step} of" in m.text, timeout_s=400)
    worker._process.kill()
    assert isinstance(follow(worker)[-1], Failed) and not capture.maps.exists()
    assert any(text.startswith("Going on after step") for text in solved(capture)), f"killed at step {step}"
    assert all((capture.maps / name).is_file() for name in MAPS)


@pytest.fixture(scope="module")
def without_mask(tmp_path_factory) -> Capture:
    capture = make(tmp_path_factory.mktemp("empty") / "a.wildcap")
    images.write_data(capture.shadow_mask, np.zeros((SIZE, SIZE), np.float32))
    solved(capture, settings(steps=4))
    return capture


def maps_of(capture: Capture, like: Capture | None = None) -> dict[str, np.ndarray]:
    """The maps of a capture; solved first where `like` is given, whose files it takes what it lacks from."""
    if like is not None:
        for path in like.root.iterdir():
            if path.is_file() and not (capture.root / path.name).exists():
                shutil.copyfile(path, capture.root / path.name)
        solved(capture, settings(steps=4))
    maps = {name: images.read_data(capture.maps / name) for name in MAPS}
    assert all(np.isfinite(values).all() for values in maps.values())
    return maps


def test_without_a_mask_the_unshadowed_skin_is_right(without_mask):
    """Within 6 % of the true tone, in the mean of the texels that lie in no shadow."""
    albedo = maps_of(without_mask)["diffuse_albedo.exr"]
    lit = (template.mask("skin", SIZE) > 0.5) & (images.read_mask(without_mask.shadow_mask_auto) < 0.5)
    assert np.abs(albedo[lit].mean(0) / TONE - 1).max() < 0.06


def test_a_mask_of_one_texel_changes_what_is_near_it_and_one_over_everything_still_gives_a_face(without_mask, tmp_path):
    """Elsewhere the albedo stays within 0.003 on average and 0.02 at most, linear, of that without a mask."""
    capture, mask = Capture(tmp_path), np.zeros((SIZE, SIZE), np.float32)
    mask[70, 44] = 1
    images.write_data(capture.shadow_mask, mask)
    apart = np.abs(maps_of(capture, without_mask)["diffuse_albedo.exr"] - maps_of(without_mask)["diffuse_albedo.exr"])
    apart[62:79, 36:53] = 0
    assert apart.mean() < 0.003 and apart.max() < 0.02
    images.write_data(capture.shadow_mask, np.ones_like(mask))
    albedo = maps_of(capture, without_mask)["diffuse_albedo.exr"]
    assert 0.5 < albedo[template.mask("face", SIZE) > 0.5].mean() / TONE.mean() < 1.5


def test_holes_in_the_texture_are_filled_and_spoil_nothing_else(without_mask, tmp_path):
    capture = Capture(tmp_path)
    texture = images.read_linear(without_mask.texture)
    confidence = images.read_data(without_mask.texture_confidence)[..., 0]
    for hole, colour in ((np.s_[70:76, 40:46], 0), (np.s_[10, 10], 1000), (np.s_[100, 64], -1000)):
        texture[hole], confidence[hole] = colour, 0
    images.write_linear(capture.texture, texture)
    images.write_data(capture.texture_confidence, confidence)
    maps, whole = maps_of(capture, without_mask), maps_of(without_mask)
    assert maps["confidence.png"][70:76, 40:46].max() == 0
    unseen = maps["diffuse_albedo.exr"][71:75, 41:45].mean((0, 1))
    assert np.abs(unseen / TONE - 1).max() < 0.25, "what nobody saw is the mean face"
    near = np.zeros((SIZE, SIZE), bool)
    near[62:84, 32:54] = near[5:16, 5:16] = near[94:107, 58:71] = True
    assert np.abs(maps["diffuse_albedo.exr"] - whole["diffuse_albedo.exr"])[~near].max() < 0.02
