# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which process wrote a line or holds a lease, and whether it is still there."""

from core.contract import processes


def test_processes_are_told_apart():
    me = processes.identify_process()
    assert not processes.is_gone(me) and processes.is_at_work(me)
    assert processes.is_gone({**me, "began": "another time"}) and processes.is_gone({**me, "pid": 2**22 + 1})
    container = {**me, "pid": 2**22 + 1, "host": processes.name_host() + "0"}
    assert not processes.is_gone(container) and not processes.is_at_work(container), "a number there means nothing here"
    elsewhere = {**me, "host": "another machine"}
    assert not processes.is_gone(elsewhere) and not processes.is_at_work(elsewhere)
