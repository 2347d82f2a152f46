# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist painted is in every delivery, or the delivery is refused; the provenance names the layers by hash."""

import json
import shutil

import numpy as np
import pytest

from core.capture import retouch_edits, retouch_layers, stages
from core.capture.capture import Capture
from core.capture.messages import Done, Failed
from core.imaging import images
from core.settings.settings import from_json
from tests.fixtures import delivered, recorded
from tests.fixtures.delivered import OBJ, SIDE, folder

SPOT = (0.5, 0.1, 0.15)


@pytest.fixture
def capture(tmp_path) -> Capture:
    """A solved head with a layer whose spot is in maps_retouched."""
    made = delivered.make(tmp_path / "Zoë et moi.wildcap")
    images.write_linear(made.maps / "shading.exr", np.ones((SIDE, SIDE, 3), np.float32))
    for target, stage in ((made.maps_4k, "upscale"), (made.maps_retouched, "retouch")):
        shutil.copytree(made.maps, target)
        if stage == "retouch":
            layer = retouch_edits.add_layer(made, "Her secret", "albedo")
            images.write_packed(retouch_layers.picture_of(made, layer), np.zeros((256, 256, 4), np.float32), bits=16)
            for name in ("diffuse_albedo.png", "diffuse_albedo.exr"):
                albedo = images.read_srgb(target / name)
                albedo[4:8, 4:8] = SPOT
                write = images.write_linear if name.endswith("exr") else images.write_srgb
                write(target / name, images.srgb_to_linear(albedo) if name.endswith("exr") else albedo, **BITS[name])
        recorded.record(made, stages.by_name(stage), from_json({"retouch": {"layer": "Her secret"}}))
    return made


BITS = {"diffuse_albedo.png": {"bits": 16}, "diffuse_albedo.exr": {}}


@pytest.mark.parametrize(
    ("preset", "name"),
    [
        ("blender", "Zoe_et_moi_albedo.png"),
        ("unreal", "T_Zoe_et_moi_BaseColor.png"),
        ("metahuman", "T_Zoe_et_moi_Color.png"),
        ("unity_hdrp", "Zoe_et_moi_BaseMap.png"),
        ("character_creator", "Zoe_et_moi_Diffuse.png"),
        ("arnold", "Zoe_et_moi_base_color.1001.exr"),
    ],
)
def test_every_preset_has_the_spot_and_the_rest_as_without_it(capture, preset, name):
    assert isinstance(delivered.deliver(capture, preset=preset, **OBJ), Done)
    got = images.read_srgb(folder(capture, preset=preset) / "textures" / name)
    assert np.abs(got[4:8, 4:8] - SPOT).max() < 4e-3
    without = images.read_srgb(capture.maps_4k / "diffuse_albedo.png")
    without[4:8, 4:8] = got[4:8, 4:8]
    assert np.abs(got - without).max() < 4e-3
    told = json.loads((folder(capture, preset=preset) / "provenance.json").read_text(encoding="utf-8"))["retouch"]
    assert [sorted(layer) for layer in told] == [["keeps_colours", "map", "opacity", "sha256"]]
    assert "secret" not in (folder(capture, preset=preset) / "provenance.json").read_text(encoding="utf-8")


def test_a_layer_that_is_not_in_the_maps_yet_stops_the_delivery(capture):
    layer = retouch_layers.read_layers(capture)[0]
    retouch_edits.change_layer(capture, layer.file, opacity=0.5)
    stopped = delivered.deliver(capture, **OBJ)
    assert isinstance(stopped, Failed) and "Retouch is out of date" in stopped.problem
    capture.forget(["retouch"])
    stopped = delivered.deliver(capture, **OBJ)
    assert isinstance(stopped, Failed) and "not in the maps yet" in stopped.problem
    retouch_edits.change_layer(capture, layer.file, visible=False)
    shutil.rmtree(capture.maps_retouched)
    assert isinstance(delivered.deliver(capture, **OBJ), Done), "a hidden layer hinders nothing"
