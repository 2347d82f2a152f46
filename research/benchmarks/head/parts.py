# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure the face parser (core/face/parser.py) on people that no training sees.

    python -m research.benchmarks.head.parts [--json OUT.json] [--frames FOLDER] [--weights FILE]
    python -m research.benchmarks.head.parts --sheet OUT.jpg --pictures FOLDER_OR_FILE ... [--weights FILE]

The four people of research/benchmarks/captures/likenesses.py, each photographed VIEWS times from random sides in lights
made without panoramas (research/people/lifelike/unlit.py and snapshot.py: rays on the CPU, no Blender); with --frames
also the frames that research/benchmarks/captures/likenesses.py filmed, FOLDER/NAME/parts and capture.mp4, which Cycles
rendered. The face is found as in a capture, by the face nets; what is judged lies in the crop.

A pixel is of the part that most of it shows; in the photographs the skin between the roots of hair is hair, in the
filmed frames, whose truth knows single hairs only, a hair counts SPARSE times: figures have so much fewer hairs than
people. Per part the intersection over union (null where the person has none), over all pixels together; beside the
network what always says where parts usually are: the mean of the other people's. hair_as_skin: share of the hair of the
head that is taken for skin; skin_as_hair: the reverse. The sheet of photographs is for looking only.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from core.face import faces, parser
from core.face.parser_network import ParseNet
from core.face.parts import PARTS, cut, inside, to_crop
from core.imaging import images

from ...people.lifelike import snapshot, unlit
from ...people.lifelike.figure import PARTS as GROWN
from ...people.lifelike.figure import make_figure
from ...people.lifelike.truth import Scene
from ..captures.films import read_film
from ..captures.likenesses import LIKENESSES
from ..figures import command_line, markdown, number, write_record
from ..pictures.sheet import in_rows

VIEWS, SIZE, TEXELS = 8, 400, 1024
SPARSE = 4.0
HAIRS = ("brows", "beard", "hair")
ENDINGS = (".png", ".jpg", ".jpeg")
COLOURS = np.float32(
    [(255, 190, 150), (230, 0, 80), (120, 60, 0), (255, 150, 0), (70, 70, 230), (255,) * 3, (0, 160, 80), (0,) * 3]
)
COLOURS /= 255
"""Colours of the parts in a sheet, in their order."""


def main() -> None:
    options = command_line(__doc__, "parts")
    options.add_argument(
        "--frames", type=Path, metavar="FOLDER", help="what research.benchmarks.captures.likenesses wrote"
    )
    options.add_argument("--weights", type=Path, default=parser.WEIGHTS)
    options.add_argument("--sheet", type=Path, help="draw the parts of photographs instead")
    options.add_argument("--pictures", type=Path, nargs="+", default=[])
    options = options.parse_args()
    network = parser.load(options.weights.resolve())
    if options.sheet:
        write_sheet(options.sheet, options.pictures, network)
        return
    crops = {person.name: list(_crops(photographs(person.seed), network)) for person in LIKENESSES}
    rows = {name: row(found, VIEWS) for name, found in crops.items()}
    rows["all"] = row([crop for found in crops.values() for crop in found], VIEWS * len(crops))
    usual = [(truth, usual_parts(crops, name), known) for name, found in crops.items() for truth, _, known in found]
    rows["all, where parts usually are"] = row(usual, VIEWS * len(crops))
    for person in LIKENESSES if options.frames else ():
        if (options.frames / person.name / "parts").is_dir():
            frames = list(filmed(options.frames / person.name))
            rows[f"{person.name}, filmed"] = row(list(_crops(frames, network)), len(frames))
    lines = []
    for name, r in rows.items():
        shares = (*r["iou"].values(), r["hair_as_skin"], r["skin_as_hair"])
        lines.append([name, f"{r['found']} of {r['pictures']}", *(number(v, 2) for v in shares)])
    print(markdown(["person", "found", *PARTS, "hair as skin", "skin as hair"], lines))
    command = "python -m research.benchmarks.head.parts" + (" --frames FOLDER" if options.frames else "")
    write_record(options.json, "parts", command, {"rows": rows}, keep=True)


