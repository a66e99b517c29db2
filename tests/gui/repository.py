# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a window of Blender without the extension: it comes from a repository, is updated and makes a patch.

A local server has the repository, which Blender's own tool has made of a zip without wheels, because this
Blender uses the Python of its distribution. The older version is that zip with another number in its
manifest.
"""

import os
import re
import subprocess
import sys
import tomllib
import zipfile
from html import unescape
from pathlib import Path

import bpy
import gui

sys.path.insert(0, str(Path(__file__).parent))
from common import check, picture, until

FOLDER = Path(os.environ["GUI_SHOT"]).parent
REPOSITORY, MODULE = FOLDER / "repository", "local_server"
OLD = "0.0.1"
PORT = 8791


def offer(zip_path, version=None):
    """Makes the repository have only this zip, under its own version or another."""
    REPOSITORY.mkdir(exist_ok=True)
    for path in REPOSITORY.iterdir():
        path.unlink()
    with zipfile.ZipFile(zip_path) as source, zipfile.ZipFile(REPOSITORY / "offered.zip", "w") as target:
        for name in source.namelist():
            data = source.read(name)
            if name == "blender_manifest.toml" and version:
                data = re.sub(rb'(?m)^version = ".*"', f'version = "{version}"'.encode(), data)
            target.writestr(name, data)
    command = [
        "blender",
        "--command",
        "extension",
        "server-generate",
        "--repo-dir",
        str(REPOSITORY),
        "--html",
    ]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def installed():
    """The version that is on the disk and enabled, or None."""
    name = f"bl_ext.{MODULE}.tactile_patch"
    if name not in bpy.context.preferences.addons:
        return None
    manifest = Path(sys.modules[name].__file__).parent / "blender_manifest.toml"
    return tomllib.loads(manifest.read_text(encoding="utf-8"))["version"]


def drop_link():
    """Does what Blender does where the page's link is dropped: it opens a dialog, which Return confirms."""
    (link,) = re.findall(r'href="\./(offered\.zip[^"]*)"', (REPOSITORY / "index.html").read_text("utf-8"))
    window, area, region = gui.find()
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.extensions.package_install("INVOKE_DEFAULT", url=f"http://127.0.0.1:{PORT}/{unescape(link)}")
    yield 4
    picture("dropped")
    gui.xdo("key", "Return")
    yield from until(lambda: installed() is not None, 30)


def steps():
    zip_path = FOLDER / "tactile_patch.zip"
    with zipfile.ZipFile(zip_path) as file:
        newest = tomllib.loads(file.read("blender_manifest.toml").decode())["version"]
    offer(zip_path, OLD)
    page = (REPOSITORY / "index.html").read_text(encoding="utf-8")
    link = "offered.zip?repository="  # Blender looks for this in a link that is dropped
    check("the repository has a page with a link to drop", link in page, page)
    bind = ["--bind", "127.0.0.1", "--directory", str(REPOSITORY)]
    server = subprocess.Popen(["python3", "-m", "http.server", str(PORT), *bind], stderr=subprocess.DEVNULL)
    try:
        yield 2
        bpy.context.preferences.system.use_online_access = True
        repos = bpy.context.preferences.extensions.repos
        url = f"http://127.0.0.1:{PORT}/index.json"
        repos.new(name="Local Server", module=MODULE, remote_url=url)
        index = [repo.module for repo in repos].index(MODULE)
        bpy.ops.extensions.repo_sync(repo_index=index)
        bpy.ops.extensions.package_install(repo_index=index, pkg_id="tactile_patch", enable_on_install=True)
        yield 1
        check("it is installed from the repository's address", installed() == OLD, installed())
        offer(zip_path)
        bpy.ops.extensions.repo_sync(repo_index=index)
        bpy.ops.extensions.package_upgrade_all()
        yield 1
        check("it is updated from there", installed() == newest, installed())
        bpy.ops.extensions.package_uninstall(repo_index=index, pkg_id="tactile_patch")
        yield 1
        yield from drop_link()
        check("it is installed by the link of the page", installed() == newest, installed())
        bpy.ops.mesh.primitive_monkey_add(size=2.0)
        bpy.context.object.modifiers.new("Subdivision", "SUBSURF").levels = 3
        bpy.ops.tactile.pick(location=(0.32, -0.19, 0.84))
        patches = [obj for obj in bpy.data.objects if "tactile" in obj]
        status = [patch["tactile"]["status"] for patch in patches]
        check("what was updated makes a patch", status == ["ok"], status)
        gui.sidebar()
        yield 1
        gui.sidebar("Tactile")
        yield 1
    finally:
        server.terminate()


gui.play(steps())
