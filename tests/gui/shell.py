# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender from the shell, with the extension installed: the command line and the example script.

Takes the folder make_scene.py has written to. Prints a line for each check, "ok: ..." or "FAILED: ...".
"""

import json
import subprocess
import sys
from pathlib import Path

folder = Path(sys.argv[1])
scene, out = str(folder / "scene.blend"), folder / "out.blend"


def check(what, good, detail=""):
    detail = " | ".join(str(detail).strip().splitlines())
    print(f"ok: {what}" if good else f"FAILED: {what}: {detail}", flush=True)


def blender(*args):
    """(exit code, standard output, standard error) of blender with these arguments."""
    done = subprocess.run(["blender", *map(str, args)], capture_output=True, text=True, timeout=300)
    return done.returncode, done.stdout, done.stderr


def close(a, b, tolerance=1e-3):
    return abs(a - b) <= tolerance * abs(b)


def same_curvatures(a, b):
    return close(a["k1"], b["k1"]) and close(a["k2"], b["k2"])


def curvatures(report):
    return f"k1 {report['k1']:.5f}, k2 {report['k2']:.5f}"


def report_of(what, *args):
    """The line of JSON that blender prints with these arguments; None and a failed check if there is none."""
    code, stdout, stderr = blender(*args, "--json", "-")
    lines = [line for line in stdout.splitlines() if line.startswith("{")]
    good = code == 0 and len(lines) == 1 and "Traceback" not in stdout + stderr
    report = json.loads(lines[0]) if good else None
    check(
        f"{what}: {curvatures(report)}" if good else what,
        good,
        f"code {code}, {len(lines)} lines of JSON, {stderr.strip()[-800:]}",
    )
    return report


def check_files(first):
    """Touches one point of one surface, from a file of each kind."""
    # Extent and step are given, because automatic ones follow the bounding box, which files may turn.
    same = ["--location", *first["frame"]["origin"], "--extent", first["extent"], "--step", first["step"]]
    for background in ([], ["-b"]):
        for kind in ("blend", "ply", "stl", "obj"):
            what = f"blender {' '.join([*background, '-c'])} tactile reconstruct scene.{kind}"
            file = folder / f"scene.{kind}"
            report = report_of(what, *background, "-c", "tactile", "reconstruct", file, *same)
            if report is not None:
                check(
                    f"{what}: as on the open scene",
                    same_curvatures(report, first),
                    f"{curvatures(report)}, expected {curvatures(first)}",
                )


def check_output(first):
    file = folder / "report.json"
    reconstruct = ("-c", "tactile", "reconstruct", scene)
    code, stdout, _ = blender(*reconstruct, "--output", out, "--json", file)
    check("without --json - the report is a table", code == 0 and "principal curvatures" in stdout, stdout)
    good = file.is_file() and same_curvatures(json.loads(file.read_text()), first)
    check("--json PATH has the report", good, f"no or another report in {file.name}")
    check("--output OUT.blend is there", out.is_file(), "no such file")
    again = report_of("the saved patch is active: touched again", "-b", out, "-c", "tactile", "reconstruct")
    if again is not None:
        good = again["source"] == first["source"] and same_curvatures(again, first)
        check("... on the object it came from", good, f"{again['source']}, {curvatures(again)}")


def check_errors():
    texts = {}
    for kind in ("blend", "ply", "stl", "obj"):
        whole = (folder / f"scene.{kind}").read_bytes()
        (folder / f"cut.{kind}").write_bytes(whole[: len(whole) // 10])
        texts[f"a truncated .{kind} file"] = [folder / f"cut.{kind}"]
    (folder / "notes.txt").write_text("no mesh")
    texts["a location far away"] = [scene, "--location", "0", "0", "-99"]
    texts["a file that is not there"] = [folder / "absent.ply"]
    texts["a file of another kind"] = [folder / "notes.txt"]
    texts["a target that is not there"] = [scene, "--target", "Nobody"]
    texts["a report that cannot be written"] = [scene, "--json", folder / "absent" / "report.json"]
    texts["an output that cannot be written"] = [scene, "--output", folder / "absent" / "out.blend"]
    for what, args in texts.items():
        code, stdout, stderr = blender("-c", "tactile", "reconstruct", *args)
        said = stderr.strip().splitlines()
        good = code == 1 and len(said) == 1 and said[0].startswith("tactile: ")
        good = good and "Traceback" not in stdout and "{" not in stdout
        words = said[0].removeprefix("tactile: ") if said else ""
        check(f"{what} ends with 1: {words}", good, f"code {code}\n{stderr}\n{stdout}")
    for args in (
        [],
        ["nonsense"],
        ["reconstruct", scene, "--degree", "9"],
        ["reconstruct", scene, "--azimuths", "0", "60"],
        ["reconstruct", scene, "--tilts", "1", "2"],
        ["reconstruct", scene, "--location", "1", "2"],
        ["reconstruct", scene, "--nonsense"],
    ):
        code, stdout, stderr = blender("-c", "tactile", *args)
        what = " ".join(["tactile", *(arg.rpartition("/")[2] for arg in args)])
        good = code == 2 and "error: " in stderr and "Traceback" not in stdout + stderr
        check(f"{what} ends with 2", good, f"code {code}\n{stderr}")


def check_contacts():
    """Simulated contacts, and the patch that they show when nothing else is known."""
    file = folder / "simulated.csv"
    touched = report_of("--contacts writes a file", "-c", "tactile", "reconstruct", scene, "--contacts", file)
    if touched is None:
        return
    for background in ([], ["-b"]):
        what = " ".join(["blender", *background, "-c tactile fit"])
        fitted = report_of(what, *background, "-c", "tactile", "fit", file)
        if fitted is not None:
            off = max(
                abs(a - b) for a, b in zip(*(r["frame"]["normal"] for r in (touched, fitted)), strict=True)
            )
            check("... the same patch, by nothing but its contacts", off < 0.02, curvatures(fitted))
    code, stdout, stderr = blender("-c", "tactile", "fit", folder / "notes.txt")
    good = code == 1 and stderr.startswith("tactile: ") and "Traceback" not in stdout + stderr
    check("fit says what a file of no contacts lacks", good, f"code {code}\n{stderr}\n{stdout}")


def check_map():
    """A stability map, saved as a mesh file."""
    file = folder / "map.ply"
    words = ["-c", "tactile", "map", scene, "--spacing", 0.15, "--json", "-", "--output", file]
    for background in ([], ["-b"]):
        code, stdout, stderr = blender(*background, *words)
        lines = [json.loads(line) for line in stdout.splitlines() if line.startswith("{")]
        good = code == 0 and len(lines) == 1 and "Traceback" not in stdout + stderr
        check(" ".join(["blender", *background, "-c tactile map"]), good, f"code {code}\n{stderr}\n{stdout}")
        if good:
            counted = lines[0]["patches"] + sum(lines[0]["refused"].values())
            check("... counts all points", counted == lines[0]["points"] > 100, lines[0])
            head = file.read_bytes()[:2000] if file.is_file() else b""
            check(
                "... and its --output has the attributes", b" height_std" in head and b" reason" in head, head
            )
            file.unlink(missing_ok=True)


def check_example():
    """The example that puts many patches on one object, in a background run."""
    example = Path("examples/many_patches.py")
    saved = folder / "many.blend"
    code, stdout, stderr = blender("-b", scene, "--python", example, "--", "--count", 6, "--output", saved)
    lines = [json.loads(line) for line in stdout.splitlines() if line.startswith("{")]
    good = code == 0 and "Traceback" not in stdout + stderr
    check("examples/many_patches.py runs", good, f"code {code}\n{stderr}\n{stdout}")
    check("... and prints a line of JSON for each of 6 places", len(lines) == 6, stdout + stderr)
    patches = [line for line in lines if "error" not in line]
    good = len(patches) >= 3 and all(line["k1"] <= line["k2"] and line["status"] for line in patches)
    check(f"... {len(patches)} of them patches, with k1 <= k2 and a status", good, lines)
    probe = "import bpy; print('NAMES', sorted(o.name for o in bpy.data.objects if 'tactile' in o))"
    found = [line for line in blender("-b", saved, "--python-expr", probe)[1].splitlines() if "NAMES" in line]
    good = found == [f"NAMES {sorted({line['patch'] for line in patches})}"]
    check("... and its --output holds them", good, found)


first = report_of(
    "blender -b scene.blend -c tactile reconstruct", "-b", scene, "-c", "tactile", "reconstruct"
)
if first is not None:
    check_files(first)
    check_output(first)
check_errors()
check_contacts()
check_map()
check_example()
