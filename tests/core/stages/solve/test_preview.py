# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a running solve shows of itself: pictures that change, and a loss that falls."""

import numpy as np

from core.capture.messages import Preview, Reporter
from core.imaging import images
from core.stages import solve
from core.stages.solve import drawing
from tests.fixtures.painted_skin import make, settings


def test_a_solve_shows_pictures_that_change_and_how_its_loss_falls(tmp_path, monkeypatch):
    capture, seen, drawn = make(tmp_path / "a.wildcap"), [], []
    curve = drawing.draw_loss_curve

    def loss_curve(losses, steps):
        drawn.append((list(losses), steps))
        return curve(losses, steps)

    monkeypatch.setattr(drawing, "draw_loss_curve", loss_curve)

    def hear(message) -> None:
        if isinstance(message, Preview):
            seen.append((message.path, (capture.root / message.path).read_bytes()))

    solve.run(capture, settings(checkpoint_every=2), Reporter("solve", hear))
    for name in ("albedo", "shading", "loss"):
        assert len({content for path, content in seen if path == f"preview/{name}.png"}) > 1, name
    losses, steps = drawn[-1]
    assert [step for step, _ in losses] == list(range(1, losses[-1][0] + 1)) and losses[-1][0] <= steps
    assert losses[-1][1] < 0.7 * losses[0][1]
    assert images.read_data(capture.preview / "loss.png").shape[:2] == drawing.CURVE_PX


def test_the_loss_curve_falls_from_the_upper_left_to_the_lower_right():
    picture = drawing.draw_loss_curve([(step, 0.1 ** (step / 5)) for step in range(1, 11)], 10)
    orange = np.argwhere(picture[..., 0] > 0.8)
    first, last = orange[orange[:, 1] < 10], orange[orange[:, 1] > picture.shape[1] - 10]
    assert first[:, 0].mean() < 20 and last[:, 0].mean() > picture.shape[0] - 20
    half = drawing.draw_loss_curve([(step, 0.1 ** (step / 5)) for step in range(1, 6)], 10)
    assert not (half[:, 140:, 0] > 0.8).any(), "what is still to come is empty"
    assert np.isfinite(drawing.draw_loss_curve([(1, 0.0)], 10)).all()
