# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The authors' config.json and ckpt.pth: configurations of every kind against a network written out plainly here, and
files that are none."""

import io
import json
import math
import pickle

import numpy as np
import pytest
import torch
from torch.nn import functional

from core.capture.messages import Problem
from core.solver.prior.network import Condition, denoise
from core.solver.prior.prior import make_coordinates
from core.stages.solve import prior_files, released
from core.stages.solve.refusals import tell_refusals
from tests.fixtures.authors_prior import weights_of, write
from tests.fixtures.refused import refused


def model_of(depths: list[int], channels: list[int], attention: list[bool], mapping: int, **more) -> dict:
    return {"depths": depths, "channels": channels, "self_attn_depths": attention, "mapping_out": mapping, **more}


POSENC = model_of([1, 2, 3], [32, 64, 96], [False, True, True], 24, patch_size=2, sigma_data=0.5, has_variance=True)
FOUR_LEVELS = model_of([1, 1, 2, 1], [32, 32, 64, 64], [True, False, True, False], 16, skip_stages=1)
UNWRAPPED = model_of([2], [32], [False], 16, patch_size=4, augment_wrapper=False, mapping_cond_dim=5, sigma_data=1.0)
CONFIGS = {
    "posenc, patches of 2, attention, variance": (POSENC, {"type": "posenc", "pos_enc_freq": 4}),
    "four levels, the first left out, defaults": (FOUR_LEVELS, {"type": "coord"}),
    "noise, patches of 4, no wrapper, own mapping": (UNWRAPPED, {"type": "noise"}),
}
COND_CHANNELS = {"coord": 2, "posenc": 18, "noise": 3}
DEFAULTS, NOISE = (CONFIGS[name] for name in list(CONFIGS)[1:])


def forward(state: dict, model: dict, x: torch.Tensor, sigma: torch.Tensor, extra: torch.Tensor | None) -> torch.Tensor:
    """The bare network written out: one statement per operation, no modules."""
    s = {name.removeprefix("inner_model."): value for name, value in state.items()}
    skip, patch = model.get("skip_stages", 0), model.get("patch_size", 1)
    kernel = torch.tensor([1.0, 3.0, 3.0, 1.0]) / 8

    def affine(name, value):
        return functional.linear(value, s[f"{name}.weight"], s.get(f"{name}.bias"))

    def conv(name, value, padding=0):
        return functional.conv2d(value, s[f"{name}.weight"], s.get(f"{name}.bias"), padding=padding)

    def norm(name, value):
        weight, bias = affine(f"{name}.mapper", mapped)[:, :, None, None].chunk(2, 1)
        return functional.group_norm(value, max(1, value.shape[1] // 32), eps=1e-5) * (1 + weight) + bias

    def attention(name, value):
        n, c, h, w = value.shape
        heads = max(1, c // 64)
        qkv = conv(f"{name}.qkv_proj", norm(f"{name}.norm_in", value))
        q, k, v = qkv.reshape(n, 3, heads, c // heads, h * w).unbind(1)
        seen = torch.softmax(torch.einsum("nhci,nhcj->nhij", q, k) / math.sqrt(c // heads), -1)
        return value + conv(f"{name}.out_proj", torch.einsum("nhij,nhcj->nhci", seen, v).reshape(n, c, h, w))

    def block(name, level, first, value):
        attends = model["self_attn_depths"][level]
        for i in range(model["depths"][level]):
            at = f"{name}.{first + i * (2 if attends else 1)}"
            y = conv(f"{at}.main.2", functional.gelu(norm(f"{at}.main.0", value)), 1)
            y = conv(f"{at}.main.6", functional.gelu(norm(f"{at}.main.4", y)), 1)
            value = y + (conv(f"{at}.skip", value) if f"{at}.skip.weight" in s else value)
            if attends:
                value = attention(f"{name}.{first + 2 * i + 1}", value)
        return value

    def resampled(value, operation, gain, **options):
        weight = gain * torch.outer(kernel, kernel).expand(value.shape[1], 1, 4, 4)
        padded = functional.pad(value, (1, 1, 1, 1), mode="reflect")
        return operation(padded, weight, stride=2, groups=value.shape[1], **options)

    waves = 2 * math.pi * (sigma.log() / 4)[:, None] * s["timestep_embed.weight"][:, 0]
    mapped = torch.cat([waves.cos(), waves.sin()], 1)
    mapped = mapped if extra is None else mapped + affine("mapping_cond", extra)
    mapped = functional.gelu(affine("mapping.2", functional.gelu(affine("mapping.0", mapped))))
    x, kept, levels = conv("proj_in", functional.pixel_unshuffle(x, patch)), [], len(model["depths"])
    for level in range(skip, levels):
        if level > skip:
            x = resampled(x, functional.conv2d, 1)
        x = block(f"u_net.d_blocks.{level}", level, 1, x)
        kept.append(x)
    for level in reversed(range(skip, levels)):
        x = x if level == levels - 1 else torch.cat([x, kept[level - skip]], 1)
        x = block(f"u_net.u_blocks.{levels - 1 - level}", level, 0, x)
        if level > skip:
            x = resampled(x, functional.conv_transpose2d, 4, padding=3)
    return functional.pixel_shuffle(conv("proj_out", x)[:, : 7 * patch**2], patch)


@pytest.mark.parametrize("prefix", ["inner_model.", ""])
@pytest.mark.parametrize("name", CONFIGS)
def test_a_checkpoint_of_another_kind_gives_what_its_formulas_give(tmp_path, name, prefix):
    model, cond = CONFIGS[name]
    channels = COND_CHANNELS[cond["type"]]
    state = weights_of(model, cond, prefix)
    write(tmp_path, model, cond, state, epoch=3, loss=np.float64(0.5))
    network = prior_files.load(tmp_path, dtype=torch.float32).network
    rng = torch.Generator().manual_seed(1)
    x, condition = torch.randn(2, 7, 16, 32, generator=rng), torch.randn(2, channels, 16, 32, generator=rng)
    sigma = torch.tensor([0.05, 4.0])
    extra = torch.randn(2, model["mapping_cond_dim"], generator=rng) if "mapping_cond_dim" in model else None
    s, data = sigma[:, None, None, None], model.get("sigma_data", 1.0)
    inner = forward(state, model, torch.cat([x, condition], 1) / (s**2 + data**2).sqrt(), sigma, extra)
    wanted = s * data / (s**2 + data**2).sqrt() * inner + data**2 / (s**2 + data**2) * x
    assert inner.abs().mean() > 0.05, "there is something to compare"
    assert (denoise(network, x, sigma, Condition(condition, extra)) - wanted).abs().max() < 2e-5


def test_noise_is_read_where_the_folder_carries_it_and_asked_for_where_not(tmp_path):
    def load():
        return prior_files.load(tmp_path, dtype=torch.float32)

    write(tmp_path, *NOISE, weights_of(*NOISE, prefix=""))
    x, coords = torch.zeros(1, 7, 16, 16), make_coordinates(64, slice(8, 24), slice(32, 48), centred=False)
    with pytest.raises(Problem, match="fixed random map"), tell_refusals():
        load().of_tone()(x, 1.0, coords)
    noise = np.random.default_rng(0).normal(size=(3, 64, 64)).astype(np.float32)
    np.save(tmp_path / released.NOISE_FILE, noise)
    window = Condition(torch.from_numpy(noise[None, :, 8:24, 32:48]))
    wanted = denoise(load().network, x, torch.tensor([1.0]), window)
    assert (load().of_tone()(x, 1.0, coords) - wanted).abs().max() < 1e-6
    for wrong in (noise[:2], noise[:, :8], noise.astype(np.int32), np.where(noise > 2, np.nan, noise)):
        np.save(tmp_path / released.NOISE_FILE, wrong)
        refused(lambda: load(), "of shape")


def promising_header() -> bytes:
    header = io.BytesIO()
    shape = {"descr": "<f4", "fortran_order": False, "shape": (3, 1 << 20, 1 << 20)}
    np.lib.format.write_array_header_1_0(header, shape)
    return header.getvalue()


@pytest.mark.parametrize("begins", [b"", b"PK\x03\x04 and more", b"\x93NUMPY\x01\x00 and more", promising_header()])
def test_a_noise_map_that_is_damaged_or_promises_more_than_it_holds_is_refused(tmp_path, begins):
    (tmp_path / released.NOISE_FILE).write_bytes(begins)
    refused(lambda: released.read_noise(tmp_path), "noise.npy cannot be read")


def test_what_the_config_says_of_noise_levels_is_kept(tmp_path):
    model, cond = DEFAULTS
    loaded = prior_files.load(write(tmp_path, {**model, "sigma_min": 0.02, "sigma_max": 40}, cond))
    assert loaded.sigmas == (0.02, 40.0) and not loaded.centred and loaded.one_scale and loaded.multiple == 4


@pytest.fixture
def good(tmp_path):
    return write(tmp_path / "prior", *DEFAULTS)


@pytest.mark.parametrize(
    ("entry", "value", "match"),
    [
        ("type", "image_transformer_v2", "image_transformer_v2"),
        ("input_channels", 3, "models 3 channels"),
        ("channels", [32, 32, 64, 96], "does not fit"),
        ("depths", [1, 1], "one length"),
        ("mapping_out", "many", "no positive numbers"),
        ("cross_cond_dim", 8, "cross attention"),
        ("patch_size", 2, "does not fit"),
    ],
)
def test_other_models_are_told_apart(good, entry, value, match):
    config = json.loads((good / "config.json").read_text())
    config["model"] |= {entry: value, "cross_attn_depths": [True] * 4}
    (good / "config.json").write_text(json.dumps(config))
    refused(lambda: prior_files.load(good), match)


def test_damaged_files_are_problems(good):
    def load():
        return prior_files.load(good)

    checkpoint, config = good / "ckpt.pth", good / "config.json"
    whole = checkpoint.read_bytes()
    for content in (whole[: len(whole) // 2], b"", b"no checkpoint", pickle.dumps({"model_ema": print}, 2)):
        checkpoint.write_bytes(content)
        refused(load, "cannot be read as weights")
    torch.save({"model_ema": 3}, checkpoint)
    refused(load, "no state dict")
    checkpoint.unlink()
    refused(load, "holds no ckpt")
    for text in ("{", "[]", "{}", '{"model": {"input_channels": 7}}'):
        config.write_text(text)
        refused(load, "does not describe a prior")
    refused(lambda: prior_files.load(good / "nowhere"), "does not describe a prior")


class Calls:
    """A hostile checkpoint: unpickled, it would make a file."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return (open, (str(self.path), "w"))


def test_code_in_a_checkpoint_is_never_run(good, tmp_path):
    torch.save({"model_ema": Calls(tmp_path / "made")}, good / "ckpt.pth")
    refused(lambda: prior_files.load(good), "Nothing in it was run")
    assert not (tmp_path / "made").exists()
