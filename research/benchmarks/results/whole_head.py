# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/whole_head.md: the completion of the unseen head, and the hair's masks."""

from ..figures import Figures, markdown
from ..pages import Sections, prose
from .split import OLDER

TITLE = "The whole head, and the hair's masks"
SAYS = "Neck, ears and scalp that no camera saw; the masks of brows, lashes and beard, and the skin below."
RECORDS = ("whole_head",)


def sections(record: Figures) -> Sections:
    people, sample, scan = record.synthetic, record.sample, record.scan

    def both(name: str, digits: int, *rows: Figures) -> list[str]:
        return [name, *(", ".join(f"{row[key]:.{digits}f}" for row in rows) for key in ("fill", "completed"))]

    within = (
        f"sample: step of the log tone over the border (within the seen part, as far apart: {sample.border.within:.3f})"
    )
    completed = [
        both("synthetic: neck, ears", 1, people.neck, people.ears),
        both("synthetic: scalp, of which nothing was seen", 1, people.scalp),
        both("synthetic: fine band of the hidden neck over the face's (1 is alike)", 2, people.grain),
        both("sample: neck, ears, scalp", 1, sample.tone.neck, sample.tone.ears, sample.tone.scalp),
        both(within, 3, sample.border),
        both(f"head scan: the same (within: {scan.border.within:.3f})", 3, scan.border),
    ]
    below = f"{people.below_hair['with hair']:.1f}, {people.below_hair.clean:.1f}"
    hair = [
        ["correlation of the brows' mask with what the painted brows take from the albedo", f"{people.brows:.2f}"],
        ["the same for the beard (0 if it was not found: fair or grey hair on light skin)", f"{people.beard:.2f}"],
        ["beard found on a bare chin", f"{people.bare_chin:.0f} cm^2"],
        ["error below brows and beard against the skin painted without hair: with hair, clean", below],
    ]
    setup = """
        *fill* is what the solver gives where nobody looked, the mean face in the subject's tone; *completed* is what
        the stage 4K Maps delivers. Six synthetic subjects of which only the face was seen (maps of 512), and the solved
        captures (1024; the sample's truth by `--subject 900006`). Errors are those of the tone over 2 mm, in sRGB of
        255.
        """
    reading = """
        The fill is flattered here: the mean face was learnt from subjects of the same generator and is given the true
        tone (synthetic) or nearly so (sample), so on neck and ears it can hardly be beaten. On the sample the seen neck
        is solved too dark in places, and the completed neck continues it. **A scalp that nobody saw becomes bare
        skin**, while the painted subjects wear cropped hair of 25 to 100 %; where part of it was seen (sample), the
        completion continues its tone and is nearer. On the head scan a faint step remains over the scalp. Well-seen
        texels keep their bytes (a test).
        """
    masks = f"""
        These masks are by the strokes alone, without today's face parser; [hair](hair.md) is measured with it. Sample:
        brows {sample.hair.brows:.1f} cm^2, beard {sample.hair.beard:.1f} cm^2 (painted: 15 % of a full one). Head scan:
        brows {scan.hair.brows:.1f}, lashes {scan.hair.lashes:.1f}, beard {scan.hair.beard:.1f} cm^2.
        """
    return [
        ("", prose(setup, OLDER, markdown(["", "fill", "completed"], completed), reading)),
        ("The hair's masks", prose(markdown(["hair, six synthetic subjects", ""], hair), masks)),
    ]
