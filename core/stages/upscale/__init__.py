# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Stage upscale: maps/ becomes maps_4k/, the same names at settings.upscale.size, with the head completed.

Masks of hair, the skin below it, and single hairs come with them. Albedo, normals and specular are enlarged by a
network, or by Lanczos resampling, which adds no detail; light and confidence by resampling. The network takes every
skin in the solver's working tone, so that the detail it adds does not hang on the tone.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from dataclasses import replace

import numpy as np

from ...capture.capture import Capture
from ...capture.files import replacing_folder
from ...capture.messages import Reporter
from ...capture.stages import STRANDS
from ...face.head import read_head
from ...face.shown_parts import read_parts
from ...face.skin_weight import mean_skin
from ...face.strands import Strands
from ...imaging import images
from ...settings.settings import Settings
from ...solver.recipes import OURS
from . import detail, drawing, gloss, grooming, hair
from .maps import HeadMaps, read_maps
from .surface import HeadSurface, lay_out
from .whole_head import DARKEST_LINEAR, complete

# rows that are worked on at once: a whole 4096 map in float32 is 200 MB, and each operation on it would make another
STRIP_ROWS = 256
WRITERS = 2  # maps that are encoded at once: each takes 0.5 GB meanwhile
CROP_SIDE_SHARE = 0.12  # side of the report's picture, as a share of the map
SHARES = {"network": 0.8, "lanczos": 0.3}  # of the time that the enlarging takes


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Write capture.maps_4k, whole or not at all."""
    size, method = settings.upscale.size, settings.upscale.method
    guided = settings.upscale.frames_detail and capture.texture_detail.is_file()
    maps = read_maps(capture.maps, capture.texture_confidence)
    report.figure("method", method)
    report.figure("size_from_px", len(maps.diffuse))
    report.figure("size_px", size)
    report.figure("frames_detail", "used" if guided else "none")
    report.figure("specular_mean", round(gloss.on_cheeks_and_forehead(maps.specular, maps.confidence), 4))
    maps, hair_maps, hairs = _complete_head(capture, maps, settings, report)
    share, check = SHARES[method], report.check
    device = settings.compute_device
    gain = mean_skin(maps.diffuse).clip(DARKEST_LINEAR) / OURS.working_tone
    large = enlarged(maps, size, method, device, lambda done: report.progress(share * done, 1, "enlarging"), gain)
    srgb, normal, specular = large[..., :3], large[..., 3:6], large[..., 6]
    with replacing_folder(capture.maps_4k) as folder:
        if guided:
            band, texture = images.read_data(capture.texture_detail), len(images.read_mask(capture.texture_confidence))
            detail.guide(srgb, band, texture, lambda done: report.progress(share, 1, "fine detail"))
        _write_crop(capture, srgb)

        def write_normal() -> None:
            images.write_data(folder / "normal.png", _mapped(normal, lambda n: n * 0.5 + 0.5), bits=16, check=check)

        def write_linear() -> None:
            images.write_linear(folder / "diffuse_albedo.exr", _mapped(srgb, images.srgb_to_linear), check=check)

        writes = [
            lambda: images.write_srgb(folder / "diffuse_albedo.png", srgb, bits=16, check=check),
            write_normal,
            write_linear,
            lambda: images.write_data(folder / "specular_albedo.png", specular, bits=16, check=check),
            lambda: images.write_data(folder / "confidence.png", _resampled(maps.confidence, size), check=check),
            lambda: images.write_linear(folder / "shading.exr", _resampled(maps.shading, size), check=check),
        ]
        if hair_maps is not None:  # the longest of them begin early
            writes[2:2] = [
                lambda: hair.write(folder, srgb, *hair_maps, check),
                lambda: grooming.write(folder / STRANDS, hairs),
            ]
        _write_together(writes, lambda done: report.progress(share + done * (1 - share), 1, "writing the maps"))
    report.progress(1, 1)


def _complete_head(
    capture: Capture, maps: HeadMaps, settings: Settings, report: Reporter
) -> tuple[HeadMaps, tuple | None, dict[str, Strands]]:
    """Return the maps of the whole head, the hair's masks and skin, and single hairs.

    The second are the masks, the albedo without hair and where that differs; None, and no hairs, if they are not asked
    for.
    """
    options = settings.upscale
    if not (options.whole_head or options.hair):
        return maps, None, {}
    report.progress(0, 1, "laying out the head")
    surface = lay_out(read_head(capture).mesh, len(maps.diffuse), report.check)
    if options.whole_head:
        report.progress(0, 1, "completing neck, ears and scalp")
        before, maps = maps, complete(maps, surface, report, settings.seed)
        picture = drawing.draw_turned(surface, [before, maps])
        images.write_srgb(capture.picture("upscale", "before_and_after_completion"), picture)
    if not options.hair:
        return maps, None, {}
    found, hairs = find_hair(capture, maps, surface, settings.seed, report)
    return maps, found, hairs


def find_hair(
    capture: Capture, maps: HeadMaps, surface: HeadSurface, seed: int, report: Reporter
) -> tuple[tuple[hair.Hair, np.ndarray, np.ndarray], dict[str, Strands]]:
    """Return the hair's masks, the linear albedo without hair [S, S, 3] and where that differs [S, S]; single hairs."""
    report.progress(0, 1, "finding brows, lashes and beard")
    parts = read_parts(capture, surface.size)
    report.figure("hair_told_by", "strokes" if parts is None else "frames and strokes")
    masks = hair.find(maps, surface, parts, report.check)
    report.check()
    cleaned, share = hair.clean(maps, masks, surface, seed, report.check)
    for name in ("brows", "lashes", "beard"):
        report.figure(f"{name}_cm2", round(float((getattr(masks, name) * surface.texel**2).sum()) / 100, 2))
    behind = round(100 * float((masks.hidden * masks.brows).sum() / max(masks.brows.sum(), 1e-6)))
    if behind:
        report.figure("brows_hidden_percent", behind)
        report.log(
            f"Hair covers {behind} % of the brows: there they are grown like the other side, or as brows usually are."
        )
    picture = drawing.draw_masks(maps.diffuse, masks, cleaned)
    images.write_srgb(capture.picture(report.stage, "albedo_hair_skin_below"), picture)
    report.progress(0, 1, "growing hair")
    hairs = grooming.groom(maps, masks, cleaned, surface, seed, check=report.check)
    report.figure("hairs", sum(len(strands.points) for strands in hairs.values()))
    return (masks, cleaned, share), hairs


