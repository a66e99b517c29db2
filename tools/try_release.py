# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Install a release as its users do, in a Blender without any settings, and make a patch with it.

It comes from the repository, as by Get Extensions, and then from this system's zip, as by Install from Disk.
"""

import argparse
import os
import sys
import tempfile
from pathlib import Path

from tools import blender, build, release

REPOSITORY = "tried"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    help = "the folder that make release has written (default: that of this version)"
    parser.add_argument("release", nargs="?", type=Path, default=release.folder_of_version(), help=help)
    folder = parser.parse_args().release.resolve()
    with tempfile.TemporaryDirectory() as user:
        os.environ["BLENDER_USER_RESOURCES"] = user  # bpy reads it on import.
        import bpy

        print(f"Blender {bpy.app.version_string}, Python {sys.version.split()[0]}")
        with blender.quiet():
            install_from(bpy, (folder / "repository" / "index.json").as_uri())
        touch(bpy, f"bl_ext.{REPOSITORY}.tactile_patch", "the repository")
        (path,) = folder.glob(f"*-{build.host_platform().replace('-', '_')}.zip")
        with blender.quiet():
            bpy.ops.extensions.package_uninstall(repo_index=index_of(bpy), pkg_id="tactile_patch")
            bpy.ops.extensions.package_install_files(
                filepath=str(path), repo="user_default", enable_on_install=True
            )
        touch(bpy, "bl_ext.user_default.tactile_patch", path.name)


def index_of(bpy):
    """The index of the repository in the list of Blender's preferences."""
    return [repo.module for repo in bpy.context.preferences.extensions.repos].index(REPOSITORY)


def install_from(bpy, url):
    """Adds the repository and installs the zip that it offers to this Blender."""
    bpy.context.preferences.system.use_online_access = True  # Blender asks for it even for files.
    bpy.context.preferences.extensions.repos.new(name=REPOSITORY, module=REPOSITORY, remote_url=url)
    bpy.ops.extensions.repo_sync(repo_index=index_of(bpy))
    bpy.ops.extensions.package_install(
        repo_index=index_of(bpy), pkg_id="tactile_patch", enable_on_install=True
    )


def touch(bpy, module, origin):
    """Makes a patch on Suzanne, or ends with a sentence."""
    if module not in bpy.context.preferences.addons:
        sys.exit(f"try_release: {origin} could not be installed")
    with blender.quiet():
        bpy.ops.wm.read_homefile(use_empty=True)
        bpy.ops.mesh.primitive_monkey_add(size=2.0)
        bpy.context.object.modifiers.new("Subdivision", "SUBSURF").levels = 3
        bpy.ops.tactile.reconstruct(location=(0.32, -0.19, 0.84))
    report = bpy.context.view_layer.objects.active["tactile"].to_dict()
    print(f"{origin}: a patch, {report['status']}, {report['k1']:.3f} and {report['k2']:.3f} 1/m")


if __name__ == "__main__":
    main()
