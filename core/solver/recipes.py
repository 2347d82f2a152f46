# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Constants of the method (paper, section 4.1 and supplement), as three recipes.

They are ours, the paper's, and that of the authors' released code. All run through one implementation; RECIPES at the
end of this file lists side by side what each changes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Recipe:
    """Every choice of the solver. The defaults are ours; equation numbers are the paper's."""

    # the walk
    steps: int = 20
    start: float = 0.6  # T_init / T: share of the noise schedule that is walked
    sigma_min: float = 0.01
    sigma_max: float = 80.0
    # (factor, sigma): above this noise the map is sampled at 1 / factor of its size
    coarse: tuple[tuple[int, float], ...] = ((4, 1.0), (2, 0.3))
    # x_0^ref, of the skin tone: the prior's mean face; "nearest" of its reference skins; or "uniform", the tone
    # everywhere
    reference: str = "mean"
    # linear tone that every skin is sampled in, so that a wrong tone is a gain and nothing else; None: the skin's own.
    # Of L* 35 to 75, 65 was best for all groups of tone: dark ones gained 0.3 to 0.7 dB, light ones lost nothing
    working_tone: tuple[float, float, float] | None = (0.50, 0.31, 0.22)

    # guidance by the texture
    guidance: str = "dps"  # or "proximal": closed form on the denoised map, without the network's gradient
    zeta: float = 1.0  # step size of equation 8
    # equation 8 in the paper's variance-preserving coordinates: there the same zeta is (1 + sigma^2) times larger
    preserving: bool = False
    # each texel's guidance is limited alone; "decade": all of it is divided by ten until the largest fits; "none"
    clip: str = "texel"
    limit: float = 0.1  # largest guidance of one texel
    blur: bool = False  # rendering and texture are compared through a 3 x 3 Gaussian
    candidates: int = 1  # draws of a step's noise, of which the one nearest to the texture is used
    residual: float = 0.02  # proximal: photometric error that counts as noise

    # the lights
    hard_mask: bool = False  # M is 0 or 1, with the ring around it; else a soft alpha that fades over a few texels
    open: float = 0.0  # weight of the texel grid outside of M; above 0 it removes unmasked shadows, and more
    one_chroma: bool = True  # all local light has one learned colour; False: 27 free numbers per cell
    bilinear: bool = False  # how a texel reads V; else cubic
    # deviation of the split's log light (split.py) up to which gamma^g is that light, and stays: so far exp(x) is 1 + x
    # within 3 %. A stronger light, as in frames without a delighter, is optimised, and with 0 all light is
    linear: float = 0.25
    # gamma^g starts from a least-squares fit to x_0^ref; else from the even light that gives the texture's mean
    fitted: bool = True
    sharp_edges: bool = True  # M's border is laid on the shadow's edge if the texture shows one, where light may step
    protect_marks: bool = True  # light must not explain moles and round scars inside M
    trusting: bool = False  # light may explain brows, lips and hair as freely as skin
    # (which lights, from, to): shares of the steps; frozen outside of them
    phases: tuple[tuple[str, float, float], ...] = (("both", 0.0, 0.5),)
    refit: float = 0.0  # share of the steps at which gamma^g is fitted outside of M in closed form
    updates: int = 300  # of each phase, spread over its steps, at least one a step
    rate: float = 0.01  # of Adam ...
    decay: float = 0.995  # ... and its factor per update of a phase
    tv: float = 0.0
    # L_TV is the squared variation of the SH coefficients; else the L1 variation of the shading on M's ring
    tv_of_gamma: bool = False
    # the L1 variation of the shading on M's ring, per texel of a 1024 map and mean squared albedo, so that it weighs as
    # much beside L_pho on dark skin and on a coarse map: L_TV's 0.1 on light skin at a quarter of the size, where eight
    # of ten updates are made
    seam: float = 2.0
    neg: float = 1.0
    # L1 variation of s^V inside M, per texel of a 1024 map and mean squared albedo: a brow is not worth its outline, a
    # shadow is
    smooth: float = 1.0
    # pull of s^V towards the share of the main light that is missing by M's border, per mean squared albedo; not where
    # the artist added to the proposal for M
    faint: float = 0.0

    # the end
    # with the authors' prior the tone is that of their box, and their masks' bounds limit texture and M
    released_boxes: bool = False
    # the mean of the facial skin is brought to the skin tone, in linear light; "srgb": in sRGB values; "none"
    rescale: str = "linear"


OURS = Recipe()

# What neither the paper nor the released code has is off in both.
_PLAIN = replace(
    OURS,
    coarse=(),
    hard_mask=True,
    one_chroma=False,
    sharp_edges=False,
    protect_marks=False,
    trusting=True,
    tv=0.1,
    seam=0.0,
    smooth=0.0,
    linear=0.0,
    working_tone=None,
)

RECIPES = {
    "wildcap": OURS,
    #                     the paper                                    the released code
    # walk                T_init = 600 of T = 1000                     the last 599 of 1000 Karras levels
    # x_0^ref             nearest scan, colour-matched                 the tone everywhere
    # equation 8          zeta = 1, variance preserving, no limit      zeta = 1, exploding, decade clip, best of 20
    # rendering compared  as it is                                     through a 3 x 3 Gaussian
    # lights              both at every step, gamma^g fitted first     gamma^g for 101 steps, then V for 200, then none
    # L_TV                squared, of gamma                            L1, of the shading on the ring
    # V read              bilinear                                     cubic
    # skin tone           by x_0^ref alone                             rescaled in sRGB at the end
    "paper": replace(
        _PLAIN,
        steps=600,
        reference="nearest",
        preserving=True,
        clip="none",
        phases=(("both", 0.0, 1.0),),
        updates=600,
        tv_of_gamma=True,
        bilinear=True,
        rescale="none",
    ),
    "released": replace(
        _PLAIN,
        steps=599,
        start=0.599,
        reference="uniform",
        clip="decade",
        candidates=20,
        blur=True,
        fitted=False,
        phases=(("main", 0.0, 101 / 599), ("grid", 101 / 599, 301 / 599)),
        updates=1,
        rescale="srgb",
        released_boxes=True,
    ),
}


def settle_recipe(recipe: Recipe) -> Recipe:
    """Keep gamma^g as the split found it: V alone moves."""
    return replace(recipe, phases=tuple(("grid", begin, end) for _, begin, end in recipe.phases), refit=0.0)


def free_recipe(recipe: Recipe) -> Recipe:
    """Let every light parameter be optimised, as the phases say."""
    return replace(recipe, linear=0.0)
