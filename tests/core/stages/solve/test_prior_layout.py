# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A prior of the authors' kind on a capture: maps go to the UVs it works in and come back to where they were, and the
stage gives sensible maps.

The head with other UVs is the built-in one with its chart turned and moved to where such a prior expects a face.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch

from core.capture import stages
from core.capture.capture import Capture
from core.capture.messages import Problem, Reporter
from core.capture.stages import MAPS
from core.face import template
from core.geometry import meshes, raster
from core.imaging import images
from core.settings.settings import from_json
from core.solver.lighting import Lights
from core.stages import solve
from core.stages.solve import layout
from core.stages.solve.maps import Maps
from core.stages.solve.prior_files import WEIGHTS, load
from tests.core.stages.solve.test_released_prior import weights_of, write
from tests.fixtures.painted_skin import SIZE, TONE, as_setting, make
from tests.fixtures.recorded import changed, record

MODEL = {
    "depths": [1, 1],
    "channels": [32, 32],
    "self_attn_depths": [False, False],
    "mapping_out": 16,
    "sigma_data": 0.5,
    "sigma_min": 0.01,
    "sigma_max": 80,
}


def front() -> meshes.Mesh:
    """The built-in head without what lies far from its face: quicker to search."""
    mesh = template.load()
    middle = mesh.uvs[mesh.face_uvs].mean(1)
    near = raster.sample(template.mask("face", 128), np.stack([middle[:, 0], 1 - middle[:, 1]], 1) * 128) > 0.02
    return replace(mesh, faces=mesh.faces[near], face_uvs=mesh.face_uvs[near])


def other_head(turn_deg: float = 12.0) -> meshes.Mesh:
    """The built-in face in another order, 0.3 mm larger all around, its chart turned, a fifth smaller, the bridge of
    the nose where the prior's tone box is."""
    mesh, whole = front(), template.load()
    face, bary = template.landmarks()
    bridge = (whole.uvs[whole.face_uvs[face[[6, 197]]]] * bary[[6, 197], :, None]).sum(1).mean(0)
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    uvs = (mesh.uvs - bridge) @ np.array([[c, s], [-s, c]]) * 0.8 + [0.5, 1 - 344 / 1024]
    order = np.random.default_rng(0).permutation(len(mesh.faces))
    grown = mesh.moved(mesh.vertices + 3e-4 * meshes.vertex_normals(mesh))
    return replace(grown, uvs=uvs, faces=grown.faces[order], face_uvs=grown.face_uvs[order])


def put_own_head(capture: Capture, own: meshes.Mesh, skin: np.ndarray | None = None) -> None:
    """As the registration leaves it; skin bool [F] marks the triangles to paint, all by default."""
    meshes.write_obj(capture.own_head, own)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], np.ones(len(own.faces), bool) if skin is None else skin, [0]])))
    capture.own_head_skin.write_text(
        json.dumps({"template": "other.obj", "skin_triangles": edges.reshape(-1, 2).tolist()})
    )


@pytest.fixture
def capture(tmp_path):
    """Painted skin, and another head fitted beside the built-in one."""
    made = make(tmp_path / "face.wildcap", (0.6, 0.5), 0.06)
    put_own_head(made, other_head())
    return made


@pytest.fixture
def authors(tmp_path):
    """A folder as the authors' of a network with little to say: random, its output scaled down."""
    state = weights_of(MODEL, 2, True)
    state["inner_model.proj_out.weight"] *= 0.05
    write(tmp_path / "authors", MODEL, {"type": "coord"}, state)
    return tmp_path / "authors"


def settings(prior, **options):
    return from_json(
        {
            "solve": {
                "size": SIZE,
                "steps": 10,
                "guidance": "proximal",
                "skin_tone": as_setting(TONE),
                "prior": str(prior),
                **options,
            }
        }
    )


