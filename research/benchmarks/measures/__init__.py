# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures of albedos, one file each: functions of arrays that know no capture, and one form of table.

Colours are linear unless a docstring says sRGB. Where a tone is no part of the question, an answer first gets the gain
per channel that gives it the truth's mean over the texels in question. What a measure says of doing nothing, a flat
colour, a blur divided out and the true light (references.py) stands beside every answer: a measure that one of the
first three wins is read with another.
"""
