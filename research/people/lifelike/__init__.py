# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Subjects like people: shape outside the identity basis, eyes, strands of hair, clothes, and the filming phone.

They stand beside the bald subjects, whose seeds and results stay as they are.
"""
