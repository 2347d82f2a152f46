# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/delighters.md: what takes the light out of the frames, against the true albedo."""

from __future__ import annotations

from ..delight import table
from ..figures import Figures
from ..pages import Sections, prose

TITLE = "Delighters"
SAYS = "The network, shading and others on real photographs, portraits of six tones, the scan and the sample."
RECORDS = ("delight",)


def sections(delight: Figures) -> Sections:
    real, portraits, scan, sample = delight.faceolat, delight.portraits, delight.lps_sun, delight.sample
    alone = "network, one photograph"
    photograph, untouched, flat = real[alone].figures, real.none.figures, real["flat true tone"].figures
    left = [portraits[row].groups.light.figures.shadow_step for row in (alone, "none")]
    return [("", prose("""
        Delit pictures against the true albedo, over the facial skin, after one gain per channel in linear light; means
        over the pictures. *features* is the distance in EfficientNet-Lite0's features (it is not LPIPS), *detail* the
        correlation with the truth's detail between 1 and 3 px, *shadow step* what is left of the light's step along the
        true shadow's edge where it exceeds 0.2 in natural log. *none* is the picture as it was shot, *flat true tone*
        the true mean skin colour everywhere.

        - *faceolat*: photographs of two real people on a light stage, twelve lights each; what counts as their albedo
          is itself a photograph in even light. True shadows are not known.
        - *portraits*: 36 synthetic subjects that no training sees, six per group of skin tone (individual typology
          angle), two lights each, without geometry.
        - *lps_sun*: 14 frames of the head scan's capture, *sample*: 14 of the synthetic sample's, both with cameras and
          head.
        """, table(delight), f"""
        The captures' rows by the network are older than the way in which its answers are put together today
        ([the sample](sample.md) is by today's).

        The rows of one photograph are older than the head that is fitted to it, and than what keeps brows and eyes
        in it: [single photographs](photographs.md) has today's figures. Two of the 36 subjects were sorted without
        their skin's saturation, and count in the group beside theirs.

        The network beats the picture as it is in every figure of every set and group of skin tone, but detail on the
        real photographs ({photograph.detail:.2f} against {untouched.detail:.2f}). On the two captures it beats
        *shading* in every figure but one, the step that is left of the shadow: where *shading* finds a sun's edge, it
        divides by the whole of it. On the real photographs the network gains {photograph.psnr - untouched.psnr:.1f} dB,
        which is {photograph.psnr - flat.psnr:.1f} dB over the flat true tone; **in SSIM the flat tone stays ahead
        there**, and on the synthetic portraits in PSNR as well by a third of a decibel: our subjects' skin is nearly
        flat at their size. Of the shadow's step less than a fifth is left, but in the group *light*, where
        {left[0]:.2f} of {left[1]:.2f} is. Without the geometry (*one photograph*) the network loses
        {scan.network.figures.psnr - scan[alone].figures.psnr:.1f} dB on the scan and
        {sample.network.figures.psnr - sample[alone].figures.psnr:.1f} dB on the sample: what is beard and what is
        shade, one picture does not tell.

        ![Synthetic people of six tones, their albedo, and four ways to delight them](../pictures/delighters.jpg)

        *One portrait per group of skin tone: the picture, its true albedo, the picture as it is after a gain per
        channel, the flat true tone, the network on one photograph (`--sets portraits --picture
        docs/pictures/delighters.jpg`).*

        `--quick` takes every fourth picture and leaves the feature distance out; `--weights FILE` measures other
        weights of our network, `--opendelight FOLDER` the authors' checkpoint.
        """))]
