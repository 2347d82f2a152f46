# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Self-Test in Setup: clicked, watched, cancelled, clicked again, and its score read where an artist reads it."""

import addon
import driver as d

LIMIT_S = 900

TEST_LIMIT_S = 600


def flow():
    addon.unfold("WILDCAP_PT_setup")
    addon.use_solver()
    yield from d.open_tab("WildCap")
    yield 1.0
    d.screenshot("self_test_1_offered")
    yield from d.press("wildcap.self_test")
    yield from d.until(
        lambda: job() is not None and job().progress is not None, "the test's start", addon.START_LIMIT_S
    )
    yield 1.0
    d.screenshot("self_test_2_running")
    yield from d.press("wildcap.cancel")
    yield from d.until(lambda: job() is None, "the end after Cancel", 10)
    yield from d.park()
    yield 1.0
    assert not tested(), "a test that was cancelled says nothing"
    d.screenshot("self_test_3_cancelled")
    yield from d.press("wildcap.self_test")
    yield from d.until(lambda: job() is not None, "the second start", 10)
    yield from d.until(lambda: job() is None, "the end of the test", TEST_LIMIT_S)
    yield from d.park()
    yield 1.0
    d.screenshot("self_test_4_done")
    assert tested().startswith("The solver works:"), tested() or addon.problem()
    d.say(tested())


def job():
    return addon.module("jobs").of("")


def tested() -> str:
    return addon.module("preferences").get().tested
