# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Compare the upscaling network with Lanczos on subjects that no training saw, and measure what the frames add.

    python -m research.benchmarks.maps.upscale [--work DIR] [--json FILE]
                                 [--picture docs/pictures/upscale.jpg]

enlarging: windows of the benchmark's subjects painted at 4096, reduced to 1024 as they are (plain) and softened as a
solver leaves them (soft). PSNR, SSIM per map, FLIP and the distance in EfficientNet-Lite0's features (not LPIPS) for
the diffuse, the mean angle in degrees for the normals. frames: a subject filmed closely by known cameras in even light;
what stage texture finds in the frames goes into the enlarged albedo. Besides PSNR and SSIM at 2048, pores is the
correlation with the truth of what is finer than a texel of the 1024 map, moles the share of their depth that is left in
it. cost: 1024 to 4096 in a process of its own, seconds and peak memory.
"""

import resource
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import cv2
import numpy as np
from flip_evaluator import evaluate as flip_evaluate
from skimage.metrics import structural_similarity

from core.capture.capture import Capture
from core.capture.files import replacing_folder
from core.capture.messages import Reporter
from core.face import template
from core.geometry import meshes, raster
from core.imaging import images
from core.settings.settings import Settings
from core.stages import texture
from core.stages.upscale import detail, enlarged
from core.stages.upscale.maps import HeadMaps

from ...people.identities import subject_mesh
from ...people.painted_head import place_camera
from ...people.parameters import sample_parameters
from ...people.skin import make_skin
from ...training.fine_windows import CHANNELS, FACTOR, Degradation, degraded, prepare
from ..captures.shadow_captures import render_picture, write_views
from ..figures import command_line, markdown, write_record
from ..measures.table import mean_of
from ..pictures.sheet import in_rows
from .ablation_measures import feature_distance
from .detail import moles

SEEDS, FILMED = (900001, 900003, 900004, 900005, 900007, 900008), (900003,)
"""Reserved subjects: nothing is trained on them."""
VIEWS = 2
"""Windows of each subject."""
KINDS = {"plain": Degradation(0.0, 0.0, 0.0, 1.0), "soft": Degradation(0.5, 0.8, 0.003, 0.9)}
METHODS = ("lanczos", "network")
BORDER = 16
CLOSE = 9.0
"""Scale of the frames: 2700 x 3600 pixels, about a 4K video's."""


def main() -> None:
    parser = command_line(__doc__, "upscale")
    parser.add_argument("--work", type=Path, default=Path(tempfile.gettempdir()) / "wildcap_upscale_benchmark")
    parser.add_argument("--picture", type=Path, help="close-ups of small map, Lanczos, network and truth side by side")
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    found = {"enlarging": enlarging(options.work, options.picture), "frames": from_frames(options.work)}
    # each in a fresh process, whose peak is its own
    with ProcessPoolExecutor(1, mp_context=get_context("spawn"), max_tasks_per_child=1) as pool:
        found["cost"] = dict(zip(METHODS, pool.map(cost, METHODS), strict=True))
    record = {}
    for part, rows in found.items():
        columns = next(iter(rows.values()))
        lines = [[row, *(f"{values[column]:.4g}" for column in columns)] for row, values in rows.items()]
        print(markdown([part, *columns], lines), end="\n\n")
        record[part] = {
            row.replace("lanczos", "Lanczos"): {key.lower().replace(" ", "_"): value for key, value in values.items()}
            for row, values in rows.items()
        }
    write_record(options.json, "upscale", "python -m research.benchmarks.maps.upscale", record, keep=True)


def enlarging(work: Path, sheet: Path | None = None) -> dict[str, dict[str, float]]:
    """Return figures per kind of reduction and method, means over the subjects' windows."""
    prepare(list(SEEDS), VIEWS, work, Reporter("upscale"), 1)
    rows, shots = {}, []
    for kind, how in KINDS.items():
        for seed, view in ((seed, view) for seed in SEEDS for view in range(VIEWS)):
            large = np.load(work / f"window_{seed}_{view}.npy").astype(np.float32)
            small, true = degraded(large, how, np.random.default_rng([seed, view])), np.moveaxis(large, 0, -1)
            results = {method: _enlarged(small, method) for method in METHODS}
            for method, result in results.items():
                rows.setdefault(f"{kind}, {method}", []).append(compare(result, true))
            if view == 0 and kind == "soft":
                shots.append(_closeup(small, results, true))
    if sheet:
        images.write_srgb(sheet, in_rows(shots[:4], 2), quality=86)
    return {name: rounded_mean(found) for name, found in rows.items()}


