# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The device is proven: one that fails, computes something else or is slower is not taken, and it is said why."""

import pytest

from core.capture import freshness, stages
from core.capture.messages import Reporter
from core.settings.settings import from_json
from core.worker import runner

torch = pytest.importorskip("torch")

from core.stages.solve import device  # noqa: E402

MAP = torch.linspace(-1, 1, 14 * 4).reshape(1, 14, 2, 2)


@pytest.fixture(autouse=True)
def fresh():
    device.prove.cache_clear()
    yield
    device.prove.cache_clear()


def machine(monkeypatch, **devices) -> list[str]:
    """A machine with these devices: name -> (result, seconds) of a pass, or what it raises. The passes that were
    made."""
    tried = []

    def run_pass(name):
        tried.append(name)
        if isinstance(devices[name], Exception):
            raise devices[name]
        return devices[name]

    monkeypatch.setattr(device, "list_devices", lambda: [name for name in devices if name != "cpu"])
    monkeypatch.setattr(device, "run_pass", run_pass)
    return tried


@pytest.mark.parametrize(
    ("card", "taken", "reason"),
    [
        ((MAP + 0.01, 0.1), "cuda", "cuda takes 0.10 s for one pass of the network, the CPU 1.00 s."),
        ((MAP, 1.5), "cpu", "slower than the CPU: 1.50 s against 1.00 s"),
        ((MAP + 0.5, 0.1), "cpu", "something else"),
        ((MAP * float("nan"), 0.1), "cpu", "something else"),
        (RuntimeError("no kernel\nfor execution"), "cpu", "(RuntimeError: no kernel)."),
        (torch.cuda.OutOfMemoryError("CUDA out of memory."), "cpu", "(OutOfMemoryError: CUDA out of memory)."),
    ],
)
def test_a_card_is_taken_where_it_computes_the_same_and_faster(monkeypatch, card, taken, reason):
    machine(monkeypatch, cpu=(MAP, 1.0), cuda=card)
    proof = device.prove()
    assert proof.device == taken and reason in proof.reason


def test_the_second_card_is_tried_after_the_first_all_of_it_once_and_without_one_nothing_is_computed(monkeypatch):
    tried = machine(monkeypatch, cpu=(MAP, 1.0), cuda=RuntimeError("broken"), mps=(MAP, 0.2))
    assert device.prove().device == device.prove().device == "mps" and tried == ["cpu", "cuda", "mps"]
    device.prove.cache_clear()
    tried = machine(monkeypatch)
    assert device.prove() == device.Proof("cpu", "PyTorch finds no graphics card that it can use.") and tried == []


def test_the_pass_is_one_of_the_shipped_network_there_and_back(monkeypatch):
    monkeypatch.setattr(device, "TRIAL_TEXELS", 32)
    first, seconds = device.run_pass("cpu")
    second, _ = device.run_pass("cpu")
    assert first.shape == (1, 14, 32, 32)
    assert torch.isfinite(first).all() and 0 < seconds < 60
    assert torch.equal(first, second), "so that another device can be compared with it"
    assert first[:, :7].std() > 0.05 and first[:, 7:].abs().max() > 1e-5, "the gradient reaches the input"


def test_auto_is_the_proven_device_wherever_a_stage_computes_on_it(monkeypatch):
    machine(monkeypatch, cpu=(MAP, 1.0), cuda=(MAP, 0.1))
    said = []
    reporter = Reporter("solve", lambda message: said.append(message.text))
    assert from_json({}).device == "auto" and from_json({}).compute_device == "cpu"
    found = runner._with_device(stages.by_name("solve"), from_json({}), reporter)
    assert found.device == found.compute_device == "cuda" and said == [f"Computing on cuda: {device.prove().reason}"]
    chosen = from_json({"device": "cpu"})
    assert runner._with_device(stages.by_name("solve"), chosen, reporter) is chosen, "who chooses gets that"
    assert runner._with_device(stages.by_name("frames"), from_json({}), reporter).device == "auto" and len(said) == 1


def test_what_another_device_made_is_fresh_under_auto_and_stale_under_a_choice():
    """The rule that is judged by: freshness.changed settings of a finished scan, whose result depends on the device."""
    stage, finished = stages.by_name("scan"), {"settings": {}, "device": "cuda", "seed": 0}
    assert freshness._changed_settings(finished, stage, from_json({})) == []
    assert freshness._changed_settings(finished, stage, from_json({"device": "cpu"})) == ["device"]
