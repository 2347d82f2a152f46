# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Markdown of the figures of research.benchmarks.head.geometry."""

from ..figures import markdown, number

ROWS = {
    "average": "plain average (L2)",
    "blend": "blend",
    "aligned": "aligned blend",
    "perceptual": "with perceptual step",
    "delit": "aligned, own delit frames, after one gain",
}


def table(figures: dict[str, dict]) -> str:
    """Return the tables of {capture: figures of geometry.measure_capture}; a dash was not measured."""
    results = figures
    tables = [_cameras(results), _surfaces(results), _textures(results), _costs(results)]
    stopped = [
        f"- **{name}** stopped at {s['stage']}: {s['problem']} {s['remedy']}"
        for name, figures in results.items()
        if (s := figures.get("stopped"))
    ]
    failed = [
        f"- **{name}**, {part}: not measured ({figures[part]['not_measured']})"
        for name, figures in results.items()
        for part in ("cameras", "scan", "head", "texture")
        if "not_measured" in figures.get(part, {})
    ]
    return "\n\n".join([*tables, *(["\n".join([*stopped, *failed])] if stopped or failed else [])])


def published(results: dict[str, dict]) -> dict[str, dict]:
    """Return the results for the record, without pictures and figures of stages that no table shows."""
    return {
        name: {
            part: {**of, "own": _millimetres(of["own"])} if isinstance(of, dict) and "own" in of else of
            for part, of in figures.items()
            if part != "picture"
        }
        for name, figures in results.items()
    }


def _millimetres(own: dict) -> dict:
    return {key: value for key, value in own.items() if isinstance(value, int | float) and "mm" in key}


def _cameras(results: dict) -> str:
    rows = []
    for name, figures in results.items():
        c = figures.get("cameras", {})
        t = c.get("against_truth", {})
        true_focal = f" px of {t['true_focal_px']:.0f}" if "true_focal_px" in t else ""
        own = number(c.get("registered_percent"), 0, " %"), number(c.get("reprojection_px"), 2, " px")
        centres = number(t.get("centre_error_median_percent"), 3, " %")
        rotations, focal = number(t.get("rotation_error_median_deg"), 2, "°"), number(t.get("focal_px"), 0, true_focal)
        rows.append([name, c.get("frames"), *own, centres, rotations, focal])
    against = ("centres (median, of the distance)", "rotations (median)", "focal length")
    return markdown(["cameras", "frames", "registered", "reprojection", *against], rows)


def _surfaces(results: dict) -> str:
    keys = [(kind, f"{share}_mm") for kind in ("by_cameras", "after_icp") for share in ("median", "p90", "p95")]
    rows = []
    for name, part in ((name, part) for name in results for part in ("scan", "head")):
        found = results[name].get(part, {})
        if t := found.get("against_truth"):
            cells = [number(t.get(kind, {}).get(key), 2, " mm") for kind, key in keys]
        else:
            own = _millimetres(found.get("own", {}))
            shown = "; ".join(f"{key.replace('_', ' ')} {value:.3g}" for key, value in own.items())
            cells = [shown or None, *["no truth" if shown else None] * 5]
        rows.append([f"{name}: {part}", *cells])
    head = ["to the true surface, in the face", "median", "90 %", "95 %", "median after ICP", "90 %", "95 %"]
    return markdown(head, rows)


def _textures(results: dict) -> str:
    shown = ("ssim", "detail", "mole_contrast", "pore_contrast", "pore_correlation")
    rows = []
    for name, figures in results.items():
        alone = figures.get("texture", {}).get("alone", {})
        for row, label in (*ROWS.items(), ("leave_one_out", "aligned, frame left out")):
            f = alone.get(row)
            if f and "not_run" in f:
                rows.append([f"{name}: {label}", f"not run: {f['not_run']}", *[None] * 6])
            elif f:
                psnr = number(f.get("psnr_after_gain" if row == "delit" else "psnr"), 2, " dB")
                seconds = number(f.get("seconds"), 0, " s")
                rows.append([f"{name}: {label}", psnr, *(number(f.get(key), 3) for key in shown), seconds])
    fine = ("moles: contrast", "pores: contrast", "pores: correlation")
    return markdown(["texture of the true albedo frames", "PSNR", "SSIM", "detail", *fine, "seconds"], rows)


def _costs(results: dict) -> str:
    stages = [figures.get("stages", {}) for figures in results.values()]
    rows = []
    for name in dict.fromkeys(name for costs in stages for name in costs):
        found = [costs.get(name) for costs in stages]
        rows.append([name, *(c and f"{c['seconds']:.0f} s, {c['peak_mb'] / 1000:.1f} GB" for c in found)])
    return markdown(["stage: seconds, peak memory", *results], rows)