def compare(result: np.ndarray, true: np.ndarray) -> dict[str, float]:
    """Return the figures of enlarged maps [H, W, 7] (sRGB diffuse, unit normal, specular) against true ones."""
    result, true = (maps[BORDER:-BORDER, BORDER:-BORDER] for maps in (result, true))
    figures = {}
    for name, channels in (("diffuse", slice(0, 3)), ("specular", slice(6, 7)), ("normal", slice(3, 6))):
        one, other = (
            maps[..., channels] * (0.5 if name == "normal" else 1) + (0.5 if name == "normal" else 0)
            for maps in (result, true)
        )
        figures[f"{name} PSNR"] = float(-10 * np.log10(np.mean((one - other) ** 2)))
        figures[f"{name} SSIM"] = float(structural_similarity(one, other, channel_axis=2, data_range=1.0))
    diffuse, true_diffuse = (np.ascontiguousarray(maps[..., :3]) for maps in (result, true))
    flip, _, _ = flip_evaluate(true_diffuse, diffuse, "LDR", applyMagma=False, computeMeanError=False)
    figures["diffuse FLIP"] = float(np.mean(flip))
    if (distance := feature_distance(diffuse, true_diffuse)) is not None:
        figures["diffuse features"] = float(distance.mean())
    ours, theirs = result[..., 3:6], true[..., 3:6]
    lengths = np.linalg.norm(ours, axis=-1) * np.linalg.norm(theirs, axis=-1)
    cosine = (ours * theirs).sum(-1) / np.maximum(lengths, 1e-6)
    figures["normal degrees"] = float(np.degrees(np.arccos(np.clip(cosine, -1, 1))).mean())
    return figures


def cost(method: str, size: int = 1024) -> dict[str, float]:
    """Return seconds and peak memory in GiB of enlarging maps of that size, in this process."""
    rng, blank = np.random.default_rng(0), np.ones((size, size, 3), np.float32)
    maps = HeadMaps(
        rng.random((size, size, 3), np.float32),
        blank / np.sqrt(3),
        rng.random((size, size), np.float32),
        blank[..., 0],
        blank,
        blank[..., 0],
    )
    began = time.monotonic()
    enlarged(maps, FACTOR * size, method, "cpu", lambda done: None)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    return {"seconds": round(time.monotonic() - began, 1), "peak GiB": round(peak / 2**30, 2)}


def _enlarged(small: np.ndarray, method: str) -> np.ndarray:
    """Return maps [7, H, W] in the network's channels, four times as large: [4H, 4W, 7]."""
    diffuse, normal = images.srgb_to_linear(np.moveaxis(small[:3], 0, -1)), np.moveaxis(small[3:6], 0, -1)
    blank = np.ones_like(diffuse)
    maps = HeadMaps(diffuse, normal, small[6], blank[..., 0], blank, blank[..., 0])
    return enlarged(maps, FACTOR * len(diffuse), method, "cpu", lambda done: None)