def enlarged(
    maps: HeadMaps,
    size: int,
    method: str,
    device: str,
    progress: Callable[[float], None],
    gain: np.ndarray | float = 1.0,
) -> np.ndarray:
    """Return diffuse (sRGB), unit normal and specular at another size: float32 [size, size, 7].

    The network makes four times as many texels of a side; more or fewer are resampled. `progress` gets the share done;
    gain, one number or [3], is the factor from the working tone to the albedo's.
    """
    if method == "network" and size > len(maps.diffuse):
        from .enlarge import enlarge  # torch is only needed here

        large = enlarge(replace(maps, diffuse=maps.diffuse / np.float32(gain)), progress, device)
        _map_strips(large[..., :3], lambda srgb: _times(srgb, gain))
        if len(large) == size:
            return large
        return _join(images.srgb_to_linear(large[..., :3]), large[..., 3:6], large[..., 6], size, progress)
    return _join(maps.diffuse, maps.normal, maps.specular, size, progress)


def _times(srgb: np.ndarray, gain: np.ndarray | float) -> np.ndarray:
    """Multiply the linear values of sRGB [H, W, 3] by a gain, one number or [3]."""
    return images.linear_to_srgb(np.clip(images.srgb_to_linear(srgb) * np.float32(gain), 0, 1))


def _join(diffuse: np.ndarray, normal: np.ndarray, specular: np.ndarray, size: int, progress) -> np.ndarray:
    """Resample maps [S, S(, C)], the diffuse linear, to float32 [size, size, 7], the diffuse sRGB."""
    joined = np.empty((size, size, 7), np.float32)
    joined[..., :3], joined[..., 6] = _resampled(diffuse, size), _resampled(specular, size)
    progress(0.6)
    joined[..., 3:6] = _resampled(normal, size)
    progress(1.0)
    _map_strips(joined[..., :3], images.linear_to_srgb)
    _map_strips(joined[..., 3:6], lambda n: n / np.maximum(np.linalg.norm(n, axis=2, keepdims=True), 1e-6))
    return joined


def _resampled(image: np.ndarray, size: int) -> np.ndarray:
    """Resample [H, W(, C)] to [size, size(, C)], within the range of `image`, which Lanczos overshoots at edges."""
    if image.shape[:2] == (size, size):
        return image
    return np.clip(images.resize(image, size, size), image.min(), image.max())


def _write_together(writes: list[Callable[[], None]], tick: Callable[[float], None]) -> None:
    """Run all of them, WRITERS at a time. `tick` gets the share done, and may raise to cancel, as each of them may."""
    with ThreadPoolExecutor(WRITERS) as pool:
        running = [pool.submit(write) for write in writes]
        try:
            pending = set(running)
            while pending:
                pending = wait(running, timeout=0.2, return_when=FIRST_EXCEPTION).not_done
                for ended in set(running) - pending:
                    ended.result()  # raises what it raised
                tick(1 - len(pending) / len(writes))
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def _mapped(image: np.ndarray, operation: Callable) -> np.ndarray:
    """Return a copy with a texel-wise operation applied."""
    image = image.copy()
    _map_strips(image, operation)
    return image


def _map_strips(image: np.ndarray, operation: Callable) -> None:
    """Apply a texel-wise operation in place."""
    for row in range(0, len(image), STRIP_ROWS):
        image[row : row + STRIP_ROWS] = operation(image[row : row + STRIP_ROWS])


def _write_crop(capture: Capture, srgb: np.ndarray) -> None:
    """Write a crop from the middle of the map, texel by texel, for the report."""
    side = int(CROP_SIDE_SHARE * len(srgb))
    start = (len(srgb) - side) // 2
    images.write_srgb(capture.picture("upscale", "crop"), srgb[start : start + side, start : start + side])
