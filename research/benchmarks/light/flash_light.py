# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Remove the known light of one lamp at the camera in a dark room from the frames.

The lamp is in the camera's own place, so a point at distance r with normal n gets n.l / r^2, and the half vector is the
viewing direction: the highlight depends on n.l alone. Every point is lit from another side in every frame, so how its
brightness changes tells the highlight from the albedo: a strength per place and channel over one roughness, by least
squares. Bounces between nose and cheek are not known light and stay.
"""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from core.capture.capture import Capture
from core.face.head import Head, Unfolded, read_head
from core.geometry import raster
from core.geometry.views import View, read_views
from core.imaging import images
from core.stages.texture.held_picture import hold
from core.stages.texture.projection import observe

LEAST = 0.2  # cosine at which the division stops: beyond, pixels stay dark, and the texture hardly trusts them
ROUGHNESSES = (0.3, 0.4, 0.5, 0.6, 0.7)  # in Principled's terms (alpha is the square)
SIZE = 512  # texels on which the highlight is found
SMOOTH = 12.0  # of those: deviation over which neighbours share a highlight's strength
HELD = 0.05  # how far a place's strength is drawn to the whole head's, as a share of the mean evidence
BURNT = 0.98  # sRGB from which a pixel tells nothing
LEFT = 0.2  # least share of a pixel that is taken for albedo
BRIGHT = 99.0, 0.8  # percentile of the result over the head, and the linear value that it is brought to


@dataclass(frozen=True)
class Highlight:
    """A highlight.

    strength [S, S, 3]: of the lobe of that roughness, in units of the shading-free picture, in the head's UVs.
    """

    strength: np.ndarray
    roughness: float


@dataclass(frozen=True)
class Lit:
    """One frame and its light.

    linear [H, W, 3]; hit: bool [H, W]; cosine n.l [H, W]; shading n.l / r^2 [H, W], r in metres; uv [H, W, 2].
    """

    view: View
    linear: np.ndarray
    hit: np.ndarray
    cosine: np.ndarray
    shading: np.ndarray
    uv: np.ndarray

    @property
    def unshaded(self) -> np.ndarray:
        """Return the picture over its shading [H, W, 3]: albedo and highlight times an unknown gain; 0 off the head."""
        return np.where(self.hit[..., None], self.linear / self.shading[..., None], 0).astype(np.float32)


def write_delit(capture: Capture, folder: Path) -> Highlight:
    """Write folder/NNNNN.png of every registered frame without the known light: sRGB, 16 bit, one exposure."""
    head = read_head(capture)
    frames = [lit(view, images.read_linear(view.path), head) for view in read_views(capture)]
    found = highlight(frames, head.unfold(SIZE))
    pictures = [matte(frame, found) for frame in frames]
    brightest = np.concatenate([picture[frame.hit].max(1) for picture, frame in zip(pictures, frames, strict=True)])
    gain = BRIGHT[1] / np.percentile(brightest, BRIGHT[0])
    for frame, picture in zip(frames, pictures, strict=True):
        images.write_srgb(
            folder / Path(frame.view.name).with_suffix(".png").name, images.linear_to_srgb(picture * gain), bits=16
        )
    return found


def lit(view: View, linear: np.ndarray, head: Head) -> Lit:
    """Return a frame, linear [H, W, 3], with the light of a lamp at the camera on the head."""
    face, bary, distance = raster.render_view(head.caster, view)
    mesh, hit = head.mesh, face >= 0
    normal = raster.interpolate(head.normals, mesh.faces, face, bary)
    points = raster.interpolate(mesh.vertices, mesh.faces, face, bary)
    towards = (view.centre - points) / np.where(hit, distance, 1)[..., None]
    cosine = (normal * towards).sum(-1) / np.maximum(np.linalg.norm(normal, axis=-1), 1e-9)
    shading = np.where(hit, np.maximum(cosine, LEAST) / np.where(hit, distance, 1) ** 2, 1)
    uv = raster.interpolate(mesh.uvs, mesh.face_uvs, face, bary)
    return Lit(view, linear, hit, np.clip(cosine, 0, 1), shading, uv)


def highlight(frames: list[Lit], surface: Unfolded) -> Highlight:
    """Fit picture over shading = albedo + strength x lobe(n.l) at every texel by least squares over the frames.

    Neighbours share the strength; the roughness of ROUGHNESSES with the least residual is taken.
    """
    samples = [_observed(frame, surface) for frame in frames]
    fits = [_fit(samples, roughness) for roughness in ROUGHNESSES]
    best = min(range(len(fits)), key=lambda i: fits[i][1])
    return Highlight(fits[best][0], ROUGHNESSES[best])


def matte(frame: Lit, highlight: Highlight) -> np.ndarray:
    """Return a frame over its shading without its highlight, linear [H, W, 3], zero beside the head."""
    at = np.stack([frame.uv[..., 0], 1 - frame.uv[..., 1]], -1).reshape(-1, 2) * len(highlight.strength)
    strength = raster.sample(highlight.strength, at).reshape(frame.unshaded.shape)
    return np.maximum(
        frame.unshaded - strength * lobe(frame.cosine, highlight.roughness)[..., None], LEFT * frame.unshaded
    )


def lobe(cosine: np.ndarray, roughness: float) -> np.ndarray:
    """Return the GGX highlight under a lamp at the camera over a white diffuse surface, for F0 = 1: D G2 pi / (4 c^2).

    Walter et al. 2007; h = l = v, so Fresnel's term is constant and the strength of a real surface is F0 itself.
    """
    alpha2, c2 = roughness**4, np.clip(cosine, LEAST, 1) ** 2
    distribution = alpha2 / (np.pi * (c2 * (alpha2 - 1) + 1) ** 2)
    # 1 + 2 Lambda; both directions are one, and their masking is correlated
    smith = np.sqrt(1 + alpha2 * (1 - c2) / c2)
    return np.pi * distribution / (4 * c2 * smith)


def _observed(frame: Lit, surface: Unfolded) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return each texel's unshaded colour [S, S, 3] in a frame, n.l [S, S], and its weight [S, S]."""
    observation = observe(frame.view, hold(frame.unshaded), surface, 1.0)
    burnt = cv2.dilate((images.linear_to_srgb(frame.linear).max(-1) > BURNT).astype(np.uint8), np.ones((5, 5))).astype(
        np.float32
    )
    weight = observation.quality * (
        cv2.remap(burnt, observation.pixels[..., 0] - 0.5, observation.pixels[..., 1] - 0.5, cv2.INTER_LINEAR) == 0
    )
    towards = frame.view.centre - surface.points
    cosine = np.zeros(surface.covered.shape, np.float32)
    cosine[surface.covered] = np.clip((towards * surface.normals).sum(1) / np.linalg.norm(towards, axis=1), 0, 1)
    return np.exp(observation.log_colour), cosine, np.where(cosine > LEAST, weight, 0).astype(np.float32)


