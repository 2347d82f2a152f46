# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/prior.md: the diffusion prior by itself."""

from ..figures import Figures
from ..maps import traits as benchmark
from ..pages import Sections, prose

TITLE = "The prior"
SAYS = "Its training, its distance from the training skins, its normals and specular, and skins' large shapes."
RECORDS = ("prior_training", "prior", "traits")


def sections(training: Figures, prior: Figures, traits: Figures) -> Sections:
    samples, response = prior.samples, prior.response.sampled
    words = f"""
        {training.million_parameters:.1f} million parameters, trained {training.minutes} minutes on two CPU cores on
        {training.synthetic_skins} synthetic skins and {training.scanned_skins} skins of the VALID avatars (diffuse
        only). The card beside the weights has its held-out losses.

        **It does not copy**: {samples.count} samples lie at {samples.median:.2f} times the distance from the nearest
        training patch that training patches have from each other (median; least {samples.least:.2f}; `samples OUT.png
        --work DIR --skins FOLDER`).

        **Normals and specular given the diffuse are as far from the truth as the mean face's** (`response --subjects
        9000 9002 --size 256 --steps 12`: {response.normals_of_mean_face:.2f} and {response.specular_of_mean_face:.2f}
        of its error, {response.normals_of_another:.2f} and {response.specular_of_another:.2f} of another subject's);
        the goal was 20 % better. A longer training on a GPU is the next thing to try.
        """
    return [("", prose(words)), *benchmark.sections(traits)]