def _closeup(small: np.ndarray, results: dict[str, np.ndarray], true: np.ndarray, side: int = 176) -> np.ndarray:
    """Return small map, methods and truth side by side, diffuse above normals, where the truth has most detail."""
    log = cv2.GaussianBlur(np.abs(cv2.Laplacian(true[..., 1], cv2.CV_32F)), (0, 0), side / 4)[side:-side, side:-side]
    row, column = (int(at) + side // 2 for at in np.unravel_index(log.argmax(), log.shape))
    nearest = np.repeat(np.repeat(np.moveaxis(small, 0, -1), FACTOR, 0), FACTOR, 1)
    parts = [maps[row : row + side, column : column + side] for maps in (nearest, *results.values(), true)]
    both = np.vstack(
        [np.hstack([part[..., :3] for part in parts]), np.hstack([part[..., 3:6] * 0.5 + 0.5 for part in parts])]
    )
    return np.pad(both, ((0, 8), (0, 8), (0, 0)), constant_values=1)


def from_frames(work: Path) -> dict[str, dict[str, float]]:
    """Return the figures of each method without and with the frames' own detail, means over the subjects."""
    rows: dict[str, list] = {}
    for seed in FILMED:
        capture, true = filmed(seed, work / f"filmed_{seed}.wildcap")
        solved = degraded(_stacked(true), replace(KINDS["soft"], relief=1.0), np.random.default_rng(seed))
        visible = cv2.resize(images.read_mask(capture.texture_confidence), (len(true),) * 2) > 0.5
        visible &= template.mask("face", 1024).repeat(2, 0).repeat(2, 1) > 0.5
        for method in METHODS:
            plain = images.resize(_enlarged(solved, method)[..., :3], *true.shape[1::-1])
            guided = plain.copy()
            detail.guide(guided, images.read_data(capture.texture_detail), 1024, lambda done: None)
            for name, albedo in ((method, plain), (f"{method}, with the frames", guided)):
                rows.setdefault(name, []).append(_fine_figures(albedo, true, visible))
    return {name: rounded_mean(found) for name, found in rows.items()}


def rounded_mean(rows: list[dict[str, float]]) -> dict[str, float]:
    return {figure: round(value, 4) for figure, value in mean_of(rows).items()}


def filmed(seed: int, folder: Path) -> tuple[Capture, np.ndarray]:
    """Return a reserved subject's capture in even light with its texture, and its albedo, sRGB [2048, 2048, 3]."""
    capture = Capture(folder)
    if not (capture.root / "truth.png").is_file():
        mesh, rng = subject_mesh(seed), np.random.default_rng([seed, 50])
        true = make_skin(sample_parameters(seed), 2048).diffuse
        views = [place_camera(azimuth, 0.0, scale=CLOSE) for azimuth in (-45, -25, -8, 8, 25, 45)]
        caster = raster.RayCaster(mesh)
        write_views(capture, views, (render_picture(caster, view, 0.8 * true, rng, rays=1) for view in views))
        meshes.write_obj(capture.head, mesh)  # the true head: an error of its place would be measured, not the detail
        with replacing_folder(capture.delit) as delit:
            for path in sorted(capture.frames.glob("*.jpg")):
                images.write_srgb(delit / f"{path.stem}.png", images.read_srgb(path))
        texture.run(capture, Settings(), Reporter("texture"))
        images.write_srgb(capture.root / "truth.png", images.linear_to_srgb(true), bits=16)
    return capture, images.read_srgb(capture.root / "truth.png")


def _stacked(srgb: np.ndarray) -> np.ndarray:
    """Return the network's channels [7, 4096, 4096] of an albedo at 2048 on smooth skin."""
    maps = np.zeros((CHANNELS, 4096, 4096), np.float32)
    maps[:3] = srgb.repeat(2, 0).repeat(2, 1).transpose(2, 0, 1)
    maps[5], maps[6] = 1, 0.35
    return maps


def _fine_figures(albedo: np.ndarray, true: np.ndarray, observed: np.ndarray) -> dict[str, float]:
    inner = cv2.erode(observed.astype(np.uint8), np.ones((25, 25))) > 0
    _, ssim = structural_similarity(albedo, true, channel_axis=2, data_range=1.0, full=True)
    logs = [np.log(np.maximum(images.srgb_to_linear(picture)[..., 1], 2e-3)) for picture in (albedo, true)]
    fine, true_fine = (log - cv2.GaussianBlur(log, (0, 0), 2.0) for log in logs)
    spots, true_spots = (cv2.GaussianBlur(log, (0, 0), 0.7) - cv2.GaussianBlur(log, (0, 0), 4.0) for log in logs)
    near = np.zeros(inner.shape, bool)
    for row, column in moles(true_spots, inner & (template.mask("brows", 1024) < 0.1).repeat(2, 0).repeat(2, 1)):
        near[row - 6 : row + 7, column - 6 : column + 7] = True
    return {
        "PSNR": float(-10 * np.log10(((albedo - true)[inner] ** 2).mean())),
        "SSIM": float(ssim[inner].mean()),
        "pores": float(np.corrcoef(fine[inner], true_fine[inner])[0, 1]),
        "moles": float((spots * true_spots)[near].sum() / (true_spots[near] ** 2).sum()),
    }


if __name__ == "__main__":
    main()
