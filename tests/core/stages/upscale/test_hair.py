# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair: the masks against the hair that was painted, and the albedo below it against the same skin painted without."""

import numpy as np
import pytest

from core.capture import stages
from core.capture.capture import Capture
from core.capture.messages import Reporter
from core.face import template
from core.geometry import meshes
from core.imaging import images
from core.settings.settings import from_json
from core.stages import upscale
from core.stages.upscale import hair
from core.stages.upscale.maps import HeadMaps
from tests.fixtures.hairy_head import SIZE, painted, surface


@pytest.fixture(scope="module")
def heads() -> dict[str, HeadMaps]:
    """The same skin three times."""
    return {"bearded": painted(beard=1.0), "shaven": painted(), "hairless": painted(brows=0.0)}


@pytest.fixture(scope="module")
def found(heads) -> dict[str, hair.Hair]:
    return {name: hair.find(heads[name], surface()) for name in ("bearded", "shaven")}


def darker(hairy: HeadMaps, bare: HeadMaps) -> np.ndarray:
    """How much the hair takes from the albedo, log, [S, S]."""
    return np.clip(np.log(np.maximum(bare.diffuse, 0.004)) - np.log(np.maximum(hairy.diffuse, 0.004)), 0, None).mean(2)


def alike(a: np.ndarray, b: np.ndarray) -> float:
    face = template.mask("face", SIZE) > 0.5
    return float(np.corrcoef(a[face], b[face])[0, 1])


def test_brows_are_found_where_they_were_painted(heads, found):
    true = darker(heads["shaven"], heads["hairless"])
    brows = found["shaven"].brows
    assert alike(brows, true) > 0.85
    both, either = ((brows > 0.2) & (true > 0.3)).sum(), ((brows > 0.2) | (true > 0.3)).sum()
    assert both > 0.6 * either
    assert brows[template.mask("brows", SIZE) < 0.001].mean() < 1e-3


def test_lashes_lie_along_the_rims_of_the_lids(heads, found):
    lashes = found["shaven"].lashes
    eyes = template.mask("eyes", SIZE)
    assert lashes.max() > 0.5 and (lashes > 0.1)[eyes < 0.05].sum() == 0
    assert (lashes > 0.3).sum() < 0.2 * (eyes > 0.5).sum()


def test_a_beard_is_found_and_a_bare_chin_has_none(heads, found):
    true = darker(heads["bearded"], heads["shaven"])
    assert alike(found["bearded"].beard, true) > 0.6
    assert found["shaven"].beard.max() == 0


def test_the_skin_below_is_nearer_to_the_skin_painted_without_hair(heads, found):
    for name in ("bearded", "shaven"):
        cleaned, share = hair.clean(heads[name], found[name], surface())
        assert cleaned[share == 0].tobytes() == heads[name].diffuse[share == 0].tobytes()
        hairy = darker(heads[name], heads["hairless"]) > 0.05
        hairy &= template.mask("scalp", SIZE) < 0.01
        off = [
            np.abs(
                images.linear_to_srgb(albedo[hairy]) - images.linear_to_srgb(heads["hairless"].diffuse[hairy])
            ).mean()
            for albedo in (heads[name].diffuse, cleaned)
        ]
        assert off[1] < 0.75 * off[0], (name, off)
        assert share[template.mask("lips", SIZE) > 0.9].mean() < 0.02


def test_the_stage_writes_the_masks_and_the_clean_albedo(heads, tmp_path):
    capture, maps = Capture(tmp_path / "é.wildcap"), heads["bearded"]
    meshes.write_obj(capture.head, template.load())
    images.write_linear(capture.maps / "diffuse_albedo.exr", maps.diffuse)
    images.write_data(capture.maps / "normal.png", maps.normal * 0.5 + 0.5, bits=16)
    images.write_data(capture.maps / "specular_albedo.png", maps.specular, bits=16)
    images.write_data(capture.maps / "confidence.png", 0.7 * template.mask("face", SIZE))
    images.write_linear(capture.maps / "shading.exr", maps.shading)
    report = Reporter("upscale")
    upscale.run(capture, from_json({"upscale": {"size": 1024, "method": "lanczos"}}), report)
    masks = {name: images.read_mask(capture.maps_4k / f"{name}.png") for name in ("brows", "lashes", "beard")}
    assert all(mask.shape == (1024, 1024) and mask.max() > 0.3 for mask in masks.values())
    albedo, cleaned = (images.read_data(capture.maps_4k / f"{name}.png") for name in ("diffuse_albedo", "clean_albedo"))
    brow = masks["brows"] > 0.5
    assert cleaned[brow].mean() > albedo[brow].mean() + 0.05 and np.array_equal(cleaned[:20], albedo[:20])
    with np.load(capture.maps_4k / stages.STRANDS, allow_pickle=False) as stored:
        count = sum(len(stored[f"{part}_points"]) for part in ("brows", "lashes", "beard"))
        assert count == report.figures["hairs"] > 1000
    assert report.figures["beard_cm2"] > 1 and report.figures["completed_share_percent"] > 20
    written = {path.name for path in capture.maps_4k.iterdir()}
    assert written == {*stages.MAPS, "brows.png", "lashes.png", "beard.png", "clean_albedo.png", stages.STRANDS}
    assert all(
        capture.picture("upscale", name).is_file() for name in ("before_and_after_completion", "albedo_hair_skin_below")
    )