def seen_layouts(monkeypatch) -> list[layout.Layout]:
    """Gets the layouts that runs from here on work in."""
    fitted, kept = layout.fit_layout, []

    def keep(*given):
        found = fitted(*given)
        kept.append(found[0])
        return found

    monkeypatch.setattr(layout, "fit_layout", keep)
    return kept


@pytest.fixture(scope="module")
def carried():
    """The layout of the other head at 256, and the built-in head's texels: position [S, S, 3], and which of them are
    far within the window."""
    own, size = other_head(), 256
    there = layout.make_layout(front(), own, np.ones(len(own.faces), bool), size, load().mean_face, lambda done: None)
    face, bary = raster.rasterize_uv(template.load(), size)
    position = raster.interpolate(template.load().vertices, template.load().faces, face, bary).astype(np.float32)
    return there, raster.bleed(position, face >= 0), template.mask("face", size) > 0.9


def round_trip(there: layout.Layout, albedo: np.ndarray, normal: np.ndarray) -> Maps:
    """Maps of the built-in UVs taken to the window's and returned."""
    size, other = len(albedo), there.there.covered.shape
    gone = {
        name: there._there(torch.from_numpy(m.transpose(2, 0, 1).copy())).permute(1, 2, 0).numpy()
        for name, m in (("diffuse", albedo),)
    }
    flat = np.ones(other, np.float32)
    solved = Maps(
        gone["diffuse"],
        flat,
        layout.baking.bake_normals(normal, there.there),
        np.repeat(flat[..., None], 3, 2),
        flat,
        torch.ones(3),
    )
    ones = torch.ones(size, size)
    up = torch.zeros(3, size, size)
    up[2] = 1
    e = layout.Evidence(
        torch.zeros(3, size, size), *[0 * ones] * 2, up, ones > 0, ones, ones, ones, *[0 * ones] * 2, ones, 0 * ones
    )
    return there.returned(
        solved,
        e,
        Lights(torch.ones(3, 9), torch.zeros(1, 9, 1, 1), torch.ones(3)),
        1.0,
        torch.from_numpy(TONE),
    )


def test_a_smooth_map_survives_both_ways(carried):
    """Stated: within 0.01 of a range of 0.6 at 256 texels, for a wave of about 60 mm; a normal map within half a
    degree, though the chart is turned."""
    there, position, inner = carried
    wave = (0.5 + 0.3 * np.sin(position @ np.array([[95.0, 40, 0], [0, 80, 60], [60, 0, 90]]).T)).astype(np.float32)
    tilted = np.stack([0.3 * np.sin(40 * position[..., 2]), np.full(wave.shape[:2], 0.25), np.ones(wave.shape[:2])], -1)
    tilted = (tilted / np.linalg.norm(tilted, axis=-1, keepdims=True) / 2 + 0.5).astype(np.float32)
    back = round_trip(there, wave, tilted)
    assert there.back.known[inner].mean() > 0.98 and there.fits(template.mask("skin", 256) * inner)
    error = np.abs(back.diffuse - wave)[inner].max(-1)
    assert np.percentile(error, 99) < 0.01, np.percentile(error, [50, 99, 100])
    cosine = ((back.normal * 2 - 1) * (tilted * 2 - 1)).sum(-1)[inner]
    angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    assert np.median(angle) < 0.5 and np.percentile(angle, 95) < 2
    assert np.percentile(back.confidence[inner], 5) > 0.9 and back.confidence[~there.back.known].max() == 0


def test_the_prior_is_asked_in_its_own_window_and_coordinates(carried):
    there, position, _ = carried
    assert there.there.covered.shape == (192, 192)
    bridge = layout._box(layout.TONE_BOX, 192) > 0
    assert bridge.sum() == pytest.approx(110 * 84 * (192 / 768) ** 2, rel=0.05)
    at = there._there(torch.from_numpy(position.transpose(2, 0, 1).copy()))[:, bridge].mean(1)
    face, bary = template.landmarks()
    head = template.load()
    wanted = (head.vertices[head.faces[face[[6, 197]]]] * bary[[6, 197], :, None]).sum(1).mean(0)
    assert np.linalg.norm(at.numpy() - wanted) < 0.006
    assert layout.round_size(1024, 8) == 1024 and layout.round_size(500, 8) == 480
    assert layout.round_size(1024, 64) * 3 / 4 % 64 == 0


