# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The solve stage on a small capture with the shipped prior: its maps, the tone control, cancel and resume, what bad
inputs give."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch

from core.capture.messages import CancelledError, Problem, Reporter
from core.capture.stages import MAPS
from core.face import template
from core.face.head import read_head
from core.imaging import images
from core.settings.settings import from_json
from core.solver import start as initial
from core.solver.evidence import soften_mask
from core.solver.objective import albedo
from core.solver.recipes import RECIPES
from core.stages import solve
from core.stages.solve import tone
from core.stages.solve.capture_evidence import read_evidence
from core.stages.solve.head_cells import make_head_cells
from core.stages.solve.prior_files import WEIGHTS, load
from research.people.identities import reserved_seeds
from tests.fixtures.painted_skin import SIZE, TONE, as_setting, brief_light, make, settings  # noqa: F401


@pytest.fixture
def capture(tmp_path):
    return make(tmp_path / "Zoë's face.wildcap")


def maps_of(capture):
    return {name: (capture.maps / name).read_bytes() for name in MAPS}


def test_solve_writes_all_maps_of_the_asked_tone(capture):
    report = Reporter("solve")
    solve.run(capture, settings(), report)
    for name in MAPS:
        values = images.read_data(capture.maps / name)
        assert values.shape[:2] == (SIZE, SIZE) and np.isfinite(values).all(), name
    albedo = images.read_linear(capture.maps / "diffuse_albedo.exr")
    skin = template.mask("skin", SIZE) * (1 - template.mask("eyes", SIZE))
    assert np.abs((albedo * skin[..., None]).sum((0, 1)) / skin.sum() / TONE - 1).max() < 0.01
    assert np.abs(images.read_linear(capture.maps / "diffuse_albedo.png") - albedo).max() < 0.002
    shading, texture = images.read_linear(capture.maps / "shading.exr"), images.read_linear(capture.texture)
    explained = (albedo * shading - texture)[skin > 0.5]
    assert np.abs(explained).mean() < 0.05 * texture[skin > 0.5].mean()
    normal = images.read_data(capture.maps / "normal.png")[..., :3] * 2 - 1
    assert np.abs(np.linalg.norm(normal, axis=-1) - 1).max() < 0.01 and (normal[..., 2] > 0.5).mean() > 0.95
    assert (capture.preview / "albedo.png").is_file() and (capture.preview / "shading.png").is_file()
    assert capture.picture("solve", "texture_albedo_shading").is_file()
    assert not (capture.checkpoints / "solve.safetensors").exists()
    json.dumps(report.figures)


def test_what_the_solve_is_compared_with_has_the_albedos_exposure(capture, brief_light):  # noqa: F811
    """The delit and the filmed texture in comparison/, whatever exposure they came in: the facial skin is as bright on
    average, its light still there."""
    texture = images.read_linear(capture.texture)
    images.write_srgb(capture.texture_filmed, images.linear_to_srgb(0.5 * texture))
    solve.run(capture, settings(steps=4), Reporter("solve"))
    skin = template.mask("skin", SIZE) * (1 - template.mask("eyes", SIZE))
    luminance = {
        name: images.read_linear(path) @ np.float32([0.2126, 0.7152, 0.0722])
        for name, path in (
            ("albedo", capture.maps / "diffuse_albedo.exr"),
            ("delit", capture.comparison / "delit.png"),
            ("filmed", capture.comparison / "filmed.png"),
        )
    }
    means = {name: float(np.average(values, weights=skin)) for name, values in luminance.items()}
    assert abs(means["delit"] / means["albedo"] - 1) < 0.03 and abs(means["filmed"] / means["albedo"] - 1) < 0.03, means
    assert np.corrcoef(luminance["filmed"].ravel(), texture.mean(-1).ravel())[0, 1] > 0.99


@pytest.mark.parametrize(("factor", "asked"), [(1.4, 1.0), (0.7, 0.7), (1.4, 1.4)])
def test_the_tone_is_the_users_whatever_the_exposure_and_the_skin(capture, factor, asked, brief_light):  # noqa: F811
    """The same light on a skin of another albedo and that tone asked for; or only another exposure."""
    images.write_linear(capture.texture, images.read_linear(capture.texture) * factor)
    solve.run(capture, settings(steps=4, skin_tone=as_setting(TONE * asked)), Reporter("solve"))
    albedo = images.read_linear(capture.maps / "diffuse_albedo.exr")
    skin = template.mask("skin", SIZE) * (1 - template.mask("eyes", SIZE))
    assert np.abs((albedo * skin[..., None]).sum((0, 1)) / skin.sum() / (TONE * asked) - 1).max() < 0.01


