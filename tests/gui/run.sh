#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later

# run.sh ZIP [CHECK]: checks what only a real Blender can show, with the zip without wheels installed in it:
# the command line, the example script, the menu entry, probes, verification, whole objects and stability
# maps by mouse and keyboard in a window, what hundreds of touches leave behind, and installing from a
# repository. The pictures in build/gui are to be looked at. CHECK runs only the steps with this in their
# name, such as "random steps". TACTILE_OUT names another folder than build/gui, so that two runs can go on
# at once. TACTILE_GUI names the script that starts Blender, which is not part of the source:
#
#   run ARGS...                    blender ARGS without a window
#   shot SCRIPT.py OUT.png [W H]   Blender in a window, running SCRIPT.py until this calls gui.ready(); then
#                                  OUT.png is the picture of the screen
#   sh COMMAND...                  any command on the same display
#
# SCRIPT.py imports gui, which this script provides: ready(), shot(PICTURE) and the mouse and keys.
set -euo pipefail
[ $# = 1 ] || [ $# = 2 ] || { echo "usage: run.sh ZIP [CHECK]" >&2; exit 2; }
only=${2:-}
zip=$(readlink -f "$1")
[ -f "$zip" ] || { echo "run.sh: there is no file $1" >&2; exit 2; }
cd "$(dirname "$0")/../.."

gui=${TACTILE_GUI:-../shared/blender/gui.sh}
[ -e "$gui" ] || { echo "run.sh: TACTILE_GUI has to name a script that starts Blender in a window" >&2; exit 2; }
out=${TACTILE_OUT:-build/gui}
log=$out/log.txt
export BLENDER_USER_RESOURCES=$out-user
rm -rf "$out" "$BLENDER_USER_RESOURCES" "$out-user-repository"
mkdir -p "$out"
cp "$zip" "$out/tactile_patch.zip"

# step WHAT COMMAND...: runs a command, which prints its checks; the step fails if the exit code is not 0.
step() {
  local what=$1 code=0
  shift
  case $what in *installs* | *"is made"* | *"$only"*) ;; *) return ;; esac
  "$@" >"$out/step.txt" 2>&1 || code=$?
  cat "$out/step.txt" >>"$log"
  grep -E '^(ok|FAILED): ' "$out/step.txt" || true
  if grep -q "Python script error" "$out/step.txt"; then
    grep -B 4 -m 1 "Python script error" "$out/step.txt" >&2
    echo "FAILED: $what ran into an error that Blender only printed" | tee -a "$log"
  fi
  if [ "$code" != 0 ]; then
    tail -n 30 "$out/step.txt" >&2
    echo "FAILED: $what ended with $code" | tee -a "$log"
  elif ! grep -qE '^(ok|FAILED): ' "$out/step.txt"; then
    echo "ok: $what" | tee -a "$log"
  fi
}

step "the zip installs as an extension" \
  $gui run --command extension install-file "$out/tactile_patch.zip" -r user_default -e
step "a scene to touch is made" \
  $gui run --python-exit-code 4 --python tests/gui/make_scene.py -- "$out"
step "the shell's checks" $gui sh python3 tests/gui/shell.py "$out"
pear=../shared/data/meshes/pear.ply
[ ! -e "$pear" ] || cp "$pear" "$out/"
GUI_ARGS="$out/scene.blend" step "the window's checks" \
  $gui shot tests/gui/window.py "$out/window.png"
GUI_TIMEOUT=240 GUI_ARGS="$out/scene.blend" step "the panel's checks" \
  $gui shot tests/gui/panel.py "$out/panel.png"
GUI_TIMEOUT=240 GUI_ARGS="$out/scene.blend" step "the viewport's checks" \
  $gui shot tests/gui/viewport.py "$out/viewport.png"
GUI_ARGS="$out/scene.blend" step "the checks of first tries" \
  $gui shot tests/gui/first_tries.py "$out/first_tries.png"
GUI_ARGS="$out/scene.blend" step "the checks of gestures" \
  $gui shot tests/gui/gestures.py "$out/gestures.png"
GUI_TIMEOUT=240 GUI_ARGS="$out/scene.blend" step "the conventions' checks" \
  $gui shot tests/gui/conventions.py "$out/conventions.png"
GUI_TIMEOUT=${GUI_TIMEOUT:-300} GUI_ARGS="$out/scene.blend" step "the checks of probes as objects" \
  $gui shot tests/gui/objects.py "$out/objects.png"
GUI_TIMEOUT=$((200 + 4 * ${TACTILE_STEPS:-50})) GUI_ARGS="$out/scene.blend" step "the random steps" \
  $gui shot tests/gui/random_steps.py "$out/random_steps.png"
GUI_ARGS="$out/scene.blend" step "the pictures of the docs" \
  $gui shot tests/gui/pictures.py "$out/pictures.png"
GUI_ARGS="$out/scene.blend" step "the pictures of the worked example" \
  $gui shot tests/gui/worked_example.py "$out/worked_example.png"
GUI_ARGS="$out/scene.blend" step "the verification's checks" \
  $gui shot tests/gui/verify.py "$out/verify.png"
GUI_TIMEOUT=600 GUI_ARGS="$out/scene.blend" step "the stability map's checks" \
  $gui shot tests/gui/stability.py "$out/stability.png"
GUI_TIMEOUT=600 GUI_ARGS="$out/scene.blend" step "the checks of whole objects" \
  $gui shot tests/gui/whole_object.py "$out/whole_object.png"
GUI_ARGS="$out/scene.blend" step "the contacts' checks" \
  $gui shot tests/gui/contacts.py "$out/contacts.png"
GUI_TIMEOUT=600 GUI_ARGS="$out/scene.blend" step "the endurance checks" \
  $gui shot tests/gui/endurance.py "$out/endurance.png" 640 480
GUI_ARGS=examples/sample.blend step "the sample's checks" \
  $gui shot tests/gui/sample.py "$out/sample.png"
BLENDER_USER_RESOURCES=$out-user-repository GUI_TIMEOUT=240 step "the repository's checks" \
  $gui shot tests/gui/repository.py "$out/repository.png"
[ -e "$pear" ] || echo "skipped: the scan of a pear, there is no ../shared/data."

passed=$(grep -c '^ok: ' "$log" || true)
failed=$(grep -c '^FAILED: ' "$log" || true)
echo "$passed passed, $failed failed"
[ "$failed" = 0 ]