def photographs(seed: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield VIEWS sRGB pictures of a person and their shares, [S, S, 3] and [S, S, len(PARTS)]."""
    figure = make_figure(seed, TEXELS)
    scene = Scene(figure)
    for view in range(VIEWS):
        rng = np.random.default_rng([seed, 92, view])
        yield snapshot.photograph(unlit.trace_unlit(scene, unlit.random_view(figure, rng, SIZE), rng), rng)


def filmed(folder: Path) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield the frames with truth of a filmed person and their shares, each hair SPARSE times."""
    names = sorted(path.stem for path in (folder / "parts" / "hair").glob("*.png"))
    for index, frame in enumerate(read_film(folder / "capture.mp4")):
        if f"{index:04d}" in names:
            parts = np.stack([images.read_mask(folder / "parts" / part / f"{index:04d}.png") for part in GROWN], -1)
            shares = unlit.true_shares(parts)
            shares[..., [PARTS.index(name) for name in HAIRS]] *= SPARSE
            yield frame.astype(np.float32) / 255, shares / shares.sum(-1, keepdims=True)


def _crops(
    pictures: Iterator[tuple[np.ndarray, np.ndarray]], network: ParseNet
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Yield for each picture with a face the true parts, the network's, and the picture's place, [SIDE, SIDE]."""
    for srgb, shares in pictures:
        face = faces.detect(srgb)
        if face is not None:
            parts = parser.parse(srgb, face.landmarks, network)
            yield cut(shares, parts.move).argmax(-1), parts.crop.argmax(-1), inside(srgb.shape, parts.move) > 0.5


def usual_parts(crops: dict[str, list], name: str) -> np.ndarray:
    """Return the part that most pictures of the other people show at each pixel of the crop."""
    others = np.stack([truth for other, found in crops.items() if other != name for truth, _, _ in found])
    return np.stack([(others == k).sum(0) for k in range(len(PARTS))]).argmax(0)


def row(crops: list[tuple[np.ndarray, np.ndarray, np.ndarray]], pictures: int) -> dict:
    """Return the figures of crops, (truth, found, known) each."""
    counted = np.zeros((len(PARTS), len(PARTS)), int)
    for truth, found, known in crops:
        np.add.at(counted, (truth[known], found[known]), 1)
    both = np.diag(counted)
    either = counted.sum(0) + counted.sum(1) - both
    skin, hair = PARTS.index("skin"), PARTS.index("hair")
    return {
        "pictures": pictures,
        "found": len(crops),
        "iou": {
            name: float(both[k] / either[k]) if counted[k].sum() > 20 * len(crops) else None
            for k, name in enumerate(PARTS)
        },
        "hair_as_skin": _share(counted[hair, skin], counted[hair].sum()),
        "skin_as_hair": _share(counted[skin, hair], counted[skin].sum()),
    }


def _share(count: int, total: int) -> float | None:
    return float(count / total) if total else None


def write_sheet(out: Path, pictures: list[Path], network: ParseNet) -> None:
    """Draw the crops of photographs (files, or folders of them), their parts in colours, and both in one."""
    paths = [path for each in pictures for path in (sorted(each.iterdir()) if each.is_dir() else [each])]
    rows = []
    for path in (path for path in paths if path.suffix.lower() in ENDINGS):
        srgb = images.read_srgb(path)[..., :3]
        face = faces.detect(srgb)
        if face is None:
            print(f"{path.name}: no face was found")
            continue
        crop = cut(srgb, to_crop(face.landmarks))
        parts = (parser.parse(srgb, face.landmarks, network).crop @ COLOURS).astype(np.float32)
        rows.append(np.hstack([crop, parts, 0.55 * crop + 0.45 * parts]))
    images.write_srgb(out, in_rows(rows, 2))


if __name__ == "__main__":
    main()
