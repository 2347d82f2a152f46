# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the head was made from, in Blender's scene: cameras that see what the frames saw, and the scan."""

import struct

import pytest

from tests.fixtures import standin
from tests.fixtures.refused import refuses
from tests.fixtures.standin import CENTRE, FOCAL, HEIGHT, WIDTH

bpy = pytest.importorskip("bpy")
from bpy_extras.object_utils import world_to_camera_view  # noqa: E402
from mathutils import Matrix, Quaternion, Vector  # noqa: E402

POSES = {name: (Quaternion(turn).normalized(), Vector(move)) for name, (turn, move) in standin.POSES.items()}


@pytest.fixture
def reconstructed(capture):
    """A capture with its frames, cameras and scan."""
    standin.add_evidence(capture)
    return capture


def cameras():
    return {o.name: o for o in bpy.context.scene.objects if o.type == 'CAMERA'}


def seen(thing, point) -> tuple[float, float]:
    """Pixel of the frame at which Blender's camera shows a world point, rows from the top."""
    x, y, _ = world_to_camera_view(bpy.context.scene, thing, Vector(point))
    render = bpy.context.scene.render
    rows = WIDTH * render.resolution_y / render.resolution_x  # the sensor is as wide as the frame, whatever is rendered
    return x * WIDTH, HEIGHT / 2 - (y - 0.5) * rows


@pytest.mark.parametrize("resolution", [(720, 960), (1920, 1080), (500, 1000)])
def test_cameras_see_points_where_the_frames_saw_them(addon, reconstructed, resolution):
    bpy.context.scene.render.resolution_x, bpy.context.scene.render.resolution_y = resolution
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.bring_in_cameras(every=True)
    assert len(cameras()) == 3
    bpy.context.view_layer.update()
    for (turn, move), thing in zip(POSES.values(), cameras().values(), strict=True):
        for point in ((0, -0.1, 0), (0.05, -0.06, 0.08), (-0.07, 0.02, -0.1)):
            local = turn.to_matrix() @ Vector(point) + move
            expected = FOCAL * local.x / local.z + CENTRE[0], FOCAL * local.y / local.z + CENTRE[1]
            assert seen(thing, point) == pytest.approx(expected, abs=0.02)
        behind = thing.data.background_images[0]
        assert thing.data.show_background_images and behind.image.filepath.endswith(thing.name.split()[-1])
        assert behind.frame_method == ('FIT' if resolution[0] / resolution[1] < WIDTH / HEIGHT else 'CROP')


def test_cameras_and_scan_come_in_again_in_place_and_go_with_the_head(addon, reconstructed, head):
    for _ in range(2):
        bpy.ops.wildcap.bring_in_cameras()
        bpy.ops.wildcap.bring_in_scan()
    filmed = sorted(name.split()[-1] for name in cameras())
    assert filmed == ["00000.jpg", "00002.jpg"], "those the texture is made from"
    assert len(bpy.data.cameras) == 2 and [c.name for c in bpy.data.collections] == ["head Cameras"]
    (scan,) = (o for o in bpy.context.scene.objects if o.name.endswith("Scan"))
    assert len(scan.data.vertices) == 4 and scan.data.vertices[0].co.y == pytest.approx(-0.1)
    assert bpy.context.view_layer.objects.active == head and head.select_get() and not scan.select_get()
    before = {thing: thing.matrix_world.copy() for thing in (*cameras().values(), scan)}
    head.matrix_world = Matrix.Translation((1, 2, 3))
    bpy.context.view_layer.update()
    for thing, matrix in before.items():
        moved = thing.matrix_world.translation - matrix.translation
        assert tuple(moved) == pytest.approx((1, 2, 3), abs=1e-5), thing.name
    assert addon("captures").active(bpy.context).path == str(reconstructed)


