# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The connection to a Ray cluster, or to one of this machine alone: quick to fail, silent, and with a token.

Standard library but for Ray.
"""

from __future__ import annotations

import contextlib
import os
import secrets
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

from ..capture.messages import Problem

QUIET = {
    "RAY_USAGE_STATS_ENABLED": "0",
    "RAY_BACKEND_LOG_LEVEL": "fatal",
    "RAY_DEDUP_LOGS_SKIP_REGEX": "^",
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",
}
"""Keeps Ray from reporting its use and from writing to our terminal."""
REACH_S, JOIN_S = 3.0, 12.0
"""Longest time for a head node to answer, and then to accept us; Ray itself would try for minutes."""
STORE_BYTES = 100 << 20
"""Ray's shared memory, close to its minimum: outcomes take a few hundred bytes."""


@contextlib.contextmanager
def connect(address: str | None) -> Iterator:
    """Connect to Ray and yield it; all our tasks end with the block. Raises Problem."""
    os.environ.update(QUIET)
    if address is None:  # a token keeps everybody else out
        os.environ["RAY_AUTH_MODE"] = "token"
        os.environ.setdefault("RAY_AUTH_TOKEN", secrets.token_hex(32))
    elif "RAY_AUTH_MODE" not in os.environ:
        in_environment = {"RAY_AUTH_TOKEN", "RAY_AUTH_TOKEN_PATH"} & os.environ.keys()
        has_token = in_environment or (Path.home() / ".ray" / "auth_token").is_file()
        os.environ["RAY_AUTH_MODE"] = "token" if has_token else "disabled"
    try:
        with _mute():
            import ray
            import ray.util.scheduling_strategies
    except ImportError as error:
        raise Problem(
            f"This Python has no Ray ({error}).",
            "Install the packages of requirements/farm.txt, or run the batch with --on local.",
        ) from error
    quiet = {"log_to_driver": False, "configure_logging": False, "logging_level": "CRITICAL"}
    own = {"include_dashboard": False, "object_store_memory": STORE_BYTES, "_node_ip_address": "127.0.0.1"}
    with _mute():
        try:
            if address is None:
                _begin(lambda: ray.init("local", **own, **quiet))
            else:
                _reach(address)
                _join(lambda: ray.init(address, **quiet), address)
            yield ray
        finally:
            ray.shutdown()


@contextlib.contextmanager
def _mute() -> Iterator[None]:
    """Discard what Ray prints to stderr; our own output goes to stdout or is raised."""
    sys.stderr.flush()
    stderr, null = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 2)
    try:
        yield
    finally:
        os.dup2(stderr, 2)
        os.close(stderr)
        os.close(null)


def _begin(begin: Callable[[], object]) -> None:
    """Start Ray here. Raises Problem if it fails, for instance within its 30 seconds on a busy machine."""
    try:
        begin()
    except Exception as error:  # Ray has no class of its own for this
        raise Problem(
            f"Ray could not be started on this machine: {str(error).strip().partition(chr(10))[0]}",
            "Try again when the machine is less busy, or run the batch with --on local.",
        ) from error


def _reach(address: str) -> None:
    """Raise Problem if nothing answers at an address."""
    if address == "auto":
        return
    host, _, port = address.rpartition(":")
    if not host or not port.isdecimal():
        raise Problem(
            f"{address} is not the address of a Ray head node.",
            "Write it as HOST:PORT, as `ray start --head` prints it; the default port is 6379.",
        )
    try:
        socket.create_connection((host.strip("[]"), int(port)), REACH_S).close()
    except (OSError, OverflowError) as error:
        raise _unreachable(address, str(error)) from error


def _join(begin: Callable[[], object], address: str) -> None:
    """Connect in a thread, for Ray is slow to fail. Raises Problem."""
    ended: list[BaseException | None] = []

    def run() -> None:
        try:
            begin()
            ended.append(None)
        except BaseException as error:  # Ray exits when it gives up
            ended.append(error)

    thread = threading.Thread(target=run, name="wildcap-ray", daemon=True)
    thread.start()
    thread.join(JOIN_S)
    if not ended or ended[0] is not None:
        raise _unreachable(address, str(ended[0]).partition("\n")[0] if ended else f"no answer in {JOIN_S:.0f} s")


def _unreachable(address: str, why: str) -> Problem:
    return Problem(
        f"No Ray cluster can be reached at {address} ({why}).",
        "Check that its head node runs (`ray status`), that this machine is one of its nodes (`ray start "
        "--address=HOST:PORT --num-cpus=0`), and that both have Ray's token.",
    )
