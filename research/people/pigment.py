# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Melanin and blood to diffuse reflectance: the colour of skin from its two pigments.

A thin absorbing epidermis over a scattering dermis, computed per wavelength and integrated to linear sRGB (D65).
Absorption and scattering: S. L. Jacques, "Skin optics", Oregon Medical Laser Center News, 1998; blood: S. Prahl's table
of haemoglobin extinction (omlc.org, from Gratzer and Kollias); reflectance of the dermis: the diffusion result of
Jensen and Buhler, "A rapid hierarchical rendering technique for translucent materials", 2002; colour matching: the fit
of Wyman, Sloan and Shirley, "Simple analytic approximations to the CIE XYZ color matching functions", 2013.
"""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np

from core.geometry import raster
from core.settings.colour_values import LUMINANCE_WEIGHTS

# volume fraction of melanosomes in the epidermis; Jacques: 0.013 ... 0.43 from very light to very dark skin
MELANIN_RANGE = 0.002, 0.9
BLOOD_RANGE = 0.001, 0.3  # volume fraction of blood in the dermis; normal skin 0.002 ... 0.07, lips and flush more
EPIDERMIS_CM = 0.006
OBLIQUE = 1.4  # mean length of diffuse light's way through the epidermis and back, over twice its thickness
# Jacques' fits are of skin outside the body and make every face too dark; these factors bring photographed faces within
# the model
SCATTERING = 3.0  # on the dermis's scattering
BASELINE = 0.25  # on the absorption of skin without pigment
BACKSCATTER = 0.012  # share of the light that returns from above the melanin

WAVELENGTHS = np.arange(400, 701, 10, dtype=np.float64)  # nm
# fmt: off
D65 = np.array([
    82.75, 91.49, 93.43, 86.68, 104.86, 117.01, 117.81, 114.86, 115.92, 108.81, 109.35, 107.80, 104.79, 107.69, 104.41,
    104.05, 100.00, 96.33, 95.79, 88.69, 90.01, 89.60, 87.70, 83.29, 83.70, 80.03, 80.21, 82.28, 78.28, 69.72, 71.61,
])
OXYGENATED = np.array([  # 1/(cm M)
    266232, 466840, 480360, 246072, 102580, 62816, 44480, 33209, 26629, 23684, 20933, 20035, 24202, 39957, 53236, 43016,
    32613, 44496, 50104, 14401, 3200, 1506, 942, 610, 442, 368, 320, 294, 278, 276, 290,
], np.float64)
DEOXYGENATED = np.array([
    223296, 303956, 407560, 528600, 413280, 103292, 23389, 16156, 14550, 16684, 20862, 25774, 31590, 39036, 46592,
    53412, 53788, 45072, 37020, 28324, 14677, 9444, 6510, 5149, 4345, 3750, 3227, 2795, 2408, 2052, 1794,
], np.float64)
# fmt: on
# linear, D65 (IEC 61966-2-1)
XYZ_TO_SRGB = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
LUMINANCE = np.array(LUMINANCE_WEIGHTS)
TABLE = 512  # entries per axis; cv2.remap rounds to 1/32 of an entry


def reflectance(
    melanin: np.ndarray,
    blood: np.ndarray,
    oxygen: float = 0.75,
    scattering: float = 1.0,
    slope: float = 2.4,
    chroma: float = 1.0,
) -> np.ndarray:
    """Return the diffuse albedo, linear sRGB float32 [..., 3]; melanin and blood are clipped to the model's range.

    melanin [...]: volume fraction in the epidermis; blood [...]: in the dermis; oxygen: saturated share of the blood;
    scattering: factor on the dermis's, denser collagen is lighter; slope: exponent of melanin's absorption towards
    blue, 3.33 for melanosomes alone (yellower), less seen through skin; chroma: power on the channels' ratios to
    luminance, as cameras show skin more saturated than a spectrometer does.
    """
    melanin, blood = np.asarray(melanin, np.float32), np.asarray(blood, np.float32)
    table = _table(*(round(float(parameter), 3) for parameter in (oxygen, scattering, slope, chroma)))
    at = np.stack([_position(blood, BLOOD_RANGE).ravel(), _position(melanin, MELANIN_RANGE).ravel()], 1)
    return raster.sample(table, at + np.float32(0.5)).reshape(*melanin.shape, 3)


def typology_angle(linear: np.ndarray) -> np.ndarray:
    """Return individual typology angles in degrees of linear sRGB [..., 3]: above 55 very light, below -30 dark.

    Chardon et al. 1991.
    """
    xyz = linear @ np.linalg.inv(XYZ_TO_SRGB).T / [0.9505, 1.0, 1.089]
    root = np.where(xyz > 216 / 24389, np.cbrt(xyz), (24389 / 27 * xyz + 16) / 116)
    return np.degrees(np.arctan2(116 * root[..., 1] - 66, 200 * (root[..., 1] - root[..., 2])))


def _position(fraction: np.ndarray, limits: tuple[float, float]) -> np.ndarray:
    low, high = np.log(limits)
    return np.clip((np.log(np.maximum(fraction, 1e-6)) - low) / (high - low), 0, 1).astype(np.float32) * (TABLE - 1)


@lru_cache(maxsize=8)
def _table(oxygen: float, scattering: float, slope: float, chroma: float) -> np.ndarray:
    """Tabulate reflectance uniformly in the logarithms: linear sRGB float32 [TABLE melanin, TABLE blood, 3]."""
    nodes = 65  # smooth functions of two variables: computed coarsely, enlarged cubically
    melanin = np.geomspace(*MELANIN_RANGE, nodes)[:, None, None]
    blood = np.geomspace(*BLOOD_RANGE, nodes)[None, :, None]
    rgb = _integrate(_spectrum(melanin, blood, oxygen, scattering, slope))
    luminance = (rgb @ LUMINANCE)[..., None]
    saturated = (rgb / luminance) ** chroma
    rgb = luminance * saturated / (saturated @ LUMINANCE)[..., None]
    x, y = np.meshgrid(*[np.linspace(0, nodes - 1, TABLE, dtype=np.float32)] * 2)
    return cv2.remap(rgb.astype(np.float32), x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)


def _spectrum(melanin: np.ndarray, blood: np.ndarray, oxygen: float, scattering: float, slope: float) -> np.ndarray:
    """Return diffuse reflectance [..., 31] per wavelength; absorption and scattering in 1/cm (Jacques 1998)."""
    baseline = BASELINE * (0.244 + 85.3 * np.exp(-(WAVELENGTHS - 154) / 66.2))
    epidermis = melanin * 333 * (WAVELENGTHS / 620) ** -slope + (1 - melanin) * baseline
    molar = 150 / 64500  # mol of haemoglobin in a litre of blood
    haemoglobin = np.log(10) * molar * (oxygen * OXYGENATED + (1 - oxygen) * DEOXYGENATED)
    dermis = blood * haemoglobin + (1 - blood) * baseline
    reduced = scattering * SCATTERING * (2e5 * WAVELENGTHS**-1.5 + 2e12 * WAVELENGTHS**-4)
    albedo = reduced / (reduced + dermis)
    index = 1.4
    internal = -1.440 / index**2 + 0.710 / index + 0.668 + 0.0636 * index
    boundary = (1 + internal) / (1 - internal)
    root = np.sqrt(3 * (1 - albedo))
    below = albedo / 2 * (1 + np.exp(-4 / 3 * boundary * root)) * np.exp(-root)
    return BACKSCATTER + (1 - BACKSCATTER) * below * np.exp(-2 * OBLIQUE * EPIDERMIS_CM * epidermis)


def _integrate(spectrum: np.ndarray) -> np.ndarray:
    """Integrate reflectance [..., 31] under D65 to linear sRGB [..., 3]; a white surface gives 1."""

    def lobe(centre: float, below: float, above: float) -> np.ndarray:
        return np.exp(-0.5 * ((WAVELENGTHS - centre) * np.where(WAVELENGTHS < centre, below, above)) ** 2)

    x = 0.362 * lobe(442.0, 0.0624, 0.0374) + 1.056 * lobe(599.8, 0.0264, 0.0323) - 0.065 * lobe(501.1, 0.0490, 0.0382)
    y = 0.821 * lobe(568.8, 0.0213, 0.0247) + 0.286 * lobe(530.9, 0.0613, 0.0322)
    z = 1.217 * lobe(437.0, 0.0845, 0.0278) + 0.681 * lobe(459.0, 0.0385, 0.0725)
    rgb = (spectrum @ (np.stack([x, y, z], -1) * D65[:, None])) @ XYZ_TO_SRGB.T / (y * D65).sum()
    white = np.stack([x, y, z], -1).T @ D65 @ XYZ_TO_SRGB.T / (y * D65).sum()
    return np.maximum(rgb / white, 1e-3)