def test_cancel_then_run_again_gives_the_same_bytes(capture, brief_light):  # noqa: F811
    options = settings(guidance="dps", steps=5)
    solve.run(capture, options, Reporter("solve"))
    unbroken = maps_of(capture)
    steps = []
    report = Reporter(
        "solve",
        emit=lambda message: steps.append(message),
        cancelled=lambda: any("step 3 of" in getattr(m, "text", "") for m in steps),
    )
    with pytest.raises(CancelledError):
        solve.run(capture, options, report)
    assert (capture.checkpoints / "solve.safetensors").is_file()
    logged = []
    solve.run(capture, options, Reporter("solve", emit=lambda message: logged.append(getattr(message, "text", ""))))
    assert "Going on after step 2 of 5." in logged
    assert maps_of(capture) == unbroken


def other_delighter(capture):
    return from_json({"delight": {"delighter": "none"}}, settings(steps=5))


def other_proposal(capture):
    """Under the mask that was painted."""
    images.write_data(capture.shadow_mask_auto, np.zeros((SIZE, SIZE), np.float32))
    return settings(steps=5)


@pytest.mark.parametrize("change", [None, other_delighter, other_proposal])
def test_a_checkpoint_of_another_run_is_not_gone_on_from(capture, brief_light, change):  # noqa: F811
    images.write_data(capture.shadow_mask, images.read_mask(capture.shadow_mask_auto))
    logged = []
    for options in (settings(steps=5), None):
        said = []
        report = Reporter(
            "solve",
            emit=lambda message, said=said: said.append(getattr(message, "text", "")),
            cancelled=lambda said=said: any("step 3 of" in text for text in said),
        )
        with pytest.raises(CancelledError):
            solve.run(capture, options or (change(capture) if change else settings(steps=5)), report)
        logged.append("Going on after step 2 of 5." in said)
    assert logged == [False, change is None]


def test_the_artists_masks_win(capture):
    """The painted mask replaces the proposal, and what is protected is no shadow."""

    def albedo_under(**pictures):
        for name, value in pictures.items():
            images.write_data(getattr(capture, name), value)
        solve.run(capture, settings(steps=4), Reporter("solve"))
        return images.read_linear(capture.maps / "diffuse_albedo.exr")

    proposal = images.read_mask(capture.shadow_mask_auto)
    with_proposal = albedo_under()
    painted_empty = albedo_under(shadow_mask=np.zeros_like(proposal))
    protected = albedo_under(shadow_mask=proposal, protect_mask=np.ones_like(proposal))
    assert np.abs(with_proposal - painted_empty).max() > 0.02
    assert np.abs(protected - painted_empty).max() < 1e-3


def test_a_shadow_that_the_artist_added_to_the_proposal_is_taken_away(capture):
    """After a delighter the lights are held back, for a proposal takes dark skin along; where the artist has added to
    it, they are not."""
    images.write_data(capture.shadow_mask, images.read_mask(capture.shadow_mask_auto))
    y, x = np.mgrid[:SIZE, :SIZE] / SIZE
    distance = np.hypot(x - 0.66, y - 0.55)
    inside, around = distance < 0.07, (distance > 0.11) & (distance < 0.15)
    shadow = 1 - 0.5 / (1 + np.exp((distance - 0.09) / 0.006))
    truth = images.read_linear(capture.texture) / ((0.7 + 0.3 * x) * shadow)[..., None]
    kept = []
    for proposal in (images.read_mask(capture.shadow_mask_auto), np.zeros((SIZE, SIZE), np.float32)):
        images.write_data(capture.shadow_mask_auto, proposal)
        solve.run(capture, settings(), Reporter("solve"))
        albedo = images.read_linear(capture.maps / "diffuse_albedo.exr")
        step = [np.log(a[inside].mean() / a[around].mean()) for a in (albedo, truth)]
        kept.append((step[0] - step[1]) / np.log(0.5))
    assert kept[1] < 0.2 < kept[0], kept


def test_the_border_of_a_shadow_on_the_neck_tells_what_is_missing_there(capture):
    y, x = np.mgrid[:SIZE, :SIZE] / SIZE
    distance = np.hypot(x - 0.88, y - 0.9)
    shadow = 1 / (1 + np.exp((distance - 0.06) / 0.003))
    albedo = initial.make_uniform_skin(torch.from_numpy(TONE), SIZE)[0, :3].permute(1, 2, 0).numpy() / 2 + 0.5
    images.write_linear(capture.texture, albedo * (1 - 0.3 * shadow[..., None]))
    images.write_data(capture.shadow_mask_auto, (distance < 0.06).astype(np.float32))
    evidence, prior = read_evidence(capture, read_head(capture), SIZE), load()
    recipe = replace(RECIPES["wildcap"], faint=1.0, reference="uniform", protect_marks=False)
    start = initial.start_solve(prior, evidence, torch.from_numpy(TONE), 8.0, recipe, make_head_cells)
    neck = (shadow > 0.9) & (template.mask("neck", SIZE) > 0.9) & evidence.covered.numpy()
    assert neck.sum() > 50 and start.observations[1].missing.numpy()[neck].mean() > 0.12


