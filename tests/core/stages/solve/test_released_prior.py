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

CONFIGS = {
    "posenc, patches of 2, attention, variance": (
        {
            "depths": [1, 2, 3],
            "channels": [32, 64, 96],
            "self_attn_depths": [False, True, True],
            "patch_size": 2,
            "mapping_out": 24,
            "sigma_data": 0.5,
            "has_variance": True,
        },
        {"type": "posenc", "pos_enc_freq": 4},
    ),
    "four levels, the first left out, defaults": (
        {
            "depths": [1, 1, 2, 1],
            "channels": [32, 32, 64, 64],
            "self_attn_depths": [True, False, True, False],
            "skip_stages": 1,
            "mapping_out": 16,
        },
        {"type": "coord"},
    ),
    "noise, patches of 4, no wrapper, own mapping": (
        {
            "depths": [2],
            "channels": [32],
            "self_attn_depths": [False],
            "patch_size": 4,
            "mapping_out": 16,
            "augment_wrapper": False,
            "mapping_cond_dim": 5,
            "sigma_data": 1.0,
        },
        {"type": "noise"},
    ),
}
COND_CHANNELS = {"coord": 2, "posenc": 18, "noise": 3}


def weights_of(model: dict, cond_channels: int, wrapped: bool) -> dict[str, torch.Tensor]:
    """A state dict of a configuration with random values, its names and shapes written down from what is known of the
    released models."""
    rng = torch.Generator().manual_seed(3)
    state, mapping, levels = {}, model["mapping_out"], len(model["depths"])
    p2, skip, widths = model.get("patch_size", 1) ** 2, model.get("skip_stages", 0), model["channels"]

    def put(name, *shape, bias=True):
        state[f"{name}.weight"] = torch.randn(shape, generator=rng) * 0.6 / math.sqrt(np.prod(shape[1:]))
        if bias:
            state[f"{name}.bias"] = torch.randn(shape[0], generator=rng) * 0.1

    def put_blocks(name, first, widths_in, width, out, attention):
        for i, c_in in enumerate(widths_in):
            c_out = out if i == len(widths_in) - 1 else width
            at = f"{name}.{first + i * (2 if attention else 1)}"
            put(f"{at}.main.0.mapper", 2 * c_in, mapping)
            put(f"{at}.main.2", width, c_in, 3, 3)
            put(f"{at}.main.4.mapper", 2 * width, mapping)
            put(f"{at}.main.6", c_out, width, 3, 3)
            if c_in != c_out:
                put(f"{at}.skip", c_out, c_in, 1, 1, bias=False)
            if attention:
                at = f"{name}.{first + 2 * i + 1}"
                put(f"{at}.norm_in.mapper", 2 * c_out, mapping)
                put(f"{at}.qkv_proj", 3 * c_out, c_out, 1, 1)
                put(f"{at}.out_proj", c_out, c_out, 1, 1)

    state["timestep_embed.weight"] = torch.randn(mapping // 2, 1, generator=rng)
    extra = model.get("mapping_cond_dim", 0) + (9 if model.get("augment_wrapper", True) else 0)
    if extra:
        put("mapping_cond", mapping, extra, bias=False)
    put("mapping.0", mapping, mapping)
    put("mapping.2", mapping, mapping)
    put("proj_in", widths[max(0, skip - 1)], (7 + cond_channels) * p2, 1, 1)
    put("proj_out", 7 * p2 + model.get("has_variance", False), widths[max(0, skip - 1)], 1, 1)
    shapes = zip(model["depths"], widths, model["self_attn_depths"], strict=True)
    for level, (depth, width, attention) in enumerate(shapes):
        above, up = widths[max(0, level - 1)], f"u_net.u_blocks.{levels - 1 - level}"
        put_blocks(f"u_net.d_blocks.{level}", 1, [above] + [width] * (depth - 1), width, width, attention)
        put_blocks(
            up, 0, [width if level == levels - 1 else 2 * width] + [width] * (depth - 1), width, above, attention
        )
        if level > skip:
            kernel = torch.tensor([[1.0, 3.0, 3.0, 1.0]]) / 8
            state[f"u_net.d_blocks.{level}.0.kernel"] = kernel.T @ kernel
            state[f"{up}.{depth * (2 if attention else 1)}.kernel"] = 4 * kernel.T @ kernel
    return {f"inner_model.{name}": value for name, value in state.items()} if wrapped else state


def forward(state: dict, model: dict, x: torch.Tensor, sigma: torch.Tensor, extra: torch.Tensor | None) -> torch.Tensor:
    """The bare network written out: one statement per operation, no modules."""
    s = {name.removeprefix("inner_model."): value for name, value in state.items()}
    skip, patch = model.get("skip_stages", 0), model.get("patch_size", 1)

    def affine(name, value):
        return functional.linear(value, s[f"{name}.weight"], s.get(f"{name}.bias"))

    def conv(name, value, padding=0):
        return functional.conv2d(value, s[f"{name}.weight"], s.get(f"{name}.bias"), padding=padding)

    def norm(name, value):
        count = value.shape[1]
        grouped = value.reshape(len(value), max(1, count // 32), -1)
        deviation = (grouped.var(-1, unbiased=False, keepdim=True) + 1e-5).sqrt()
        grouped = (grouped - grouped.mean(-1, keepdim=True)) / deviation
        weight, bias = affine(f"{name}.mapper", mapped)[:, :count], affine(f"{name}.mapper", mapped)[:, count:]
        return grouped.reshape(value.shape) * (1 + weight[:, :, None, None]) + bias[:, :, None, None]

    def attention(name, value):
        n, c, h, w = value.shape
        heads = max(1, c // 64)
        qkv = conv(f"{name}.qkv_proj", norm(f"{name}.norm_in", value))
        q, k, v = qkv.reshape(n, 3, heads, c // heads, h * w).unbind(1)
        seen = torch.softmax(torch.einsum("nhci,nhcj->nhij", q, k) / math.sqrt(c // heads), -1)
        return value + conv(f"{name}.out_proj", torch.einsum("nhij,nhcj->nhci", seen, v).reshape(n, c, h, w))

    def block(name, depth, first, attends, value):
        for i in range(depth):
            at = f"{name}.{first + i * (2 if attends else 1)}"
            y = conv(f"{at}.main.2", functional.gelu(norm(f"{at}.main.0", value)), 1)
            y = conv(f"{at}.main.6", functional.gelu(norm(f"{at}.main.4", y)), 1)
            value = y + (conv(f"{at}.skip", value) if f"{at}.skip.weight" in s else value)
            if attends:
                value = attention(f"{name}.{first + 2 * i + 1}", value)
        return value

    def halved(value, kernel):
        count = value.shape[1]
        return functional.conv2d(
            functional.pad(value, (1, 1, 1, 1), mode="reflect"), kernel.expand(count, 1, 4, 4), stride=2, groups=count
        )

    def doubled(value, kernel):
        count = value.shape[1]
        padded = functional.pad(value, (1, 1, 1, 1), mode="reflect")
        return functional.conv_transpose2d(padded, kernel.expand(count, 1, 4, 4), stride=2, padding=3, groups=count)

    waves = 2 * math.pi * (sigma.log() / 4)[:, None] * s["timestep_embed.weight"][:, 0]
    mapped = torch.cat([waves.cos(), waves.sin()], 1)
    mapped = mapped if extra is None else mapped + affine("mapping_cond", extra)
    mapped = functional.gelu(affine("mapping.2", functional.gelu(affine("mapping.0", mapped))))
    n, c, h, w = x.shape
    x = x.reshape(n, c, h // patch, patch, w // patch, patch).permute(0, 1, 3, 5, 2, 4)
    x = x.reshape(n, c * patch**2, h // patch, w // patch)
    x, kept, levels = conv("proj_in", x), [], len(model["depths"])
    for level in range(skip, levels):
        if level > skip:
            x = halved(x, s[f"u_net.d_blocks.{level}.0.kernel"])
        x = block(f"u_net.d_blocks.{level}", model["depths"][level], 1, model["self_attn_depths"][level], x)
        kept.append(x)
    for level in reversed(range(skip, levels)):
        x = x if level == levels - 1 else torch.cat([x, kept[level - skip]], 1)
        name, depth, attends = (
            f"u_net.u_blocks.{levels - 1 - level}",
            model["depths"][level],
            model["self_attn_depths"][level],
        )
        x = block(name, depth, 0, attends, x)
        if level > skip:
            x = doubled(x, s[f"{name}.{depth * (2 if attends else 1)}.kernel"])
    x = conv("proj_out", x)[:, : 7 * patch**2]
    return x.reshape(n, 7, patch, patch, h // patch, w // patch).permute(0, 1, 4, 2, 5, 3).reshape(n, 7, h, w)


def write(folder, model: dict, cond: dict, state, **around) -> None:
    folder.mkdir(exist_ok=True)
    config = {"model": {"type": "image_v1", "input_channels": 7, **model}, "cond": cond}
    (folder / "config.json").write_text(json.dumps(config))
    torch.save({"model_ema": state, **around}, folder / "ckpt.pth")


@pytest.mark.parametrize("wrapped", [True, False], ids=["prefix", "no prefix"])
@pytest.mark.parametrize("name", CONFIGS)
def test_a_checkpoint_of_another_kind_gives_what_its_formulas_give(tmp_path, name, wrapped):
    model, cond = CONFIGS[name]
    channels = COND_CHANNELS[cond["type"]]
    state = weights_of(model, channels, wrapped)
    write(tmp_path, model, cond, state, epoch=3, loss=np.float64(0.5))
    network = prior_files.load(tmp_path, dtype=torch.float32).network
    rng = torch.Generator().manual_seed(1)
    x, condition = torch.randn(2, 7, 16, 32, generator=rng), torch.randn(2, channels, 16, 32, generator=rng)
    sigma, extra = (
        torch.tensor([0.05, 4.0]),
        torch.randn(2, model["mapping_cond_dim"], generator=rng) if "mapping_cond_dim" in model else None,
    )
    s, data = sigma[:, None, None, None], model.get("sigma_data", 1.0)
    inner = forward(state, model, torch.cat([x, condition], 1) / (s**2 + data**2).sqrt(), sigma, extra)
    wanted = s * data / (s**2 + data**2).sqrt() * inner + data**2 / (s**2 + data**2) * x
    assert inner.abs().mean() > 0.05, "there is something to compare"
    assert (denoise(network, x, sigma, Condition(condition, extra)) - wanted).abs().max() < 2e-5


def test_noise_is_read_where_the_folder_carries_it_and_asked_for_where_not(tmp_path):
    model, cond = CONFIGS["noise, patches of 4, no wrapper, own mapping"]
    write(tmp_path, model, cond, weights_of(model, 3, False))
    x = torch.zeros(1, 7, 16, 16)
    coords = make_coordinates(64, slice(8, 24), slice(32, 48), centred=False)
    with pytest.raises(Problem, match="fixed random map"), tell_refusals():
        prior_files.load(tmp_path, dtype=torch.float32).of_tone()(x, 1.0, coords)
    noise = np.random.default_rng(0).normal(size=(3, 64, 64)).astype(np.float32)
    np.save(tmp_path / released.NOISE_FILE, noise)
    loaded = prior_files.load(tmp_path, dtype=torch.float32)
    window = torch.from_numpy(noise[None, :, 8:24, 32:48])
    assert (
        loaded.of_tone()(x, 1.0, coords) - denoise(loaded.network, x, torch.tensor([1.0]), Condition(window))
    ).abs().max() < 1e-6
    for wrong in (noise[:2], noise[:, :8], noise.astype(np.int32), np.where(noise > 2, np.nan, noise)):
        np.save(tmp_path / released.NOISE_FILE, wrong)
        with pytest.raises(Problem, match="of shape"):
            prior_files.load(tmp_path)


@pytest.mark.parametrize("begins", [b"", b"PK\x03\x04", b"\x93NUMPY\x01\x00"])
def test_a_noise_map_that_is_damaged_or_promises_more_than_it_holds_is_refused(tmp_path, begins):
    path = tmp_path / released.NOISE_FILE
    path.write_bytes(begins + b"x" * 64 if begins else b"")
    with pytest.raises(Problem, match="noise.npy cannot be read"):
        released.read_noise(tmp_path)
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        header, {"descr": "<f4", "fortran_order": False, "shape": (3, 1 << 20, 1 << 20)}
    )
    path.write_bytes(header.getvalue())
    with pytest.raises(Problem, match="noise.npy cannot be read"):
        released.read_noise(tmp_path)


def test_what_the_config_says_of_noise_levels_is_kept(tmp_path):
    model, cond = CONFIGS["four levels, the first left out, defaults"]
    write(tmp_path, {**model, "sigma_min": 0.02, "sigma_max": 40}, cond, weights_of(model, 2, True))
    loaded = prior_files.load(tmp_path)
    assert loaded.sigmas == (0.02, 40.0) and not loaded.centred and loaded.one_scale and loaded.multiple == 4


@pytest.fixture
def good(tmp_path):
    model, cond = CONFIGS["four levels, the first left out, defaults"]
    write(tmp_path / "prior", model, cond, weights_of(model, 2, True))
    return tmp_path / "prior"


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
    with pytest.raises(Problem, match=match):
        prior_files.load(good)


def test_damaged_files_are_problems(good):
    whole = (good / "ckpt.pth").read_bytes()
    for content in (whole[: len(whole) // 2], b"", b"no checkpoint", pickle.dumps({"model_ema": print}, 2)):
        (good / "ckpt.pth").write_bytes(content)
        with pytest.raises(Problem, match="cannot be read as weights"):
            prior_files.load(good)
    torch.save({"model_ema": 3}, good / "ckpt.pth")
    with pytest.raises(Problem, match="no state dict"):
        prior_files.load(good)
    (good / "ckpt.pth").unlink()
    with pytest.raises(Problem, match="holds no ckpt"):
        prior_files.load(good)
    for text in ("{", "[]", "{}", '{"model": {"input_channels": 7}}'):
        (good / "config.json").write_text(text)
        with pytest.raises(Problem, match="does not describe a prior"):
            prior_files.load(good)
    with pytest.raises(Problem, match="does not describe a prior"):
        prior_files.load(good / "nowhere")


class Calls:
    """What a hostile checkpoint holds: unpickled, it would make a file."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return (open, (str(self.path), "w"))


def test_code_in_a_checkpoint_is_never_run(good, tmp_path):
    torch.save({"model_ema": Calls(tmp_path / "made")}, good / "ckpt.pth")
    with pytest.raises(Problem, match="Nothing in it was run"):
        prior_files.load(good)
    assert not (tmp_path / "made").exists()
