# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Command line: python -m core COMMAND.

Like the add-on, it writes a job, starts the worker with this same Python and prints its messages. A failure is two
lines, a problem and its remedy, and exit code 2; Ctrl-C ends with 130. Output that nobody can read ends quietly, with
141 where a pipe was closed (as of `| head`, like a program that SIGPIPE ends) and 1 where it could not be written.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import shlex
import signal
import sys
import tempfile
from pathlib import Path

from . import __version__
from .batch import command_line as batch_commands
from .capture import consent, delivery_plan, stages, unforeseen
from .capture.capture import Capture
from .capture.messages import Problem, Reporter
from .settings import delighter_cards, delivery_presets, settings
from .worker import (
    capture_commands,
    command_settings,
    read_only,
    retouch_commands,
    self_test,
    setup_commands,
    terminal,
)
from .worker.commands import add_command, path_of
from .worker.job import last_settings, wait_until_free, write_job
from .worker.output import OutputLost, let_go, open_streams

ROOT = Path(__file__).resolve().parent.parent
SUFFIX = ".wildcap"


def main(arguments: list[str] | None = None) -> int:
    """Run one command line; return its exit code: 0, 2 for a problem, 130 after Ctrl-C, or OutputLost's."""
    open_streams()
    try:
        code = _carry_out(sys.argv[1:] if arguments is None else arguments)
        sys.stdout.flush()
        return code
    except OutputLost as lost:
        let_go()
        return lost.code


def _carry_out(arguments: list[str]) -> int:
    try:
        try:
            options = _parser().parse_args(arguments)
        except SystemExit:
            sys.stdout.flush()  # the help
            raise
        return options.command(options) or 0
    except KeyboardInterrupt:
        return 130
    except OutputLost:
        raise
    except Exception as error:  # a traceback would not help the user
        if not isinstance(error, Problem):
            error = unforeseen.explain(error, "the command", _log_of(arguments))
        with contextlib.suppress(OSError):  # nobody reads that either
            print(error.problem, error.remedy, sep="\n", file=sys.stderr)
        return 2


