# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Compare albedo times shading with the delit frames on facial skin (the paper's table 1).

    python -m research.benchmarks.maps.rerender FOLDER [--only NAME ...] [--json OUT.json]

FOLDER was made by research/benchmarks/captures/people.py and compared by research/benchmarks/maps/comparison.py, whose
delit rows are taken. Each view has a gain per channel of its own (delighters and cameras expose each frame anew), the
same way for every row. The ceiling is the texture itself in the same views: where they disagree with each other no
albedo and no shading can explain them all.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from core.capture.capture import Capture
from core.face import template
from core.geometry import meshes, raster
from core.geometry.views import read_views
from core.imaging import images

from .. import figures
from ..captures.people import PEOPLE
from ..measures.pictures import differences, face_box, with_gain
from ..measures.table import mean_of
from .ablation_measures import feature_distance
from .albedo_score import AlbedoTruth, HeadInView
from .comparison import LIGHTS, OURS, find_row_folder

ROWS = (OURS, *LIGHTS)
CEILING = "the texture itself"
# least cosine between surface and view: beyond it a registered head and a frame do not agree on what is where
GRAZING = 0.3
PAPER = {OURS: (28.79, 0.9520), "regions": (22.20, 0.9279), "environment": (27.81, 0.9411)}
"""PSNR and SSIM of the paper's table 1 (its six real captures): ours, DeFace*, FLARE*."""
TITLES = {"psnr": "PSNR", "ssim": "SSIM", "flip": "FLIP", "features": "features"}
FORMATS = {"psnr": "{:.2f} dB", "ssim": "{:.4f}", "flip": "{:.4f}", "features": "{:.3f}"}


@dataclass(frozen=True)
class DelitFrame:
    """A delit frame, sRGB [H, W, 3], and the head seen from there; `look.true.face` is the judged facial skin."""

    picture: np.ndarray
    look: HeadInView


def main() -> None:
    parser = figures.command_line(__doc__, "rerender")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="+", choices=[p.name for p in PEOPLE], default=[p.name for p in PEOPLE])
    options = parser.parse_args()
    people = {}
    for name in options.only:
        views, work = delit_views(Capture(options.folder / f"{name}.wildcap")), options.folder / "comparison" / name
        people[name] = {row: score(rendering(work, row), views) for row in (*ROWS, CEILING)}
        print(name, json.dumps(people[name]), flush=True)
    found = {
        "people": people,
        "mean": {row: mean_of([rows[row] for rows in people.values()]) for row in (*ROWS, CEILING)},
    }
    figures.write_record(options.json, "rerender", "python -m research.benchmarks.maps.rerender FOLDER", found)
    print(table(found))


def delit_views(capture: Capture) -> list[DelitFrame]:
    """Return the frames that were delit, with the facial skin that each of them sees from the front."""
    head = meshes.read_obj(capture.head)
    caster, normals = raster.RayCaster(head), meshes.vertex_normals(head)
    skin = template.mask("skin", 512) * template.mask("face", 512) * (1 - template.mask("eyes", 512))
    views = []
    for view in read_views(capture):
        path = capture.delit / f"{Path(view.name).stem}.png"
        if not path.is_file():
            continue
        face, bary, _ = raster.render_view(caster, view)
        hit = face >= 0
        uv = raster.interpolate(head.uvs, head.face_uvs, face[hit], bary[hit])
        towards = view.centre - raster.interpolate(head.vertices, head.faces, face[hit], bary[hit])
        normal = raster.interpolate(normals, head.faces, face[hit], bary[hit])
        lengths = np.linalg.norm(towards, axis=1) * np.linalg.norm(normal, axis=1)
        cosine = (towards * normal).sum(1) / np.maximum(lengths, 1e-9)
        judged = np.zeros(hit.shape, bool)
        judged[hit] = (raster.sample(skin, np.stack([uv[:, 0], 1 - uv[:, 1]], 1) * 512) > 0.5) & (cosine > GRAZING)
        picture = images.read_srgb(path)
        views.append(DelitFrame(picture, HeadInView(AlbedoTruth(len(views), picture, judged, None), hit, uv)))
    return views


def rendering(work: Path, row: str) -> np.ndarray:
    """Return albedo times shading of a delit row, linear [S, S, 3]; the ceiling's is the texture itself."""
    folder = find_row_folder(work, "delit", "texture" if row == CEILING else row)
    return images.read_linear(folder / "diffuse_albedo.exr") * images.read_linear(folder / "shading.exr")


def score(rendered: np.ndarray, views: list[DelitFrame]) -> dict[str, float]:
    """Return the figures of a linear map [S, S, 3] against the delit frames, means over views."""
    found = []
    for view in views:
        mask = view.look.true.face
        box = face_box(mask)
        picture, mask = view.picture[box], mask[box]
        srgb = images.linear_to_srgb(np.clip(view.look.picture(rendered), 0, 1))[box]
        srgb = with_gain(srgb, picture, mask)
        found.append(differences(srgb, picture, mask))
        distance = feature_distance(srgb * mask[..., None], picture * mask[..., None])
        if distance is not None:
            found[-1]["features"] = float(distance[mask].mean())
    return {figure: round(value, 4) for figure, value in mean_of(found).items()}


def table(record: dict) -> str:
    """Return Markdown: a line per row with means over people, beside the paper's figures for its own captures."""
    columns = [figure for figure in FORMATS if figure in record["mean"][OURS]]
    lines = []
    for row, cells in record["mean"].items():
        paper = PAPER.get(row if row in PAPER else row.rsplit(" ", 1)[0])
        lines.append(
            [
                f"**{row}**" if row == OURS else row,
                *(FORMATS[figure].format(cells[figure]) for figure in columns),
                "{:.2f} dB, {:.4f}".format(*paper) if paper else None,
            ]
        )
    return figures.markdown(
        ["mean of the people", *(TITLES[figure] for figure in columns), "the paper's, on its own captures"], lines
    )


if __name__ == "__main__":
    main()
