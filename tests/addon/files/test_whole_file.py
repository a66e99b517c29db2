# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Files are written whole or not at all, whatever writes them."""

import os
import resource
import stat
from contextlib import contextmanager

import pytest

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")

PLACE = ["--location", "0.3", "-2e-1", "1.9", "--extent", "0.6", "--step", "0.01"]
OLD = "what was there before"
# The options that write files, and the kinds of these files.
WRITERS = [
    (["--json"], "json"),
    (["--contacts"], "csv"),
    (["--output"], "json"),
    (["--output"], "ply"),
    (["--output"], "blend"),
]


@contextmanager
def full(size):
    """Lets no file grow beyond a size in bytes, as on a full disk."""
    _, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))


@pytest.fixture(scope="session")
def whole_file(extension):
    return extension.tactile_addon.files.whole_file


@pytest.mark.parametrize(("option", "kind"), WRITERS)
@pytest.mark.parametrize("old", [OLD, None])
def test_on_a_full_disk_the_old_file_stays_and_the_error_names_it(command, files, option, kind, old):
    out = files / f"out.{kind}"
    if old is not None:
        out.write_text(old)
    there = sorted(os.listdir(files))
    with full(3000):
        code, _, err = command("reconstruct", files / "ball.ply", *PLACE, *option, out)
    assert code == 1
    assert err.splitlines()[-1].startswith(f'tactile: cannot write "out.{kind}" (')
    assert "make room there, or choose another place" in err
    assert "Traceback" not in err
    assert sorted(os.listdir(files)) == there
    assert old is None or out.read_text() == old


@pytest.mark.parametrize(("option", "kind"), WRITERS)
def test_a_folder_in_which_nobody_may_write_is_no_question_of_room(command, files, option, kind):
    code, _, err = command("reconstruct", files / "ball.ply", *PLACE, *option, f"/sys/out.{kind}")
    assert code == 1
    assert f'cannot write "out.{kind}" (Permission denied): get the right to write there, or choose' in err


@pytest.mark.parametrize(("option", "kind"), WRITERS)
def test_a_new_file_takes_the_old_one_s_place_at_once_and_has_its_rights(command, files, option, kind):
    out = files / f"out.{kind}"
    out.write_text(OLD)
    out.chmod(0o640)
    before = out.stat().st_ino
    there = sorted(os.listdir(files))
    assert command("reconstruct", files / "ball.ply", *PLACE, *option, out)[0] == 0
    assert sorted(os.listdir(files)) == there
    assert out.stat().st_ino != before
    assert stat.S_IMODE(out.stat().st_mode) == 0o640
    assert out.stat().st_size > 1000


def test_the_table_of_a_verification_too(command, files):
    out = files / "out.csv"
    out.write_text(OLD)
    with full(100):
        code, _, err = command("reconstruct", files / "ball.ply", *PLACE, "--verify", out)
        assert code == 1, err
    assert out.read_text() == OLD
    assert command("reconstruct", files / "ball.ply", *PLACE, "--verify", out)[0] == 0
    assert out.read_text().startswith("patch,source,status")


def test_the_operators_that_export_too(empty, ball, tmp_path):
    empty.ops.tactile.reconstruct(location=(0.3, -0.2, 1.9), extent=0.6, step=0.01)
    device = tmp_path / "full"
    device.symlink_to("/dev/full")
    for operator, kind in (
        (empty.ops.tactile.export_contacts, "csv"),
        (empty.ops.tactile.export_patch, "json"),
    ):
        out = tmp_path / f"out.{kind}"
        out.write_text(OLD)
        with full(3000), pytest.raises(RuntimeError, match=f'annot write "out.{kind}"'):
            operator(filepath=str(out))
        assert out.read_text() == OLD
        with pytest.raises(RuntimeError, match=r"is not a file that can be replaced: choose another name"):
            operator(filepath=str(device))
        assert operator(filepath=str(out)) == {"FINISHED"}
        assert out.read_text() != OLD
    assert sorted(os.listdir(tmp_path)) == ["full", "out.csv", "out.json"]


def test_an_interrupted_write_leaves_nothing_but_the_old_file(whole_file, tmp_path):
    (tmp_path / "a.txt").write_text(OLD)
    with pytest.raises(KeyboardInterrupt), whole_file.replacing(tmp_path / "a.txt") as temporary:
        temporary.write_text("half of")
        assert temporary.parent == tmp_path
        assert (tmp_path / "a.txt").read_text() == OLD
        raise KeyboardInterrupt
    assert os.listdir(tmp_path) == ["a.txt"]
    assert (tmp_path / "a.txt").read_text() == OLD


def test_a_link_stays_a_link_to_the_new_file(whole_file, tmp_path):
    (tmp_path / "a.txt").write_text(OLD)
    (tmp_path / "link.txt").symlink_to("a.txt")
    whole_file.write_text(tmp_path / "link.txt", "µ\n")
    assert (tmp_path / "link.txt").is_symlink()
    assert (tmp_path / "a.txt").read_bytes() == b"\xc2\xb5\n"


@pytest.mark.parametrize("name", ["csv", "obj", "txt", "stl", ""])
@pytest.mark.parametrize("action", ["reconstruct", "map"])
def test_an_output_of_no_known_kind_is_refused(command, files, action, name):
    code, _, err = command(action, files / "ball.ply", "--output", files / f"out.{name}")
    assert code == 2
    assert "--output: expected a file .blend or .ply" in err
    assert not (files / f"out.{name}").exists()


def test_a_map_is_no_reconstruction(command, files):
    code, _, err = command("map", files / "ball.ply", "--output", files / "out.json")
    assert code == 2
    assert "--output: expected a file .blend or .ply, got" in err


@pytest.mark.parametrize("option", ["--json", "--output", "--verify", "--contacts"])
@pytest.mark.parametrize("kind", ["ply", "blend"])
def test_no_input_is_overwritten(command, files, option, kind):
    path = files / f"ball.{kind}"
    before = path.read_bytes()
    spelled = files / ".." / files.name / path.name
    code, _, err = command("reconstruct", path, *PLACE, option, spelled)
    assert code == 2
    assert f"{option}: expected a file other than those that this command reads" in err
    assert path.read_bytes() == before


def test_no_two_outputs_are_one_file_and_measured_files_and_the_open_scene_are_inputs(command, files):
    both = ("--json", files / "a.json", "--output", files / "a.json")
    code, _, err = command("reconstruct", files / "ball.ply", *PLACE, *both)
    assert code == 2
    assert "--output: expected a file other than those that this command writes" in err
    (files / "contacts.csv").write_text("curve,x,y,z\n1,0,0,0\n")
    code, _, err = command("fit", files / "contacts.csv", "--json", files / "contacts.csv")
    assert code == 2
    assert "--json: expected a file other than those that this command reads" in err
    import bpy

    bpy.ops.wm.open_mainfile(filepath=str(files / "ball.blend"))
    assert command("reconstruct", *PLACE, "--output", files / "ball.blend")[0] == 2


@pytest.mark.parametrize("option", ["--json", "--output", "--verify", "--contacts"])
@pytest.mark.parametrize("device", ["/dev/full", "/dev/null", "."])
def test_devices_and_folders_are_refused(command, files, option, device):
    """A link names them: a Blender that saved a scene as /dev/null would put a file in its place."""
    (files / "out.ply").symlink_to(device)
    code, _, err = command("reconstruct", files / "ball.ply", *PLACE, option, files / "out.ply")
    assert code == 2
    assert f"{option}: expected the name of a file, got" in err
