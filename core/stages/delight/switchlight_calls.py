# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One call to the SwitchLight API: a picture as multipart/form-data (RFC 7578), answered by a PNG or an error.

The key is in one header of the request and in no message. Redirections are not followed: they would carry it to another
machine.
"""

from __future__ import annotations

import email.utils
import http.client
import json
import ssl
import struct
import time
import urllib.error
import urllib.request
import uuid
import zlib
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field

from ... import __version__
from ...capture import switchlight_api as service
from ...capture.messages import Problem

MEDIA_TYPES = {".jpg": "image/jpeg", ".jpeg": "image/jpeg", ".png": "image/png", ".webp": "image/webp"}
BUSY_STATUSES = (408, 425, 429, 500, 502, 503, 504)


class AgainError(Exception):
    """Failure that may not last, for a `reason` in a few words.

    after_s: seconds that the service asks to wait, None if it does not say; spoiled: a useless answer came that may
    have been charged; reached: there was a connection.
    """

    def __init__(self, reason: str, after_s: float | None = None, spoiled: bool = False, reached: bool = True):
        super().__init__(reason)
        self.reason, self.after_s, self.spoiled, self.reached = reason, after_s, spoiled, reached


class AccountProblem(Problem):
    """Failure of all calls: the key, the credits, a machine that is not who it says."""


@dataclass(frozen=True)
class Account:
    """Address of the service, and the key that pays."""

    base: str
    key: str = field(repr=False)  # not in tracebacks and logs


def albedo(
    account: Account,
    data: bytes,
    suffix: str,
    preview: bool,
    silence_s: float,
    call_s: float,
    stopped: Callable[[], bool],
) -> bytes:
    """Send a picture file and return the whole PNG that answers it.

    Gives up after silence_s without a byte, after call_s in all, and between parts of the answer once `stopped()`.
    Raises AgainError for failures that may not last, Problem for others.
    """
    boundary = uuid.uuid4().hex
    request = _request(account, service.ALBEDO, _multipart(boundary, data, suffix, service.form(preview)))
    request.add_header("Content-Type", f"multipart/form-data; boundary={boundary}")
    answer = _answer(account, request, silence_s, time.monotonic() + call_s, stopped)
    if not is_whole_png(answer):
        raise _refusal(account, 200, answer) or AgainError("an answer that is no whole picture", spoiled=True)
    return answer


def balance(account: Account, silence_s: float = 10.0) -> float | None:
    """Return the account's credits, None if the service does not say.

    Raises Problem if it refuses the key or cannot be reached.
    """
    try:
        request, end = _request(account, service.CREDITS), time.monotonic() + silence_s
        reply = json.loads(_answer(account, request, silence_s, end, lambda: False))
        for name in service.BALANCE:
            reply = reply[name]
        return float(reply)
    except AgainError as error:
        if not error.reached:
            raise Problem(
                f"SwitchLight cannot be used now: {error.reason}. Nothing was sent.",
                "Check the network connection, and run again.",
            ) from None
    except AccountProblem:
        raise
    except (Problem, ValueError, KeyError, TypeError):
        pass  # a service that does not report its balance may still work
    return None


def is_whole_png(data: bytes) -> bool:
    """Return True if every chunk up to the last is there and has its checksum (PNG specification, 5.3)."""
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        return False
    at = 8
    while at + 12 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 4 : at + 8 + length]
        if len(body) != 4 + length or data[at + 8 + length : at + 12 + length] != struct.pack(">I", zlib.crc32(body)):
            return False
        if kind == b"IEND":
            return True
        at += 12 + length
    return False


def _request(account: Account, path: str, body: bytes | None = None) -> urllib.request.Request:
    return urllib.request.Request(
        account.base + path, body, {service.KEY_HEADER: account.key, "User-Agent": f"WildCap-for-Blender/{__version__}"}
    )


def _multipart(boundary: str, data: bytes, suffix: str, fields: dict[str, str]) -> bytes:
    """Return the body; the picture's own name is not sent, as it may name a person."""
    parts = [
        f'--{boundary}\r\nContent-Disposition: form-data; name="{name}"\r\n\r\n{value}\r\n'.encode()
        for name, value in fields.items()
    ]
    head = (
        f'--{boundary}\r\nContent-Disposition: form-data; name="{service.PICTURE_FIELD}"; '
        f'filename="frame{suffix}"\r\n'
        f"Content-Type: {MEDIA_TYPES[suffix]}\r\n\r\n"
    ).encode()
    return b"".join([*parts, head, data, f"\r\n--{boundary}--\r\n".encode()])


