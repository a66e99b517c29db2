# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The words of `python -m cluster touch OBJECTS...` and `whole`: data sets of touches or of surfaces."""

import argparse
import os
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path
from typing import Any

from .data_set import manifest
from .data_set.folder import DataSet
from .data_set.options import Length, Options, WholeOptions
from .engine import Engine, EngineError, connected
from .extension import core
from .input_files import KINDS, files_of
from .progress import summary
from .run import Run, StoppedError, summed_up

WRONG_WORDS, STOPPED, WITH_ERRORS, INTERRUPTED = 2, 1, 3, 130  # The exit codes.


def _length(text: str) -> str:
    try:
        return str(Length.of(text))
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


LENGTH: dict[str, Any] = {"type": _length, "metavar": "LENGTH"}


def main(words: Sequence[str] | None = None) -> int:
    """Makes a data set, and returns the exit code."""
    given = _parser().parse_args(words)
    try:
        options = _options(given)
        data_set, files = DataSet(given.output, options.parts), files_of(given.objects)
        manifest.begun(data_set, options)  # Nothing is written to the folder of another data set.
        with data_set.claimed():
            run = Run(data_set, options, files)
            with _interruptible(), connected(given.scheduler, given.workers) as client:
                if not client.scheduler_info(n_workers=1)["workers"]:
                    print("The scheduler has no workers yet: waiting for them", file=sys.stderr)
                run.work(Engine(client, given.limit))
            rows = summed_up(data_set)
    except ValueError as error:
        print(f"cluster: {error}", file=sys.stderr)
        return WRONG_WORDS
    except (OSError, EngineError, StoppedError) as error:
        print(f"cluster: {error}", file=sys.stderr)
        return STOPPED
    except KeyboardInterrupt:
        print("cluster: interrupted; run the same command again to continue", file=sys.stderr)
        return INTERRUPTED
    print(summary(rows, run))
    return WITH_ERRORS if any(row["error"] for row in rows) else 0


@contextmanager
def _interruptible() -> Iterator[None]:
    """Within this context, a request to end, as schedulers of batch jobs send it, counts as Ctrl+C."""

    def interrupt(*_: Any) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _options(given: argparse.Namespace) -> Options | WholeOptions:
    if given.command == "touch":
        given.azimuths = given.azimuths or [180.0 * i / given.planes for i in range(given.planes)]
        given.tilts = given.tilts or [0.0] * len(given.azimuths)
    kind: Any = Options if given.command == "touch" else WholeOptions
    return kind(**{field.name: getattr(given, field.name) for field in fields(kind)})


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m cluster", description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(required=True, metavar="COMMAND", dest="command")
    touch = commands.add_parser(
        "touch", help="touch objects at random places in parallel and write Parquet files"
    )
    _add_work(touch.add_argument)
    _add_touches(touch.add_argument)
    whole = commands.add_parser(
        "whole", help="touch objects all over and write a surface and a graph for each"
    )
    _add_work(whole.add_argument)
    _add_whole(whole.add_argument)
    return parser


def _add_work(add: Any) -> None:
    """Adds the options of both commands: what to touch, with which noise, and on which workers."""
    help = f"{', '.join(KINDS)} files, folders of them, or .txt lists of these"
    add("objects", nargs="+", type=Path, metavar="OBJECT", help=help)
    add("--output", type=Path, required=True, metavar="FOLDER", help="folder of the data set, new or begun")
    add("--scheduler", metavar="ADDRESS", help="address of a Dask scheduler that has workers")
    help = "processes on this machine, if no scheduler is given (%(default)s)"
    add("--workers", type=_count, default=os.cpu_count(), metavar="COUNT", help=help)
    help = "seconds that a block may take before it is ended (%(default)s)"
    add("--limit", type=_positive, default=600.0, metavar="SECONDS", help=help)
    add("--seed", type=int, default=0, help="seed of places and noise (%(default)s)")
    add("--noise", **LENGTH, default="0", help="standard deviation of the sensor (0)")


def _add_touches(add: Any) -> None:
    """Adds the options of how to touch, which are all in the manifest."""
    add("--touches", type=_count, default=1000, help="touches per object (%(default)s)")
    add("--block", type=_count, default=500, help="touches per task and file (%(default)s)")
    help = "number of evenly spaced sampling planes (3)"
    add("--planes", type=int, choices=range(3, 7), default=3, help=help)
    degrees = {"type": float, "nargs": "+", "metavar": "DEGREES"}
    add("--azimuths", **degrees, help="directions of planes that are not evenly spaced")
    add("--tilts", **degrees, help="tilts of the planes, one each (0)")
    help = "length of each half curve, in the object's unit or as 6%% of its size (the longest that is sure)"
    add("--extent", **LENGTH, help=help)
    add("--step", **LENGTH, help="distance between contacts (such that more would add little)")
    help = "add planes until heights are accurate to this (no planes are added)"
    add("--tolerance", **LENGTH, help=help)
    add("--method", choices=core.METHODS, default="bayes", help="how to fit (%(default)s)")
    add("--degree", choices=["auto", *"23456"], default="auto", help="degree of the polynomial (%(default)s)")
    add("--weight", type=_positive, help="lambda L^2 of tagc (1000) and quadratic-variation (1e5)")
    add("--solver", choices=core.SOLVERS, default="fast", help="solver of tagc (%(default)s)")


def _add_whole(add: Any) -> None:
    """Adds the options of how to touch all over, which are all in the manifest."""
    help = "standard deviation to reach for each patch's height (0.2%% of the object's size)"
    add("--tolerance", **LENGTH, help=help)
    add("--most", type=_count, default=1000, metavar="COUNT", help="touches per object at most (%(default)s)")


def _count(text: str) -> int:
    if not text.isdecimal() or not int(text):
        raise argparse.ArgumentTypeError(f"expected a number of 1 or more, got {text}")
    return int(text)


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"expected a number above 0, got {text}")
    return value