def test_a_copy_of_a_camera_is_the_artists_and_stays_and_the_scene_keeps_its_frame(reconstructed):
    bpy.ops.wildcap.bring_in_cameras()
    last = list(cameras().values())[-1]
    scene, name = bpy.context.scene, last.name
    copies = [last.copy(), last.copy()]
    copies[1].data = last.data.copy()
    for copy in copies:
        scene.collection.objects.link(copy)
    scene.camera = last
    mine = [copy.name for copy in copies]
    bpy.ops.wildcap.bring_in_cameras()
    assert len(cameras()) == 4 and all(bpy.data.objects[each].data is not None for each in mine)
    assert scene.camera.name not in mine and scene.camera.name.startswith(name)


def test_what_is_tied_to_a_camera_stays_so_when_the_cameras_come_in_again(reconstructed):
    bpy.ops.wildcap.bring_in_cameras(every=True)
    scene, (kept, *_) = bpy.context.scene, cameras().values()
    marker = scene.timeline_markers.new("cut", frame=5)
    marker.camera = scene.camera = kept
    follower = bpy.data.objects.new("Follower", None)
    scene.collection.objects.link(follower)
    constraint = follower.constraints.new('COPY_TRANSFORMS')
    constraint.target = kept
    lens, matrix = kept.data.lens, kept.matrix_basis.copy()
    kept.data.lens, kept.matrix_basis = 200, Matrix.Translation((1, 2, 3))
    images = len(bpy.data.images)
    bpy.ops.wildcap.bring_in_cameras()
    assert marker.camera == scene.camera == constraint.target == kept
    assert kept.data.lens == pytest.approx(lens) and kept.matrix_basis == matrix
    assert sorted(cameras()) == ["head 00000.jpg", "head 00002.jpg"] and len(bpy.data.cameras) == 2, "the others went"
    assert len(kept.data.background_images) == 1 and len(bpy.data.images) == images
    bpy.ops.wildcap.bring_in_cameras(every=True)
    assert len(cameras()) == 3 and [c.name for c in bpy.data.collections] == ["head Cameras"]


def test_the_scan_comes_in_again_while_the_old_one_is_active(reconstructed):
    bpy.ops.wildcap.bring_in_scan()
    scan = next(o for o in bpy.context.scene.objects if o.name.endswith("Scan"))
    bpy.context.view_layer.objects.active = scan
    scan.select_set(True)
    bpy.ops.wildcap.bring_in_scan()
    assert bpy.context.view_layer.objects.active.name.endswith("Scan")


def test_nothing_comes_in_while_painting_or_from_damaged_cameras(reconstructed):
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.paint_mask()
    assert not bpy.ops.wildcap.bring_in_cameras.poll() and not bpy.ops.wildcap.bring_in_scan.poll()
    bpy.ops.wildcap.finish_mask()
    (reconstructed / "cameras" / "images.bin").write_bytes(b"\3\0\0\0\0\0\0\0short")
    refuses("cannot be read", bpy.ops.wildcap.bring_in_cameras)
    (reconstructed / "cameras" / "images.bin").unlink()
    refuses("no cameras yet", bpy.ops.wildcap.bring_in_cameras)
    assert not cameras()


def write_cameras(folder, name: bytes = b"00000.jpg", focal: float = 900.0, width: int = 720, count: int = 1) -> None:
    camera = struct.pack("<iiQQ3d", 1, 0, width, 960, focal, 360, 480)
    (folder / "cameras.bin").write_bytes(struct.pack("<Q", count) + camera)
    pose = struct.pack("<Qi7dI", count, 1, 1, 0, 0, 0, 0, 0, 1, 1)
    (folder / "images.bin").write_bytes(pose + name + b"\0" + struct.pack("<Q", 0))


def test_cameras_that_are_damaged_or_a_stranger_s_are_refused(addon, tmp_path):
    read = addon("reconstruct.colmap_cameras").read
    write_cameras(tmp_path)
    assert [camera.name for camera in read(tmp_path)] == ["00000.jpg"]
    for spoiled in (
        {"name": b"../../private/x.jpg"},
        {"focal": float("nan")},
        {"focal": 0.0},
        {"width": 2**40},
        {"width": 0},
        {"count": 2**60},
        {"name": b"\xff.jpg"},
    ):
        write_cameras(tmp_path, **spoiled)
        refuses("cannot be read", read, tmp_path)
