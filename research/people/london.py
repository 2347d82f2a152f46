# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""People of the Face Research Lab London Set (DeBruine and Jones 2017, CC BY 4.0): who teaches, and who judges.

The judges are seen by no training, prior, statistic or constant. They were named before anything was trained on the
others: of each group, as its members named it themselves, one or more women and men of different ages.
"""

from __future__ import annotations

from pathlib import Path

JUDGES = ("010", "097", "124", "021", "117", "141", "034", "024", "064", "115", "099", "061")
"""Three white women and three white men, then a woman and a man each: east Asian, west Asian, black."""
ATTRIBUTION = "Face Research Lab London Set, Lisa DeBruine and Benedict Jones, CC BY 4.0, https://doi.org/10.6084/m9.figshare.5047666"


def photographs(folder: Path, judges: bool = False) -> list[Path]:
    """List the photographs of london_faces' folder, by number: the judges', or everybody else's."""
    paths = sorted((Path(folder) / "neutral_front").glob("*_03.jpg"))
    return [path for path in paths if (path.name[:3] in JUDGES) == judges]
