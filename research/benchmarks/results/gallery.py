# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/gallery.md: six people, every map, four lights. It has no record; --captures makes its pictures."""

from ..pages import prose

TITLE = "The gallery"
SAYS = "The sample and six people of six skin tones in five lights: every map, and four new lights."
RECORDS = ()
SHOWN = {
    "sample": "the sample, sun behind leaves",
    "very_light": "very light, noon sun behind leaves",
    "light": "light, overcast",
    "intermediate": "intermediate, a low sun through window bars",
    "tan": "tan, three mixed lamps",
    "brown": "brown, a hazy sun from the side",
    "dark": "dark, noon sun behind leaves",
}


def sections() -> str:
    pictures = [
        prose(f"![{words}](../pictures/gallery_{name}.jpg)", f"*{words[0].upper()}{words[1:]}.*")
        for name, words in SHOWN.items()
    ]
    return prose(
        """
        Made by `python -m research.benchmarks.captures.people FOLDER`, then
        `python -m research.benchmarks.pictures.gallery FOLDER/NAME.wildcap OUT.jpg --truth FOLDER/NAME/maps` for each,
        on 2026-11-28, the people by commit 1036f6da and the sample by 4ce0418a.

        Each picture: captured frame, delit frame, texture, shadow mask over it, solved albedo, true albedo, solved
        specular albedo; solved normals, shading, a close-up of the albedo beside the nose, and the head under three
        lamps, a window, the sun, and Blender's world *city* (Cycles, view transform Standard, exposure 0). The sample
        went through the whole chain, from the video to 4K maps. The people were solved at standard quality from forty
        frames of 600 x 800, of which sixteen make the texture, and are shown at 1024.

        The people are the first seed from 900101 on in each group of skin tone (`research/people/reserved.json` keeps
        them from every training). Their captures contain Cycles's shadows, two bounces of light, highlights by the true
        specular map and relief, sky and ground; a phone's exposure and white balance, which leave a quarter of the
        light's colour; blur, noise, JPEG. They do not contain scattering under the skin, open eyes, strands of hair, a
        phone's tone curve and sharpening, motion blur, a rolling shutter, or the errors of structure from motion:
        cameras are the true ones, the head is half a millimetre off, and the true skin tone is given. Faces and skins
        come from the generator that trained the networks, on other seeds; no training used Cycles's light.

        Known faults: lips come out too pale on most, brows too (least on *brown*), and the skins' own patches are too
        faint. On *intermediate* a dark spot stays on the lips, and shade around the eye that lay under the bar; on the
        sample a trace of a leaf beside the bridge of the nose. Crumbs of the collar stay on the neck's rim of
        *intermediate* and *dark*.
        """,
        *pictures,
    )
