# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the flows, each in a Blender with an empty profile on a virtual screen; ends with the line N passed, N failed.

    python3 suite.py ZIP OUT [FLOW ...]        inside the chroot; a flow is flows/NAME.py, or by_name/NAME.py, which
    runs only when it is named

Logs, and what flows leave, are in the folder OUT.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
SIZE = (1280, 800)
BLENDER = ("blender", "--enable-event-simulate", "--no-window-focus", "-p", "0", "0")
LIMIT_S = 1800
WITHOUT = {"one_button", "button_by_button"}
"""Flows that begin without the add-on: they drag its zip into the window."""


def main() -> int:
    archive, out, *names = sys.argv[1:]
    flows = [next(HERE.glob(f"*/{name}.py")) for name in names] or sorted((HERE / "flows").glob("*.py"))
    display = start_screen()
    results = {flow.stem: run(flow, Path(archive), Path(out), display) for flow in flows}
    for name, (passed, seconds) in results.items():
        print(f"{'PASSED' if passed else 'FAILED'} {name} ({seconds:.0f} s)")
    failed = sum(not passed for passed, _ in results.values())
    print(f"{len(results) - failed} passed, {failed} failed")
    return 1 if failed or not results else 0


def start_screen() -> str:
    """Starts a virtual X server that ends with this process; returns its display."""
    reader, writer = os.pipe()
    subprocess.Popen(
        ["Xvfb", "-displayfd", str(writer), "-screen", "0", f"{SIZE[0]}x{SIZE[1]}x24", "-nolisten", "tcp"],
        pass_fds=[writer],
        stderr=subprocess.DEVNULL,
    )
    os.close(writer)
    number = os.read(reader, 16).decode().strip()
    if not number:
        raise SystemExit("Xvfb did not start: there is no screen to open a window on.")
    return f":{number}"


def run(flow: Path, archive: Path, out: Path, display: str) -> tuple[bool, float]:
    """Installs the zip into an empty profile, but for a flow that does so itself, and runs the flow. True if it passed,
    and its seconds."""
    started = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder) / "home"
        (home / "Documents").mkdir(parents=True)
        environment = {
            **os.environ,
            "DISPLAY": display,
            "HOME": str(home),
            "BLENDER_USER_RESOURCES": str(Path(folder) / "profile"),
            "WILDCAP_GUI_OUT": str(out),
            "WILDCAP_GUI_ZIP": str(archive),
            "PYTHONDONTWRITEBYTECODE": "1",
        }
        if flow.stem not in WITHOUT:
            install = subprocess.run(
                ["blender", "--command", "extension", "install-file", "-r", "user_default", "-e", str(archive)],
                env=environment,
                capture_output=True,
                text=True,
            )
            if install.returncode:
                print(install.stdout, install.stderr, sep="\n")
                return False, time.monotonic() - started
        log = out / f"{flow.stem}.log"
        with open(log, "w", encoding="utf-8") as file:
            try:
                code = subprocess.call(
                    [*BLENDER, *map(str, SIZE), "-P", HERE / "launch.py", "--", flow.stem],
                    env=environment,
                    stdout=file,
                    stderr=subprocess.STDOUT,
                    timeout=LIMIT_S,
                )
            except subprocess.TimeoutExpired:
                code = -1
        text = log.read_text(encoding="utf-8", errors="replace")
        # A Blender that never opened its window must not count as passed, nor one whose panels failed to draw.
        if code or "FLOW PASSED" not in text or "Traceback" in text:
            print(text[-6000:])
            return False, time.monotonic() - started
        print("\n".join(line for line in text.splitlines() if line.startswith("| ")))
        return True, time.monotonic() - started


if __name__ == "__main__":
    sys.exit(main())