def _log_of(arguments: list[str]) -> Path | None:
    """Return the log of the capture that a command line names, if any."""
    with contextlib.suppress(OSError, ValueError):  # no path can have such characters
        return next((Capture(word).logs / unforeseen.LOG for word in arguments if Capture(word).json.is_file()), None)
    return None


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        "python -m core", description="From a phone video of a face to a relightable head."
    )
    parser.add_argument("--version", action="version", version=f"WildCap {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    _add_run(commands)
    deliver = add_command(
        commands,
        "deliver",
        _deliver,
        "the maps as another program wants them, with the mesh as OBJ; other files and shape keys need the add-on",
        "CAPTURE",
    )
    command_settings.add_options(deliver, "deliver")
    _add_lists(commands)
    capture_commands.add_commands(commands)
    retouch_commands.add_commands(commands)
    _add_white(commands)
    add_command(commands, "doctor", _doctor, "say what is installed, what is missing and what to do")
    test = add_command(commands, "self-test", _self_test, "solve the sample head again on this machine, and compare it")
    test.add_argument("--device", choices=("auto", "cpu", "cuda", "mps"), default="auto")
    batch_commands.add_commands(commands)
    setup_commands.add_commands(commands)
    return parser


def _add_run(commands) -> None:
    run = add_command(commands, "run", _run, "run the chain; a second run continues where the first stopped")
    run.add_argument(
        "source",
        metavar="SOURCE",
        help="a video, a photograph, or a folder of photographs; - for the one the capture was made from",
    )
    run.add_argument(
        "capture", metavar="CAPTURE", type=path_of, help="the face's folder, usually NAME.wildcap; created if missing"
    )
    run.add_argument(
        "--from", dest="first", metavar="STAGE", help="begin with this stage and run it even if nothing has changed"
    )
    run.add_argument("--until", dest="last", metavar="STAGE", help="end with this stage")
    run.add_argument("--quality", choices=settings.QUALITIES, default="standard")
    run.add_argument(
        "--send-frames",
        action="store_true",
        help="you agree that SwitchLight gets the selected frames, a person's face, and charges you; "
        "without it, the run stops before",
    )
    command_settings.add_options(run, "run")


def _add_lists(commands) -> None:
    add_command(commands, "settings", _settings, "list every setting: its default, values, flag and meaning")
    add_command(commands, "presets", _presets, "list how each program gets its maps, and what each format drops")
    add_command(commands, "stages", _stages, "list the stages of the chain")
    cards = add_command(
        commands, "delighters", _delighters, "list each way to remove light: where it runs, what it sends and costs"
    )
    cards.add_argument("--markdown", action="store_true", help="as docs/delighters.md has it")


def _add_white(commands) -> None:
    white = add_command(
        commands,
        "white",
        _white,
        "measure the white point on a ColorChecker, a grey card or white paper in the frames",
        "CAPTURE",
    )
    white.add_argument(
        "--frame", metavar="NAME", help="the frame with the card; without it a ColorChecker is looked for"
    )
    white.add_argument(
        "--at", metavar=("X", "Y"), nargs=2, type=float, help="a pixel of the card, from the frame's upper left"
    )
    white.add_argument("--card", choices=settings.CARDS, default="grey")


def _run(options: argparse.Namespace) -> int:
    run_settings = command_settings.read_options(options, "run")
    command_settings.refuse_lone_flags(options, run_settings)
    # a shell has its background jobs ignore this signal, which means cancel here
    signal.signal(signal.SIGINT, signal.default_int_handler)
    capture, source = Capture(options.capture), os.path.expanduser(options.source)
    _refuse_exchanged(source, options.capture)
    wait_until_free(capture, lambda text: print(text, flush=True))
    job = write_job(
        capture,
        source="" if source == "-" else source,
        first=options.first,
        last=options.last,
        settings=run_settings,
        quality=options.quality,
    )
    return terminal.follow(ROOT, capture, job, consent.by_flag(capture) if options.send_frames else {})


def _refuse_exchanged(source: str, capture: Path) -> None:
    """Raise Problem for a source that is a capture, or a capture that is a file: the arguments were exchanged."""
    is_capture, is_video = Capture(source).json.is_file(), capture.is_file()
    photographs = is_capture and capture.is_dir() and any(capture.iterdir()) and not Capture(capture).json.is_file()
    if photographs or is_video and (is_capture or source.endswith(SUFFIX) or not Path(source).exists()):
        raise Problem(
            f"SOURCE and CAPTURE are exchanged: {capture} is {'a file' if is_video else 'a folder of pictures'}, and "
            f"{source} the face's folder.",
            f"Write the video first: `python -m core run {shlex.join([str(capture), source])}`.",
        )
    if is_video:
        raise Problem(
            f"{capture} is a file; the capture is a folder, in which the face is kept.",
            f"Name a new folder after the video, such as {capture.stem}{SUFFIX}.",
        )
    if is_capture:
        raise Problem(
            f"{source} is a capture, not a video or a folder of photographs.",
            f"To continue it, write `python -m core run - {shlex.quote(source)}`.",
        )


def _deliver(options: argparse.Namespace) -> int:
    signal.signal(signal.SIGINT, signal.default_int_handler)
    capture = Capture(options.capture)
    if not capture.json.is_file():
        raise Problem(
            f"There is no capture at {capture.root}.", "Check the name; `python -m core run SOURCE CAPTURE` makes one."
        )
    delivery = {"format": "obj", "whole": True, **command_settings.read_options(options, "deliver").get("deliver", {})}
    if not delivery["whole"]:
        raise Problem(
            "Only Blender can finish a delivery without its mesh (deliver.whole off).",
            "Leave deliver.whole on, or deliver from the add-on's panel.",
        )
    job_settings = {**settings.to_json(last_settings(capture)), "deliver": delivery}
    with read_only.stand_in(capture, delivery.get("folder", "")) as writable:
        plan = delivery_plan.plan(writable, settings.from_json(job_settings).deliver)
        delivery_plan.check_target(plan)
        code = terminal.follow(ROOT, writable, write_job(writable, tool="deliver", settings=job_settings), {})
    if code == 0:
        print(plan.target)
    return code


def _settings(options: argparse.Namespace) -> None:
    print(command_settings.list_settings())


def _presets(options: argparse.Namespace) -> None:
    print(delivery_presets.markdown())


def _stages(options: argparse.Namespace) -> None:
    for stage in stages.STAGES:
        print(f"{stage.name:13} {' '.join(stage.reads) or 'the video or photographs'} -> {' '.join(stage.writes)}")


def _delighters(options: argparse.Namespace) -> None:
    print(delighter_cards.markdown().rstrip() if options.markdown else delighter_cards.text())


def _white(options: argparse.Namespace) -> None:
    capture = Capture(options.capture)
    if bool(options.frame) != bool(options.at):
        raise Problem(
            "--frame and --at go together.",
            "Name a frame and a pixel of the card in it, or neither to look for a ColorChecker.",
        )
    if options.frame and not (capture.frames / options.frame).is_file():
        raise Problem(
            f"There is no frame {capture.frames / options.frame}.",
            "Name one of the pictures in the capture's frames folder.",
        )
    from .imaging.images import read_srgb  # these need OpenImageIO, OpenCV and torch
    from .stages.solve import white_point

    if options.frame:
        pixels = read_srgb(capture.frames / options.frame)
        white = white_point.measure_card_white(pixels, *options.at, options.card).tolist()
    else:
        report = Reporter("white_point")
        white_point.run(capture, settings.Settings(), report)
        white = report.figures["white_point"]
        print(f"ColorChecker in {report.figures['white_point_frame']}")
    print(f"--white-point {','.join(f'{v:.4f}' for v in white)}")


def _doctor(options: argparse.Namespace) -> int:
    from .worker.doctor import examine

    findings = examine(ROOT, Path(sys.executable))
    print(findings.text)
    return 2 if findings.problems else 0


def _self_test(options: argparse.Namespace) -> int:
    signal.signal(signal.SIGINT, signal.default_int_handler)
    with tempfile.TemporaryDirectory(prefix="wildcap_self_test_") as folder:
        capture = self_test.prepare(Path(folder), device=options.device)
        return terminal.follow(ROOT, capture, capture.job, {})


if __name__ == "__main__":
    sys.exit(main())
