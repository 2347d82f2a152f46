# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The way to a cluster of Ray's, or to one of this machine alone: within seconds or not at all, in silence, and with a
token. Standard library but for Ray."""

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
"""Ray tells nobody of its use, and nothing on our terminal."""
REACH_S, JOIN_S = 3.0, 12.0
"""How long a head node may take to answer at all, and then to take us in: Ray itself would try for minutes."""
STORE_BYTES = 100 << 20
"""Ray's shared memory, for outcomes of a few hundred bytes: near the least it takes."""


@contextlib.contextmanager
def connect(address: str | None) -> Iterator:
    """Ray, connected; where that ends, every task of ours ends with it. Raises Problem."""
    os.environ.update(QUIET)
    if address is None:  # its processes answer nobody but us
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
            "Install what requirements/farm.txt names, or run the batch with --on local.",
        ) from error
    quiet = {"log_to_driver": False, "configure_logging": False, "logging_level": "CRITICAL"}
    with _mute():
        try:
            if address is None:
                _begin(
                    lambda: ray.init(
                        "local",
                        include_dashboard=False,
                        object_store_memory=STORE_BYTES,
                        _node_ip_address="127.0.0.1",
                        **quiet,
                    )
                )
            else:
                _reach(address)
                _join(lambda: ray.init(address, **quiet), address)
            yield ray
        finally:
            ray.shutdown()


@contextlib.contextmanager
def _mute() -> Iterator[None]:
    """What Ray prints in our name goes nowhere; what we have to say goes to stdout, or is raised."""
    sys.stderr.flush()
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


def _begin(begin: Callable[[], object]) -> None:
    """Raises Problem where Ray does not come up, as within the 30 seconds that it gives itself on a machine that is
    busy with something else."""
    try:
        begin()
    except Exception as error:  # it has no class of its own for that
        said = str(error).strip().partition("\n")[0]
        raise Problem(
            f"Ray could not be started on this machine: {said}",
            "Try again when it is less busy, or run the batch with --on local.",
        ) from error


def _reach(address: str) -> None:
    """Raises Problem where nothing answers there."""
    if address == "auto":
        return
    host, _, port = address.rpartition(":")
    if not host or not port.isdecimal():
        raise Problem(
            f"{address} is not the address of a Ray head node.",
            "Write it as HOST:PORT; `ray start --head` tells it. The port is 6379 if you chose none.",
        )
    try:
        socket.create_connection((host.strip("[]"), int(port)), REACH_S).close()
    except (OSError, OverflowError) as error:
        raise _unreachable(address, str(error)) from error


def _join(begin: Callable[[], object], address: str) -> None:
    """Connects in a thread, for Ray does not say in time that it cannot. Raises Problem."""
    ended: list[BaseException | None] = []

    def run() -> None:
        try:
            begin()
            ended.append(None)
        except BaseException as error:  # Ray exits where it gives up
            ended.append(error)

    thread = threading.Thread(target=run, name="wildcap-ray", daemon=True)
    thread.start()
    thread.join(JOIN_S)
    if not ended or ended[0] is not None:
        raise _unreachable(address, str(ended[0]).partition("\n")[0] if ended else f"no answer in {JOIN_S:.0f} s")


def _unreachable(address: str, why: str) -> Problem:
    return Problem(
        f"No Ray cluster can be reached at {address} ({why}).",
        "See that its head node runs (`ray status` there), that this machine is one of its nodes (`ray "
        "start --address=HOST:PORT --num-cpus=0` makes"
        " it one), and that both have Ray's token.",
    )
