# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""After a mask edit only the touched part is solved again: the rest stays bit by bit, and whatever makes that
impossible is said."""

import shutil
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import torch

from core.capture import mask_edit
from core.capture.capture import Capture
from core.capture.messages import CancelledError
from core.capture.stages import MAPS
from core.imaging import images
from core.stages.solve.window import find_window
from tests.fixtures import painted_skin
from tests.fixtures.painted_skin import make, solved

EDIT = (slice(60, 68), slice(40, 50))
settings = partial(painted_skin.settings, steps=5)


@pytest.fixture(scope="module", autouse=True)
def same_code():
    """The sources may be edited while the tests run."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mask_edit, "code_key", lambda module: "now")
        yield


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Capture:
    """A solved capture with a second shadow that the mask misses, at EDIT."""
    capture = make(tmp_path_factory.mktemp("solved") / "a.wildcap")
    texture = images.read_linear(capture.texture)
    texture[EDIT] *= 0.5
    images.write_linear(capture.texture, texture)
    solved(capture, settings())
    return capture


@pytest.fixture
def capture(whole, tmp_path) -> Capture:
    shutil.copytree(whole.root, tmp_path / "b.wildcap")
    return Capture(tmp_path / "b.wildcap")


def paint(capture: Capture, *where: tuple[slice, slice]) -> None:
    mask = images.read_mask(capture.shadow_mask_auto)
    for region in where:
        mask[region] = 1
    images.write_data(capture.shadow_mask, mask)


def solve_part(capture: Capture, **options) -> list[str]:
    """Solves the edited part, or the whole where it must; what was said until then."""
    return solved(capture, settings(edited_part=True, **options))


def maps_of(capture: Capture) -> dict[str, np.ndarray]:
    return {name: images.read_data(capture.maps / name) for name in MAPS}


def test_an_edit_changes_its_window_and_nothing_else_and_edits_add_up(capture, tmp_path):
    before = maps_of(capture)
    paint(capture, EDIT)
    twin = Capture(tmp_path / "twin.wildcap")
    shutil.copytree(capture.root, twin.root)
    said = solve_part(capture)
    assert any("were solved again" in line for line in said) and not any("whole map" in line for line in said), said
    after = maps_of(capture)
    margin = 16  # 64 texels of a 1024 map are 8 here; the mask's soft border and whole cells add some
    around = tuple(slice(s.start - margin, s.stop + margin) for s in EDIT)
    for name in MAPS:
        changed = (before[name] != after[name]).any(-1)
        if name != "specular_albedo.png":  # what is expected of skin there, whatever the mask
            assert changed[EDIT].mean() > 0.5, name
        changed[around] = False
        assert not changed.any(), name
    albedo, old = after["diffuse_albedo.exr"], before["diffuse_albedo.exr"]
    assert albedo[EDIT].mean() > 1.1 * old[EDIT].mean(), "the shadow is taken out now"
    solve_part(twin)
    assert all((capture.maps / p.name).read_bytes() == p.read_bytes() for p in twin.maps.iterdir())
    paint(capture, EDIT, (slice(90, 96), slice(60, 68)))
    assert any("were solved again" in line for line in solve_part(capture))
    assert all((after[name][EDIT] == maps_of(capture)[name][EDIT]).all() for name in MAPS)


def test_without_an_edit_nothing_is_touched(capture):
    before = {path: path.stat().st_mtime_ns for path in capture.maps.iterdir()}
    assert any("nothing was solved" in line for line in solve_part(capture))
    assert before == {path: path.stat().st_mtime_ns for path in capture.maps.iterdir()}


def spoil_texture(capture: Capture) -> None:
    images.write_linear(capture.texture, images.read_linear(capture.texture) * 0.9)


def cut_off(capture: Capture) -> None:
    capture.solved.write_bytes(capture.solved.read_bytes()[:20000])


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (spoil_texture, "Texture.exr changed"),
        (cut_off, "What the last solve left behind is damaged"),
        (lambda capture: paint(capture, (slice(0, 128), slice(0, 128))), "The edit touches"),
    ],
)
def test_what_cannot_be_solved_in_part_is_solved_whole_and_says_why(capture, spoil, reason):
    paint(capture, EDIT)
    spoil(capture)
    with pytest.raises(CancelledError):  # the test has heard enough once that solve begins
        solved(capture, settings(edited_part=True), until=f"The whole map is solved. {reason}")


def test_the_add_on_can_tell_without_torch(capture):
    assert mask_edit.obstacle(capture, settings()) == ""
    paint(capture, EDIT)
    assert mask_edit.obstacle(capture, settings()) == ""
    assert "settings" in mask_edit.obstacle(capture, settings(steps=7))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mask_edit, "code_key", lambda module: "a later version's")
        assert "code changed" in mask_edit.obstacle(capture, settings())
    assert "No solve" in mask_edit.obstacle(Capture(Path("/no/such/capture")), settings())


def test_windows_lie_on_whole_cells_and_stay_in_the_map():
    before, now = torch.zeros(256, 256), torch.zeros(256, 256)
    now[:9, 100:110] = 1
    part = find_window(before, now, (64, 64), 8, 256)
    assert part.inside == (slice(0, 76), slice(36, 176))
    assert all(s.start % 32 == 0 and s.stop % 32 == 0 and 0 <= s.start < s.stop <= 256 for s in part.context)
    moving = torch.nonzero(part.moving)
    assert moving[:, 0].min() == 0, "at the map's border nothing else is read"
    column = (moving[:, 1].min() + part.cells[1].start).item()
    assert (column - 1.5) * 4 >= 36 > (column - 2.5) * 4
    assert find_window(now, now, (64, 64), 8, 256) is None
    with pytest.raises(ValueError, match="does not divide"):
        find_window(before, now, (60, 60), 8, 256)