def _fit(samples: list[tuple], roughness: float) -> tuple[np.ndarray, float]:
    """Return the strength [S, S, 3] for one roughness, and the residual sum of squares."""
    lobes = [lobe(cosine, roughness)[..., None].astype(np.float32) for _, cosine, _ in samples]
    weights = [weight[..., None] for *_, weight in samples]
    total = sum(weights) + 1e-6
    mean_lobe = sum(w * f for w, f in zip(weights, lobes, strict=True)) / total
    mean = sum(w * colour for w, (colour, *_) in zip(weights, samples, strict=True)) / total
    spread = sum(w * (f - mean_lobe) ** 2 for w, f in zip(weights, lobes, strict=True))
    together = sum(
        w * (f - mean_lobe) * (colour - mean) for w, f, (colour, *_) in zip(weights, lobes, samples, strict=True)
    )
    squares = sum(float((w * (colour - mean) ** 2).sum()) for w, (colour, *_) in zip(weights, samples, strict=True))
    everywhere = np.maximum(together.sum((0, 1)) / max(float(spread.sum()), 1e-9), 0)
    near_spread, near_together = (cv2.GaussianBlur(a, (0, 0), SMOOTH).reshape(a.shape) for a in (spread, together))
    held = HELD * float(spread[spread > 0].mean()) if (spread > 0).any() else 1.0
    strength = np.maximum((near_together + held * everywhere) / (near_spread + held), 0)
    return strength.astype(np.float32), squares - float((2 * strength * together - strength**2 * spread).sum())
