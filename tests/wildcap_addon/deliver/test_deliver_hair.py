# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair that was grown goes along with a USD, as another reader finds it; no other format has it, and nothing of it
stays in the .blend. A close-up's eyes and mouth go along with none."""

from importlib import util

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
pytest.importorskip("OpenImageIO", reason="the worker's part needs its packages")

from tests.fixtures import delivered  # noqa: E402
from tests.wildcap_addon.deliver.test_deliver import (  # noqa: E402, F401  (capture is a fixture)
    by_another_reader,
    capture,
    deliver,
    glb,
)

POINTS = np.array(
    [
        [[0, -0.1, 0.02], [0, -0.103, 0.021], [0, -0.106, 0.023]],
        [[0.01, -0.1, 0.02], [0.01, -0.104, 0.02], [0.011, -0.107, 0.02]],
    ],
    np.float32,
)


@pytest.fixture
def hairy(capture, addon):  # noqa: F811
    """The capture, with two hairs of 0.08 mm on its head."""
    head = bpy.context.view_layer.objects.active
    addon("groom.curves").grow_part(
        bpy.context, head, "brows", POINTS, np.full((2, 3), 4e-5), np.array([[0.02, 0.01, 0.01], [0.04, 0.03, 0.03]])
    )
    return capture


def test_usd_holds_the_hairs_in_their_place_and_thickness(hairy):
    if util.find_spec("pxr") is None or not bpy.app.build_options.usd:
        pytest.skip("no usd-core here, or a Blender without USD")
    folder = deliver(hairy, format="usd")
    read = by_another_reader(folder / "face.usdc")
    ((name, (points, widths)),) = read["hairs"].items()
    assert "brows" in name and np.allclose(points, POINTS.reshape(-1, 3), atol=1e-6)
    assert np.allclose(widths, 8e-5, rtol=1e-3)
    assert len(bpy.data.hair_curves) == 1, "the artist's own"


def test_other_formats_have_the_head_alone(hairy):
    trimesh = pytest.importorskip("trimesh")
    folder = deliver(hairy, format="glb")
    assert len(trimesh.load_scene(folder / "face.glb", process=False).geometry) == 1


def test_a_close_up_stays_with_the_artist(capture):  # noqa: F811
    head = delivered.with_face_units(capture)
    bpy.ops.wildcap.close_up()
    worn = len(head.children)
    document, _ = glb(deliver(capture, format="glb") / "face.glb")
    named = " ".join(material["name"] for material in document["materials"])
    assert len(document["meshes"]) == 1 and "Eyes" in named and "Cornea" not in named, "the plain eyes"
    assert len(document["meshes"][0]["primitives"]) == 4 and len(head.children) == worn and head.modifiers