class _Stay(urllib.request.HTTPRedirectHandler):
    def redirect_request(self, *_):
        return None


def _answer(
    account: Account, request: urllib.request.Request, silence_s: float, end: float, stopped: Callable[[], bool]
) -> bytes:
    """Return the whole body of an answer with status 200. Raises AgainError or Problem."""
    # the system's proxy, if any, but not to this machine
    proxy = [urllib.request.ProxyHandler({})] if service.local(account.base) else []
    opener = urllib.request.build_opener(_Stay, *proxy)
    try:
        with opener.open(request, timeout=silence_s) as response:
            return _read(response, end, stopped)
    except urllib.error.HTTPError as error:
        body = b""
        with error, suppress(OSError, http.client.HTTPException, ValueError):
            body = error.read(4096)
        if error.code in BUSY_STATUSES:
            raise AgainError(f"it is busy ({error.code})", _after(error.headers.get("Retry-After"))) from None
        raise _refusal(account, error.code, body) from None
    except urllib.error.URLError as error:
        if isinstance(error.reason, ssl.SSLCertVerificationError):
            raise AccountProblem(
                f"{service.host()} did not prove who it is ({error.reason.verify_message}); nothing was sent.",
                "Check this machine's clock and its certificates, or ask who looks after its network.",
            ) from None
        if isinstance(error.reason, TimeoutError):
            raise AgainError("it did not answer in time") from None
        cause = getattr(error.reason, "strerror", None) or error.reason
        raise AgainError(f"it cannot be reached ({cause})", reached=False) from None
    except TimeoutError:
        raise AgainError("it did not answer in time") from None
    except (OSError, http.client.HTTPException) as error:
        raise AgainError(
            f"the connection broke ({type(error).__name__})", spoiled=isinstance(error, http.client.IncompleteRead)
        ) from None


def _read(response, end: float, stopped: Callable[[], bool]) -> bytes:
    parts = []
    while chunk := response.read1(1 << 16):
        parts.append(chunk)
        if time.monotonic() > end or stopped():
            raise TimeoutError
    body, length = b"".join(parts), response.headers.get("Content-Length")
    if length is not None and len(body) != int(length):
        raise http.client.IncompleteRead(b"", int(length) - len(body))
    return body


def _refusal(account: Account, status: int, body: bytes) -> Problem | None:
    """Return the meaning of a refusal; None for an answer with status 200 without a message."""
    message = _message(body).replace(account.key, "(the key)")
    detail = f"({status}: {message})" if message else f"({status})"
    if status == 402 or "no credit" in message.lower():
        return AccountProblem(
            "SwitchLight says that your account has no credits left.",
            f"Buy some at {service.WEBSITE}, then run again: what came is kept.",
        )
    if status in (401, 403):
        return AccountProblem(
            f"SwitchLight does not accept the key {detail}.",
            f"Compare it with the one on your account's page at {service.WEBSITE}.",
        )
    if status != 200 or message:
        return Problem(
            f"SwitchLight's answer is not as documented {detail}.",
            "What came is kept. If this happens again, the service may have changed: look for a newer "
            "version of this extension.",
        )
    return None


def _message(body: bytes) -> str:
    """Return the message of a JSON answer in one line; "" for none."""
    try:
        answer = json.loads(body)
        text = answer.get("message") or answer.get("detail") or answer.get("error") or answer
    except (ValueError, AttributeError):
        return ""
    return " ".join((text if isinstance(text, str) else json.dumps(text)).split())[:200].rstrip(".")


def _after(header: str | None) -> float | None:
    """Return the seconds of a Retry-After header, a number of them or a date (RFC 9110, 10.2.3); None for none."""
    if header is None:
        return None
    if header.strip().isdigit():
        return float(header)
    try:
        return max(0.0, email.utils.parsedate_to_datetime(header).timestamp() - time.time())
    except (ValueError, TypeError):
        return None
