# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Compare hair grown from pictures with the known hair of people: where it covers the face, and its direction.

    python -m research.benchmarks.head.groomed FOLDER [--seeds 3 ...] [--trust] [--sheet docs/pictures/hair.jpg]
        [--json research/records/groomed.json]

The people of research/people/lifelike are seen by rays from nine sides, lit by one lamp and a sky without shadows,
through a phone's pipeline; cameras, head and the albedo's texture are the true ones, so only the finding of hair, its
strokes and its growth are judged. docs/results/hair.md explains the figures. FOLDER keeps the pictures.
"""

from pathlib import Path

import cv2
import numpy as np
from scipy.spatial import cKDTree

from core.face import template
from core.face.parts import GROWTHS
from core.face.strands import SkinSurface, Strands, prisms
from core.geometry import raster
from core.geometry.meshes import joined, vertex_normals
from core.geometry.views import View
from core.imaging import images
from core.stages.texture.parts_shown import PartsShown
from core.stages.upscale import grooming, hair, strokes, ways
from core.stages.upscale.surface import lay_out

from ...people.lifelike import beards, brows
from ...people.lifelike.figure import Figure, make_figure
from ...people.lifelike.ground import ground_of
from .. import figures
from ..captures.haired_people import OVER, SCALE, SIZE, VIEWS, photograph, read_maps, shrink
from ..captures.likenesses import LIKENESSES

NAMES = {person.seed: person.name for person in LIKENESSES}
JUDGED = (3, 5)
"""Views in which coverage is compared: either side of the front."""
COVERED, NEAR_MM = 0.1, 3.0
PX_PER_MM = 2 * SCALE
AROUND_MM, AMOUNT_MM = 1.0, 3.0
"""Deviations in mm of the surroundings in which hair is said to cover a pixel or not, and of those in which it is said
how much it covers."""
SOWN = {"brows": brows.grow_brows, "beard": beards.grow_beard}
"""Rules by which the people have their hair."""
WANTED_IOU, WANTED_DEGREES = 0.7, 20
COMMAND = "python -m research.benchmarks.head.groomed FOLDER --json research/records/groomed.json"
CHOSEN_ON, TRUSTS, TURNS = (3, 5, 13), (0.03, 0.1, 0.3, 1.0, 3.0), (-40, 0, 40)
"""People on whom the trust in strokes was chosen; degrees by which the usual directions are turned, for nobody's hair
is all as usual."""
USUAL_ALONE = 1e6
"""Trust in the usual directions that no stroke outweighs."""


def main() -> None:
    parser = figures.command_line(__doc__, "groomed")
    parser.add_argument("folder", metavar="FOLDER", type=Path)
    parser.add_argument(
        "--seeds",
        type=int,
        nargs="+",
        default=[person.seed for person in LIKENESSES],
        help="the four reserved people, where none are named",
    )
    parser.add_argument(
        "--trust", action="store_true", help="how far hair is off for how clear strokes must be (seeds 3, 5, 13)"
    )
    parser.add_argument("--sheet", type=Path, help="a picture of true and grown hair")
    options = parser.parse_args()
    if options.trust:
        print(
            figures.markdown(
                ["person", "part", *map(str, TRUSTS)],
                [row for seed in CHOSEN_ON for row in try_trusts(options.folder, seed)],
            )
        )
        return
    rows, pictures = {}, []
    for seed in options.seeds:
        rows[NAMES.get(seed, str(seed))], picture = judge(options.folder, seed)
        pictures.append(picture)
        print(to_table(rows).splitlines()[-1], flush=True)
    if options.sheet:
        images.write_srgb(options.sheet, np.concatenate(pictures))
    figures.write_record(options.json, "groomed", COMMAND, {"people": rows})


COLUMNS = {
    "true_hairs": "true hairs",
    "grown_hairs": "grown hairs",
    "true_mm": "true mm",
    "grown_mm": "grown mm",
    "iou": "IoU",
    "iou_anew": "anew",
    "amount": "amount",
    "amount_anew": "anew",
    "parser_iou": "parser",
    "degrees": "off, degrees",
    "usual_degrees": "off, usual",
}


def to_table(rows: dict[str, dict]) -> str:
    """Return Markdown: a line for each part of each person."""
    lines = [
        [name, part, *(row.get(key) for key in COLUMNS)] for name, parts in rows.items() for part, row in parts.items()
    ]
    return figures.markdown(["person", "part", *COLUMNS.values()], lines)


def shortfalls(rows: dict[str, dict]) -> str:
    """Return the rows that miss the goals, and how often following the strokes is worth it."""
    parts_of_all = [(f"the {name} person's {part}", row) for name, parts in rows.items() for part, row in parts.items()]
    with_directions = [row for _, row in parts_of_all if "degrees" in row]
    thin = [f"{what} ({row['iou']:.2f})" for what, row in parts_of_all if row["iou"] < WANTED_IOU]
    off = [
        f"{what} ({row['degrees']:.0f} degrees)"
        for what, row in parts_of_all
        if "degrees" in row and row["degrees"] > WANTED_DEGREES
    ]
    nearer = sum(row["degrees"] < row["usual_degrees"] for row in with_directions)
    return (
        f"Below the IoU that is wanted: {', '.join(thin) or 'nothing'}; farther off: "
        f"{', '.join(off) or 'nothing'}. Hair that follows the strokes lies nearer to the true one than "
        f"the usual directions alone in {nearer} of {len(with_directions)} rows."
    )


def judge(folder: Path, seed: int) -> tuple[dict, np.ndarray]:
    """Return the figures of one person, and a picture [H, W, 3]: frame, true hair, grown hair."""
    figure = make_figure(seed)
    views, colours = photograph(folder / str(seed), figure)
    surface, judged = lay_out(figure.head, SIZE), [views[k] for k in JUDGED]
    maps, shown = read_maps(figure, views, colours)
    found = hair.find(maps, surface, shown.shares[..., : len(GROWTHS)])
    cleaned, _ = hair.clean(maps, found, surface, seed)
    grown = grooming.groom(maps, found, cleaned, surface, seed)
    usual = grooming.groom(maps, found, cleaned, surface, seed, trust=USUAL_ALONE)
    true, rows = {hairs.part: hairs for hairs in figure.strands}, {}
    for part in (part for part in ("brows", "beard") if part in true or part in grown):
        row = {"true_hairs": _count(true.get(part)), "grown_hairs": _count(grown.get(part))}
        row["iou"], row["amount"] = overlaps(figure, judged, true.get(part), grown.get(part))
        row["parser_iou"] = _parser_iou(figure, shown, part)
        if part in true:
            row["iou_anew"], row["amount_anew"] = overlaps(figure, judged, true[part], sow_anew(figure, part))
        if part in true and part in grown:
            row |= {"true_mm": _mean_mm(true[part]), "grown_mm": _mean_mm(grown[part])}
            row["degrees"] = _off(true[part], grown[part], figure)
            row["usual_degrees"] = _off(true[part], usual[part], figure)
        rows[part] = row
    return rows, _picture(figure, views[VIEWS // 2], true, grown)


def try_trusts(folder: Path, seed: int) -> list[list]:
    """Return for each part of a person the median error of directions in degrees for each of TRUSTS."""
    figure = make_figure(seed, SIZE)
    views, colours = photograph(folder / str(seed), figure)
    surface, (maps, shown) = lay_out(figure.head, SIZE), read_maps(figure, views, colours)
    found = hair.find(maps, surface, shown.shares[..., : len(GROWTHS)])
    landmarks, rows = template.landmark_points(surface.mesh), []
    for true in (hairs for hairs in figure.strands if hairs.part in ("brows", "beard")):
        where = (getattr(found, true.part) > grooming.LEAST_COVER_SHARE) & surface.covered
        if where.sum() < grooming.FEWEST_TEXELS:
            continue
        texels = strokes.lay_texels(surface, where)
        tensors = strokes.measure_tensors(maps.diffuse, texels, float(np.median(surface.texel[where])))
        distance, nearest = cKDTree(texels.position / 1000).query(true.points[:, 0])
        close, usual = distance < NEAR_MM / 1000, ways.usual(true.part, texels.position, landmarks)
        normal, hairs = texels.normal[nearest[close]], true.points[close, -1] - true.points[close, 0]
        off = []
        for trust in TRUSTS:
            turned = [np.cos(a) * usual + np.sin(a) * np.cross(texels.normal, usual) for a in np.radians(TURNS)]
            chosen = [strokes.choose_ways(tensors, texels, way, trust)[nearest[close]] for way in turned]
            off.append(round(float(np.mean([_median_angle(way, hairs, normal) for way in chosen])), 1))
        rows.append([str(seed), true.part, *off])
    return rows


def _count(hairs: Strands | None) -> int:
    return 0 if hairs is None else len(hairs.points)


def _mean_mm(hairs: Strands) -> float:
    return round(float(1000 * np.linalg.norm(np.diff(hairs.points, axis=1), axis=2).sum(1).mean()), 1)


def _off(true: Strands, grown: Strands, figure: Figure) -> float:
    """Return the median angle in degrees on the skin."""
    distance, nearest = cKDTree(grown.points[:, 0]).query(true.points[:, 0])
    close = distance < NEAR_MM / 1000
    normals = vertex_normals(figure.head)[cKDTree(figure.head.vertices).query(true.points[close, 0])[1]]
    one, other = (
        hairs.points[index, -1] - hairs.points[index, 0]
        for hairs, index in ((true, np.flatnonzero(close)), (grown, nearest[close]))
    )
    return round(_median_angle(one, other, normals), 1)


def _median_angle(directions: np.ndarray, true_directions: np.ndarray, normals: np.ndarray) -> float:
    """Return the median of the degrees between directions [N, 3] on the skin."""
    directions, true_directions = (
        way - (way * normals).sum(1, keepdims=True) * normals for way in (directions, true_directions)
    )
    cosine = (directions * true_directions).sum(1) / np.maximum(
        np.linalg.norm(directions, axis=1) * np.linalg.norm(true_directions, axis=1), 1e-12
    )
    return float(np.median(np.degrees(np.arccos(np.clip(cosine, -1, 1)))))


def overlaps(figure: Figure, views: list[View], true: Strands | None, grown: Strands | None) -> tuple[float, float]:
    """Return the intersection over union of covered pixels, and the sum of lesser over that of greater covers."""
    both = either = 0
    least = most = 0.0
    for view in views:
        covers = [_cover(figure, view, hairs) for hairs in (true, grown)]
        a, b = (_around(cover, AROUND_MM) > COVERED for cover in covers)
        both, either = both + (a & b).sum(), either + (a | b).sum()
        a, b = (_around(cover, AMOUNT_MM) for cover in covers)
        least, most = least + np.minimum(a, b).sum(), most + np.maximum(a, b).sum()
    return round(float(both / max(either, 1)), 3), round(float(least / max(most, 1e-9)), 3)


def sow_anew(figure: Figure, part: str) -> Strands:
    """Return a person's hairs of a part with other roots."""
    return SOWN[part](
        figure.person, ground_of(figure.head), SkinSurface(figure.head), np.random.default_rng([figure.person.seed, 99])
    )


