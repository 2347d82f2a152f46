# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The SwitchLight API of Beeble: address, protocol and prices.

From its public documentation (switchlight-api.beeble.ai/docs: quickstart, material acquisition, FAQ), NOT VERIFIED
AGAINST THE LIVE SERVICE. That `acquire/albedo` answers with a PNG is known only from programs that rely on it.
"""

from __future__ import annotations

import os
import urllib.parse

from .messages import Problem

COMPANY = "Beeble"
WEBSITE = "switchlight-api.beeble.ai"
BASE = "https://sdk.beeble.ai/v1"
ALBEDO, CREDITS = "/acquire/albedo", "/credits"
KEY_HEADER = "x-api-key"
PICTURE_FIELD = "source_image"
BALANCE = ("Credits", "Total")
"""Keys of the remaining credits in the answer to CREDITS."""
CREDITS_PER_PICTURE, CREDITS_PER_PREVIEW = 1.0, 0.5
PREVIEW_PX = 512
"""Largest side of a preview. The service reduces pictures longer than 2048."""
MOST_AT_ONCE = 3
"""Concurrent calls; the service takes 100 pictures a minute, and each takes about five seconds."""

KEY_VARIABLE = "WILDCAP_SWITCHLIGHT_KEY"
BASE_VARIABLE = "WILDCAP_SWITCHLIGHT_URL"
OFFLINE_VARIABLE = "WILDCAP_OFFLINE"
"""Environment variables: the key, another server with the same protocol (for tests), and that nothing may be sent."""


_kept = ""


def form(preview: bool) -> dict[str, str]:
    """Return the fields sent with a picture. auto_key has the service cut out the background."""
    return {"auto_key": "true", "preview": "true" if preview else "false"}


def price(pictures: int, preview: bool) -> float:
    """Return the credits for a number of pictures."""
    return pictures * (CREDITS_PER_PREVIEW if preview else CREDITS_PER_PICTURE)


def amount(credits: float) -> str:
    """Format credits: '16 credits', '0.5 credits'."""
    return f"{credits:g} credit{'' if credits == 1 else 's'}"


def base() -> str:
    """Return the address of the service. Raises Problem if it is not encrypted and on another machine."""
    address = os.environ.get(BASE_VARIABLE, "").rstrip("/") or BASE
    parts = urllib.parse.urlsplit(address)
    if parts.scheme != "https" and not (parts.scheme == "http" and local(address)):
        raise Problem(
            f"The address in {BASE_VARIABLE} is not a safe one.",
            "It begins with https://, or with http:// on this machine.",
        )
    return address


def host() -> str:
    """Return the name of the machine that pictures are sent to."""
    return urllib.parse.urlsplit(base()).hostname or ""


def local(address: str) -> bool:
    """Return whether an address is on this machine."""
    return urllib.parse.urlsplit(address).hostname in ("127.0.0.1", "localhost", "::1")


def keep_key() -> None:
    """Move the key out of this process's environment, which every child would inherit, for `key`."""
    global _kept
    _kept = os.environ.pop(KEY_VARIABLE, "")


def environment_without_key() -> dict[str, str]:
    """Return this process's environment for children that do not need the key."""
    return {name: value for name, value in os.environ.items() if name != KEY_VARIABLE}


def key() -> str:
    """Return the artist's key. Raises Problem, never with its text, if it is missing or cannot be one."""
    api_key = (os.environ.get(KEY_VARIABLE) or _kept).strip()
    if not api_key:
        raise Problem(
            "SwitchLight needs a key, and there is none.",
            f"Get one at {WEBSITE} and put it into the extension's preferences, or into the environment "
            f"variable {KEY_VARIABLE}.",
        )
    if not (api_key.isascii() and api_key.isprintable()) or " " in api_key:
        raise Problem(
            "This is not a SwitchLight key: it contains spaces or other invalid characters.",
            f"Copy it again from {WEBSITE}.",
        )
    return api_key
