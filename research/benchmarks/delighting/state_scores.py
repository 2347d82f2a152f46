# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""All measures of one capture, and of one person's captures together."""

from itertools import combinations

import numpy as np

from core.face import template
from core.imaging import images

from ..captures.state_captures import SIZE, Filmed, landmarks_in_uv
from ..maps.albedo_score import HeadInView
from ..measures.agreement import agreement
from ..measures.edges import score_edges
from ..measures.features_kept import contrast_kept, contrasts, joint
from ..measures.parts import score_parts
from ..measures.pictures import detail, differences, face_box, log_green, shadow_step, with_gain
from ..measures.references import NOTHING, TRUE, face_height
from ..measures.shared_light import fit_light, log_ratio, without_light
from ..measures.slopes import slope
from ..measures.table import mean, mean_of
from ..measures.tone import psnr_after_gain
from .delight_measures import stepping

Figures = dict[str, float | None]


def in_pictures(answers: dict[str, np.ndarray], looks: list[HeadInView]) -> dict[str, Figures]:
    """Return method -> figures in the picture, means over the frames with a truth.

    PSNR, SSIM and FLIP are after one gain per channel. answers: linear maps [S, S, 3], with the filmed one, which tells
    where the light steps.

    Pixels count where the truth has facial skin and the head its face: a beard's strands stand before the neck, and no
    map on a head without strands can show them there.
    """
    found: dict[str, list[Figures]] = {method: [] for method in answers}
    face = np.repeat(template.mask("face", SIZE)[..., None], 3, axis=-1)
    for look in looks:
        mask = look.true.face & (look.picture(face)[..., 0] > 0.5)
        box, height = face_box(mask), face_height(mask)
        true, mask = look.true.albedo[box], mask[box]
        shadow = None if look.true.shadow is None else look.true.shadow[box]
        log_true = log_green(true)
        steps = (
            None if shadow is None else stepping(log_green(_seen(look, answers[NOTHING])[box]) - log_true, mask, shadow)
        )
        for method, answer in answers.items():
            picture = _seen(look, answer)[box]
            log = log_green(picture)
            figures: Figures = {
                **differences(with_gain(picture, true, mask), true, mask),
                "detail": detail(log, log_true, mask),
            }
            if shadow is not None:
                edge = score_edges(log, log_true, shadow, mask, height, steps)
                figures |= {
                    "shadow_step": shadow_step(log - log_true, mask, shadow),
                    "overshoot": edge.overshoot,
                    **{f"edge_{name}": value for name, value in vars(edge).items()},
                }
            found[method].append(figures)
    return {method: mean_of(frames) for method, frames in found.items()}


def in_uv(filmed: Filmed, maps: dict[str, np.ndarray]) -> dict[str, Figures]:
    """Return method -> figures of one capture in UV space, from linear maps [SIZE, SIZE, 3] with the true one."""
    where, points = filmed.where, landmarks_in_uv()
    truth, normals = maps[TRUE], filmed.normals[where]
    true_contrasts = contrasts(images.linear_to_srgb(truth), points, where)
    parts = {name: mask[where] for name, mask in filmed.parts().items()}
    found = {}
    for method, answer in maps.items():
        alone = fit_light([log_ratio(answer[where], truth[where])], [normals])
        figures: Figures = {
            "psnr_uv": psnr_after_gain(answer[where], truth[where]),
            "light_alone": alone.deviation,
            "psnr_alone": psnr_after_gain(without_light(answer[where], normals, alone), truth[where]),
        }
        kept = contrast_kept(contrasts(images.linear_to_srgb(answer), points, where), true_contrasts)
        figures |= {f"kept_{name}": value for name, value in kept.items()}
        for name, part in score_parts(answer[where], truth[where], parts).items():
            figures |= {f"psnr_{name}": part.psnr, f"bias_{name}": part.bias}
        found[method] = figures
    return found


def of_person(
    captures: list[Filmed], maps: list[dict[str, np.ndarray]]
) -> tuple[dict[str, Figures], dict[str, Figures]]:
    """Return method -> figures of a person's captures together, and method -> capture -> PSNR up to shared light.

    A method counts the captures that have its answer; what needs two captures is None with one.
    """
    found, each_alone = {}, {}
    for method in dict.fromkeys(name for answers in maps for name in answers):
        chosen = [i for i, each in enumerate(maps) if method in each]
        places = [captures[i].where for i in chosen]
        answers, truths = (
            [maps[i][name][where] for i, where in zip(chosen, places, strict=True)] for name in (method, TRUE)
        )
        normals = [captures[i].normals[where] for i, where in zip(chosen, places, strict=True)]
        shared = fit_light([log_ratio(a, t) for a, t in zip(answers, truths, strict=True)], normals)
        each_alone[method] = {
            captures[i].name: psnr_after_gain(without_light(a, n, shared), t)
            for i, a, n, t in zip(chosen, answers, normals, truths, strict=True)
        }
        figures: Figures = {
            "light_shared": shared.deviation,
            "captures": len(chosen),
            "psnr_shared": mean(list(each_alone[method].values())),
        }
        everywhere = np.logical_and.reduce(places)
        if len(chosen) > 1 and everywhere.any():
            tone = np.mean([maps[i][TRUE][everywhere].mean(0) for i in chosen], axis=0)
            slopes = [
                slope((maps[i][method], maps[j][method]), (maps[i][NOTHING], maps[j][NOTHING]), everywhere)
                for i, j in combinations(chosen, 2)
            ]
            figures |= {
                "agreement": agreement([maps[i][method][everywhere] for i in chosen], tone),
                "light_slope": mean(slopes),
            }
        figures |= joint(*([_kept(captures[i], maps[i], name) for i in chosen] for name in (method, NOTHING)))
        found[method] = figures
    return found, each_alone


def small(answers: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return maps at SIZE."""
    return {
        method: images.resize(np.ascontiguousarray(answer, np.float32), SIZE, SIZE)
        for method, answer in answers.items()
    }


def _kept(filmed: Filmed, maps: dict[str, np.ndarray], method: str) -> Figures:
    points = landmarks_in_uv()
    return contrast_kept(
        *(contrasts(images.linear_to_srgb(maps[name]), points, filmed.where) for name in (method, TRUE))
    )


def _seen(look: HeadInView, answer: np.ndarray) -> np.ndarray:
    """Return a linear map as a look sees it, sRGB [H, W, 3]."""
    return images.linear_to_srgb(np.clip(look.picture(answer), 0, 1))