def _parser_iou(figure: Figure, parts_shown: PartsShown, part: str) -> float:
    """Return the intersection over union of the parser's texels (more than half) and those where such hair grows."""
    grows = (
        images.resize(figure.growth[part], SIZE, SIZE) > 0.25 if part in figure.growth else np.zeros((SIZE, SIZE), bool)
    )
    parsed, grows = (where[parts_shown.judged] for where in (parts_shown.shares[..., GROWTHS.index(part)] > 0.5, grows))
    return round(float((parsed & grows).sum() / max((parsed | grows).sum(), 1)), 3)


def _cover(figure: Figure, view: View, hairs: Strands | None) -> np.ndarray:
    """Return the share of each pixel [H, W] that hair covers."""
    skin = figure.opened.skin
    whole = joined([skin, prisms(hairs)]) if hairs is not None else skin
    face, _, _ = raster.render_view(raster.RayCaster(whole), view, OVER)
    return shrink((face >= len(skin.faces)).astype(np.float32)[..., None])[..., 0]


def _around(cover: np.ndarray, millimetres: float) -> np.ndarray:
    """Return the cover of a pixel's surroundings: single hairs are no shape."""
    return cv2.GaussianBlur(cover, (0, 0), millimetres * PX_PER_MM)


def _picture(figure: Figure, view: View, true: dict, grown: dict) -> np.ndarray:
    """Return the frame, true hair and grown hair on the bare skin, seen from the front, [H, W, 3] sRGB."""
    crop = slice(int(0.25 * view.height), int(0.8 * view.height)), slice(int(0.15 * view.width), int(0.85 * view.width))
    shown = [view.read()[crop]]
    for hairs in (true, grown):
        chosen = [hairs[part] for part in ("brows", "lashes", "beard") if part in hairs]
        meshes = [figure.opened.skin, *(prisms(h) for h in chosen)]
        flat = np.concatenate(
            [
                np.zeros((len(meshes[0].faces), 3)),
                *(
                    np.repeat(h.colour, len(m.faces) // len(h.colour), 0)
                    for h, m in zip(chosen, meshes[1:], strict=True)
                ),
            ]
        )
        whole = joined(meshes)
        face, bary, _ = raster.render_view(raster.RayCaster(whole), view, OVER)
        hit = face >= 0
        normal = raster.interpolate(vertex_normals(whole), whole.faces, face[hit], bary[hit])
        skin = face[hit] < len(meshes[0].faces)
        colour = flat[face[hit]]
        facing = -normal[skin, 1:2] / np.linalg.norm(normal[skin], axis=1, keepdims=True)
        colour[skin] = 0.35 * (0.4 + 0.6 * np.clip(facing, 0, 1))
        picture = np.ones((*hit.shape, 3), np.float32)
        picture[hit] = colour
        shown.append(images.linear_to_srgb(shrink(picture))[crop])
    return cv2.resize(np.concatenate(shown, 1).astype(np.float32), None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)


if __name__ == "__main__":
    main()
