# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The loop over touches that one would write without a cluster; benchmarks.cluster starts it.

`python -m benchmarks.plain_loop FILES OPTIONS`, both JSON. It touches each file once, because the workers it
is compared with are warm too. Then it prints "ready", waits for a line, makes all touches, and prints the
seconds and the seconds of processor time that these took.
"""

import json
import sys
from dataclasses import replace
from time import perf_counter, process_time

from cluster.data_set.options import Options
from cluster.worker import touches
from cluster.worker.objects import touchable
from tools import blender


def touch_all(files, options):
    """Makes and keeps the touches of a data set in its batches, with their status and error on the mesh."""
    kept = []
    for name, path in files:
        target = touchable(path, name)
        for block in options.blocks():
            for _, _, found in touches.explored(target, options, block):
                results = [each.result for each in found if not isinstance(each, ValueError)]
                kept += [(r, r.status, r.message, r.taps.height) for r in results]
    return kept


def main():
    files, options = json.loads(sys.argv[1]), Options.from_dict(json.loads(sys.argv[2]))
    with blender.quiet():
        touch_all(files, replace(options, touches=1, block=1))
    print("ready", flush=True)
    sys.stdin.readline()
    start, work = perf_counter(), process_time()
    with blender.quiet():
        touch_all(files, options)
    print(json.dumps([perf_counter() - start, process_time() - work]))


if __name__ == "__main__":
    main()
