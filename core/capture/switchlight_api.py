# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is known of the SwitchLight API of Beeble, all of it here: where it is, how it is spoken to, what it charges.

Ground floor: standard library only. From its public documentation (switchlight-api.beeble.ai/docs: quickstart, material
acquisition, FAQ), NOT VERIFIED AGAINST THE LIVE SERVICE. Calls to `acquire/albedo` answer with a PNG; that its page
says so was not seen, only programs that rely on it.
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
"""Where the answer to CREDITS holds what is left."""
CREDITS_PER_PICTURE, CREDITS_PER_PREVIEW = 1.0, 0.5
PREVIEW_PX = 512
"""Longer side of a preview's answer at most. A picture longer than 2048 is made smaller by the service."""
MOST_AT_ONCE = 3
"""Calls under way at the same time; the service takes 100 pictures a minute, and each takes it about five seconds."""

KEY_VARIABLE = "WILDCAP_SWITCHLIGHT_KEY"
BASE_VARIABLE = "WILDCAP_SWITCHLIGHT_URL"
OFFLINE_VARIABLE = "WILDCAP_OFFLINE"
"""Environment variables: the key, another server that speaks the same protocol (for tests), and that nothing may be
sent."""


_kept = ""


def form(preview: bool) -> dict[str, str]:
    """The fields that go with a picture. Without auto_key's default, the background would have to be cut out before."""
    return {"auto_key": "true", "preview": "true" if preview else "false"}


def price(pictures: int, preview: bool) -> float:
    """Credits for so many pictures."""
    return pictures * (CREDITS_PER_PREVIEW if preview else CREDITS_PER_PICTURE)


def amount(credits: float) -> str:
    """Credits in words: '16 credits', '0.5 credits'."""
    return f"{credits:g} credit{'' if credits == 1 else 's'}"


def base() -> str:
    """The address that calls go to. Raises Problem where it would carry the key and the pictures unencrypted over a
    network."""
    address = os.environ.get(BASE_VARIABLE, "").rstrip("/") or BASE
    parts = urllib.parse.urlsplit(address)
    if parts.scheme != "https" and not (parts.scheme == "http" and local(address)):
        raise Problem(
            f"The address in {BASE_VARIABLE} is not a safe one.",
            "It begins with https://, or with http:// on this very machine.",
        )
    return address


def host() -> str:
    """The name of the machine that pictures are sent to."""
    return urllib.parse.urlsplit(base()).hostname or ""


def local(address: str) -> bool:
    return urllib.parse.urlsplit(address).hostname in ("127.0.0.1", "localhost", "::1")


def keep_key() -> None:
    """Takes the key out of this process's environment, which all that it starts would inherit, and keeps it for
    `key`."""
    global _kept
    _kept = os.environ.pop(KEY_VARIABLE, "")


def environment_without_key() -> dict[str, str]:
    """This process's environment, for what it starts and what has no use for the key."""
    return {name: value for name, value in os.environ.items() if name != KEY_VARIABLE}


def key() -> str:
    """The artist's key. Raises Problem where there is none, or it cannot be one; its text is never part of a
    message."""
    api_key = (os.environ.get(KEY_VARIABLE) or _kept).strip()
    if not api_key:
        raise Problem(
            "SwitchLight needs a key, and there is none.",
            f"Get one at {WEBSITE} and put it into the extension's preferences, or into the environment "
            f"variable {KEY_VARIABLE}.",
        )
    if not (api_key.isascii() and api_key.isprintable()) or " " in api_key:
        raise Problem(
            "This is no key of SwitchLight: it holds spaces or other characters that no key has.",
            f"Copy it again from {WEBSITE}.",
        )
    return api_key
