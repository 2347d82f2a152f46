# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample head that the painted shadow's measure is taken on is the one that the extension opens."""

import numpy as np

from benchmarks.painted_shadow import sample_head
from core.face.template import ASSETS
from core.geometry import meshes


def test_the_head_has_the_stored_vertices_under_the_built_in_faces(tmp_path):
    stored, built_in = ((ASSETS / name).read_text(encoding="ascii").splitlines(keepends=True)
                        for name in ("sample_head/head_vertices.obj", "head.obj"))
    rest = "".join(line for line in built_in if not line.startswith("v "))
    (tmp_path / "opened.obj").write_text("".join(stored) + rest, encoding="ascii")
    opened, head = meshes.read_obj(tmp_path / "opened.obj"), sample_head()
    assert np.allclose(head.vertices, opened.vertices)
    assert all(np.array_equal(getattr(head, n), getattr(opened, n)) for n in ("faces", "uvs", "face_uvs"))
    width = np.ptp(head.vertices[:, 0])
    assert 0.14 < width < 0.25, "a head, in metres"
