# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/upscale.md: four times as many texels."""

from ..figures import Figures, markdown, number
from ..pages import Sections, prose

TITLE = "Four times as many texels"
SAYS = "The network against Lanczos, and the gain from frames that are finer than the texture."
RECORDS = ("upscale", "upscaler_training", "costs")
ENLARGED = {
    "diffuse_psnr": "diffuse PSNR",
    "diffuse_ssim": "SSIM",
    "diffuse_flip": "FLIP",
    "diffuse_features": "features",
    "specular_psnr": "specular PSNR",
    "specular_ssim": "SSIM",
    "normal_psnr": "normal PSNR",
    "normal_ssim": "SSIM",
    "normal_degrees": "degrees",
}


def sections(upscale: Figures, training: Figures, costs: Figures) -> Sections:
    cost, first, last = upscale.cost, training.to_bicubic_first, training.to_bicubic
    digits = {key: 2 if key.endswith(("psnr", "degrees")) else 3 for key in ENLARGED}
    enlarging = [
        [name, *(number(row[key], digits[key]) for key in ENLARGED)] for name, row in upscale.enlarging.items()
    ]
    frames = [
        [name, f"{row.psnr:.2f}", f"{row.ssim:.3f}", f"{row.pores:.2f}", f"{row.moles:.2f}"]
        for name, row in upscale.frames.items()
    ]
    setup = f"""
        The network (RCAN, 5 groups of blocks of 64 features, trained with ten blocks a group,
        {training.million_parameters:.1f} M parameters) against Lanczos, on twelve windows of six subjects that no
        training saw, painted at 4096 and reduced to 1024: as they are (plain), or softened, with noise and a flatter
        relief, as a solver leaves them (soft). Features are EfficientNet-Lite0's, not LPIPS. Three of the ten blocks
        are used and shipped.
        """
    reading = f"""
        ![Small map, Lanczos, network and truth: a mole, a scar's line, and two brows](../pictures/upscale.jpg)

        *From the left in each block: the small map, Lanczos, the network, the truth; albedo above normals.* Pores that
        show in albedo and specular come back in the normals; single hairs stay bundles.

        1024 to 4096 takes {cost.network.seconds:.0f} s on two cores with bfloat16 (Lanczos {cost.Lanczos.seconds:.0f}
        s) and {cost.network.peak_gib:.1f} GiB; the body takes the whole map, the tail goes in strips without a seam.
        The whole stage takes {costs.standard.upscale.seconds:.0f} s.
        """
    with_frames = """
        The gain from frames that are finer than the texture (one subject, six frames of 2700 x 3600 pixels in even
        light, true cameras and head; the solved map is the softened truth), at 2048:
        """
    on_frames = """
        Moles gain, pores tie: from a map that kept what it could, the network guesses pores as well as six frames show
        them. If the head is half a millimetre off, frames and truth lie beside each other and this measure fails; a
        solved map lies with its frames.
        """
    trained = f"""
        {training.minutes} minutes on two busy cores, {training.steps} steps in which it grew from 2 to 5 to 10 blocks a
        group (`--config cpu`; its planned end was moved while it ran, so the command repeats it closely, not exactly).
        {training.first_minutes} minutes with two blocks brought the held-out diffuse error to {first.diffuse:.2f} of
        bicubic resampling's, the rest to {last.diffuse:.3f} (normals {last.normals:.2f}, specular {last.specular:.2f});
        a fifth of the steps were at full depth. A GPU would get more out of the same network (`--config gpu`, not run;
        `--config paper` is the paper's 10 groups of 20).
        """
    return [
        ("", prose(setup, markdown(["reduced, enlarged by", *ENLARGED.values()], enlarging), reading)),
        (
            "With the frames",
            prose(with_frames, markdown(["enlarged by", "PSNR", "SSIM", "pores", "moles"], frames), on_frames),
        ),
        ("Training", prose(trained)),
    ]