def test_a_cancel_is_heard_and_something_is_said_before_the_first_step(capture):
    """While the light's scales are searched, and at each of the 72 penumbras that are tried."""
    for enough in (np.inf, 1, 75):
        said, looks = [], []

        def cancelled(said=said, looks=looks, enough=enough) -> bool:
            looks.extend(text for text in said[-1:] if text.startswith("telling skin from light"))
            return len(looks) >= enough or "sampling" in said[-1:]

        def emit(message, said=said) -> None:
            said.append("sampling" if "sampling" in message.text else message.text)

        with pytest.raises(CancelledError):
            solve.run(capture, settings(), Reporter("solve", emit, cancelled))
        assert len(looks) > 80 if enough == np.inf else said[-1].startswith("telling skin from light")


def test_under_the_light_that_the_split_tells_the_skin_has_its_tone(capture):
    """Even light, and a face redder on one side: no part of its mean is light's level."""
    evidence, prior, told = read_evidence(capture, read_head(capture), SIZE), load(), torch.from_numpy(TONE)
    side, redder = torch.sigmoid((torch.linspace(0, 1, SIZE) - 0.6) / 0.02), torch.tensor([0.1, 0.4, 0.5])
    face = initial.make_reference(prior, told, evidence, "mean")
    evidence = replace(evidence, texture=albedo(face) * (1 - redder[:, None, None] * side), alpha=0 * evidence.alpha)
    start = initial.start_solve(prior, evidence, told, 8.0, RECIPES["wildcap"], make_head_cells)
    assert "grid" in {phase for phase, _, _ in start.recipe.phases}, "the split's light is taken"
    o, skin = start.observations[1], evidence.skin
    found = initial.mean_tone(o.texture / o.shader.main(start.state.lights), skin)
    assert torch.allclose(found / initial.mean_tone(albedo(face), skin), torch.ones(3), atol=0.003), found


def test_unusable_inputs_are_problems(capture):
    with pytest.raises(Problem, match="not a colour"):
        solve.run(capture, settings(skin_tone="pink"), Reporter("solve"))
    images.write_data(capture.texture_confidence, np.zeros((SIZE, SIZE), np.float32))
    with pytest.raises(Problem, match="seen by any frame"):
        solve.run(capture, settings(), Reporter("solve"))


def test_auto_tone_ignores_what_is_masked(capture):
    evidence = read_evidence(capture, read_head(capture), SIZE)
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


def test_the_card_names_its_seeds_and_they_are_not_the_sample_subjects():
    card = json.loads(WEIGHTS.with_suffix(".json").read_text(encoding="utf-8"))
    assert card["seeds"] and card["held_out_seeds"] and not set(card["seeds"]) & set(card["held_out_seeds"])
    reserved = reserved_seeds()
    assert reserved and not reserved & set(card["seeds"] + card["held_out_seeds"])
    assert WEIGHTS.stat().st_size < 15e6


def test_the_nearest_skin_is_the_one_that_was_filmed(capture):
    """Under another light, another tone and a shadow that M covers."""
    prior, told = load(), torch.from_numpy(TONE)
    evidence = read_evidence(capture, read_head(capture), SIZE)
    light = images.read_linear(capture.texture) / np.maximum(filmed(prior.mean_face, evidence), 1e-3)
    for skin in prior.references[[3, 7]]:
        evidence = replace(evidence, texture=torch.from_numpy((filmed(skin, evidence) * light).transpose(2, 0, 1)))
        found = initial.make_reference(prior, told, evidence, "nearest")
        assert torch.equal(found, initial.tint_face(skin, told, evidence.skin))


def test_a_confidence_of_another_size_is_named(capture):
    images.write_data(capture.texture_confidence, np.ones((32, 32, 2), np.float32))
    with pytest.raises(Problem, match=r"texture.exr is .* and texture_confidence.exr 32 x 32"):
        read_evidence(capture, read_head(capture), SIZE)


def filmed(face, evidence) -> np.ndarray:
    return albedo(initial.tint_face(face, torch.from_numpy(TONE), evidence.skin)).permute(1, 2, 0).numpy()
