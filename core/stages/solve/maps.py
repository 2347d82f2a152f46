# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Turn the sampler's last state into the maps of the capture folder."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import torch

from ...capture.capture import Capture
from ...capture.files import replacing_folder
from ...capture.messages import Reporter
from ...face import neck, skin_weight
from ...imaging import images
from ...solver.evidence import Evidence
from ...solver.extensions.marks import draw_cover
from ...solver.extensions.split import enlarge_field
from ...solver.objective import Observation, State, albedo, observation_of
from ...solver.solution import Solution
from ...solver.start import Start, mean_tone
from .checkpoint import write_solution
from .confidence import estimate_confidence
from .skin_tone import SkinTone

MIN_ALBEDO = 0.004  # linear albedo below which no skin or hair lies, of skin in the working tone


@dataclass(frozen=True)
class Maps:
    """Maps [S, S(, 3)], float32.

    diffuse and shading: linear, diffuse * shading = I_UV; normal: packed into [0, 1], tangent space, OpenGL Y+;
    specular and confidence: in [0, 1]; gain [3]: factor that brought the albedo, in the working tone, to the skin tone.
    """

    diffuse: np.ndarray
    specular: np.ndarray
    normal: np.ndarray
    shading: np.ndarray
    confidence: np.ndarray
    gain: torch.Tensor


def finish_maps(state: State, evidence: Evidence, start: Start, gain: torch.Tensor | None = None) -> Maps:
    r"""Read the maps out of \hat x_0.

    The albedo leaves the working tone by one gain, after which the mean of the confident facial skin is the skin tone,
    or by `gain` [3] if that was found before; the shading takes the inverse, so that their product stays. Unseen texels
    are the mean face of that tone: a drawn sample would be as likely, but would look like a measurement. So is the
    specular albedo, which no term of the likelihood constrains.
    """
    shader = start.observations[1].shader
    share = evidence.weight.sqrt()
    x = torch.lerp(start.reference, state.denoised, share)[0]
    with torch.no_grad():
        beside = enlarge_field(start.local, evidence.size).exp() / start.exposure[:, None, None]
        shading = shader.total(state.lights).clamp_min(1e-3) * beside
    diffuse = albedo(x[None])
    if start.marks:  # they are the skin's, however unlikely under the prior
        cover = torch.from_numpy(draw_cover(start.marks, evidence.size, evidence.texel)) * evidence.weight
        diffuse = torch.lerp(diffuse, evidence.texture / shading, cover)
    diffuse = diffuse.clamp_min(MIN_ALBEDO)
    if gain is None:
        gain = start.tint * _gain(diffuse, evidence.skin * evidence.weight, start.working_tone, start.recipe.rescale)
    normal = torch.nn.functional.normalize(x[3:6], dim=0) * 0.5 + 0.5
    specular = ((start.reference[0, 6] + 1) / 2).clamp(0, 1).numpy()
    gains = torch.lerp(
        start.tint[:, None, None], gain[:, None, None], share
    )  # the mean face has the working tone exactly
    return Maps(
        to_picture((diffuse * gains).clamp_max(1)),
        specular,
        to_picture(normal),
        to_picture(shading / gains),
        estimate_confidence(evidence, to_picture(diffuse)),
        gain,
    )


def place_neck(maps: Maps, evidence: Evidence) -> Maps:
    """Give the unseen neck of maps in the built-in UVs its measured colour beside this face; seen texels stay."""
    unseen = 1 - evidence.weight.sqrt().numpy()
    gain = neck.neck_gain(maps.diffuse, skin_weight.mean_skin(maps.diffuse), unseen)
    return replace(maps, diffuse=np.minimum(maps.diffuse * gain, 1), shading=maps.shading / gain)


def _gain(diffuse: torch.Tensor, weight: torch.Tensor, tone: torch.Tensor, rescale: str) -> torch.Tensor:
    """Return linear factors [3] that bring the mean, of linear or ("srgb") of encoded values, to `tone` [3]."""
    if rescale == "none":
        return torch.ones(3)
    gamma = 1.0 if rescale == "linear" else 2.2
    return (tone ** (1 / gamma) / mean_tone(diffuse ** (1 / gamma), weight)).pow(gamma).clamp(0.2, 5.0)


def write_maps(
    capture: Capture,
    maps: Maps,
    solution: Solution,
    conditions: dict[str, str],
    only: tuple[slice, slice] | None = None,
) -> None:
    """Write maps/, whole or not at all, with the solution that a later solve of a part goes on from.

    `conditions` are mask_edit's. With `only`, rows and columns, all other texels keep the values of their files.
    """

    def put(write: Callable, name: str, image: np.ndarray, **options) -> None:
        if only is not None:
            before = images.read_data(capture.maps / name)
            before[only] = image.reshape(*image.shape[:2], -1)[only]
            image = before
        write(folder / name, image, **options)

    with replacing_folder(capture.maps) as folder:
        put(images.write_srgb, "diffuse_albedo.png", images.linear_to_srgb(maps.diffuse), bits=16)
        put(images.write_linear, "diffuse_albedo.exr", maps.diffuse)
        put(images.write_data, "specular_albedo.png", maps.specular, bits=16)
        put(images.write_data, "normal.png", maps.normal, bits=16)
        put(images.write_linear, "shading.exr", maps.shading)
        put(images.write_data, "confidence.png", maps.confidence)
        write_solution(folder / capture.solved.name, solution, conditions)


def write_skin_weight(capture: Capture, albedo: np.ndarray, tone: SkinTone, filmed: Evidence) -> None:
    """Write maps/skin_weight.png, by the solved albedo [S, S, 3] and the evidence in the built-in UVs."""
    weight = skin_weight.weigh_skin(albedo, np.array(tone.linear, np.float32), filmed.hair.numpy())
    images.write_data(capture.skin_weight, weight)


def write_preview(
    capture: Capture, state: State, observations: dict[int, Observation], tint: torch.Tensor, report: Reporter
) -> None:
    """Write preview/albedo.png and shading.png of a running solve, at the size that it works at just now.

    `tint` [3] brings the albedo to the skin tone.
    """
    o = observation_of(state, observations)
    with torch.no_grad():
        shading = o.shader.total(state.lights).clamp_min(0).cpu()
    scale = 0.6 / max(float(np.percentile(shading.numpy(), 95)), 1e-6)
    for name, image in (("albedo", albedo(state.denoised).cpu() * tint[:, None, None]), ("shading", scale * shading)):
        images.write_srgb(capture.preview / f"{name}.png", images.linear_to_srgb(to_picture(image)))
        report.preview(f"preview/{name}.png")


def to_picture(planes: torch.Tensor) -> np.ndarray:
    """Return [C, H, W] as [H, W, C]."""
    return np.ascontiguousarray(planes.permute(1, 2, 0).numpy(), np.float32)
