# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Drivers by simple expressions, which Blender evaluates without Python."""

import bpy


def add(block, field: str, expression: str, index: int = -1) -> bpy.types.Driver:
    """Drive a field by an expression, whose variables are still to be added."""
    driver = block.driver_add(field, index).driver
    driver.type = 'SCRIPTED'
    driver.expression = expression
    return driver


def lead(driver: bpy.types.Driver, keys: bpy.types.Key, path: str, name: str = "") -> None:
    """Add a variable that reads a property of shape keys."""
    variable = driver.variables.new()
    variable.name = name or variable.name
    variable.targets[0].id_type, variable.targets[0].id = 'KEY', keys
    variable.targets[0].data_path = path


def value_of(unit: str) -> str:
    """Return the path of a unit's value in its shape keys."""
    return f'key_blocks["{unit}"].value'