@pytest.mark.parametrize("recipe", ["wildcap", "released"])
def test_the_stage_solves_with_it_and_answers_in_the_built_in_uvs(capture, authors, recipe, monkeypatch):
    monkeypatch.setitem(solve.RECIPES, "released", replace(solve.RECIPES["released"], steps=6, candidates=2, zeta=0.1))
    kept = seen_layouts(monkeypatch)
    solve.run(capture, settings(authors, recipe=recipe), Reporter("solve"))
    for name in MAPS:
        values = images.read_data(capture.maps / name)
        assert values.shape[:2] == (SIZE, SIZE) and np.isfinite(values).all(), name
    albedo, shading = (images.read_linear(capture.maps / f"{name}.exr") for name in ("diffuse_albedo", "shading"))
    texture = images.read_linear(capture.texture)
    face = template.mask("face", SIZE) > 0.9
    normal = images.read_data(capture.maps / "normal.png")[..., :3] * 2 - 1
    assert np.abs(np.linalg.norm(normal, axis=-1) - 1).max() < 0.01
    if recipe == "released":  # the tone is that of their box, by the mean of sRGB values
        uv = kept[0].back.uv
        row, column = (1 - uv[..., 1]) * 768 + 64, uv[..., 0] * 768 + 128
        box = (row > 289) & (row < 399) & (column > 470) & (column < 554)
        assert box.sum() > 20
        assert np.abs((albedo[box] ** (1 / 2.2)).mean(0) / TONE ** (1 / 2.2) - 1).max() < 0.03
    else:
        off = np.abs(albedo * shading - texture)[face].mean()
        assert off < 0.05 * texture[face].mean(), "the texture is explained where it was"
        brows, cheeks = template.mask("brows", SIZE) > 0.7, (template.mask("skin", SIZE) > 0.9) & face
        assert albedo[brows].mean() < 0.9 * albedo[cheeks].mean(), "brows are where brows are"
        skin = template.mask("skin", SIZE) * template.mask("face", SIZE) * (1 - template.mask("eyes", SIZE))
        assert np.abs((albedo * skin[..., None]).sum((0, 1)) / skin.sum() / TONE - 1).max() < 0.03


def test_without_the_other_head_or_with_other_uvs_it_says_what_to_do(capture, authors):
    put_own_head(capture, other_head(180.0))
    with pytest.raises(Problem, match="not those the authors' prior was trained in"):
        solve.run(capture, settings(authors), Reporter("solve"))
    capture.own_head.unlink()
    with pytest.raises(Problem, match="none was fitted") as found:
        solve.run(capture, settings(authors), Reporter("solve"))
    assert "--template" in found.value.remedy
    with pytest.raises(Problem, match="does not describe a prior"):
        solve.run(capture, settings(capture.root), Reporter("solve"))


def test_another_checkpoint_or_head_makes_the_stage_stale_but_only_with_that_prior(capture, authors):
    stage = stages.by_name("solve")

    def change(prior, edit) -> tuple[str, ...]:
        record(capture, stage, settings(prior))
        edit()
        return changed(capture, stage, settings(prior))

    def edit_config():
        (authors / "config.json").write_text((authors / "config.json").read_text() + "\n")

    assert change("", lambda: put_own_head(capture, other_head(5.0))) == change("", edit_config) == ()
    assert change(authors, lambda: put_own_head(capture, other_head(6.0))) == ("own_head.obj",)
    assert change(authors, edit_config) == ("solve.prior",)


def test_our_weights_are_named_where_no_prior_is_chosen():
    assert from_json({}).solve.prior == "" and WEIGHTS.is_file()
