# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A robot that feels a whole object without a model of it: each touch is where the last ones left most open.

    python examples/robot.py contacts.csv [--tolerance MM] [--touches N] [--seed SEED]

The robot is played: its contacts are noisy, answers come late, and some approaches fail. All that is known
is in contacts.csv, which is written after each answer. So the run may be stopped at any time, and the same
command goes on from there. It ends once the surface is closed and as certain as the tolerance. For a robot
of your own, replace the class Robot.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
import tactile_core as core

HALF_AXES = np.array([32.0, 24.0, 17.0])  # of the pebble that is felt, in mm
NOISE = 0.05  # mm
# The first touch: a place on the object, the way outward, and the length of half a curve.
START, OUTWARD, EXTENT = np.array([0.0, 0.0, 17.0]), np.array([0.0, 0.0, 1.0]), 12.0
# The shares of approaches that fail and of answers that come after the next order.
FAILS, LATE = 0.15, 0.3


class Pebble:
    """An ellipsoid that answers rays, as the robot's world."""

    def ray_cast(self, origin, direction, distance):
        o, d = np.asarray(origin) / HALF_AXES, np.asarray(direction) / HALF_AXES
        a, b, c = d @ d, o @ d, o @ o - 1.0
        root = np.sqrt(max(b * b - a * c, 0.0))
        for length in ((-b - root) / a, (-b + root) / a):
            if root and 0.0 <= length <= distance:
                point = (o + length * d) * HALF_AXES
                normal = point / HALF_AXES**2
                return point, normal / np.linalg.norm(normal)
        return None


class Robot:
    """Touches what is ordered and answers later. It is the part to replace by a robot of your own."""

    def __init__(self, seed):
        self.rng, self.orders = np.random.default_rng(seed), []

    def order(self, touch):
        self.orders.append(touch)

    def answers(self):
        """(touch, its contours) of orders that are done; None if the robot did not reach the object."""
        done = []
        while self.orders and self.rng.random() > LATE:
            touch = self.orders.pop(0)
            done.append((touch, self._felt(touch)))
        return done

    def _felt(self, touch):
        """Comes down along the way inward, and slides to and fro in each direction."""
        reach = 2.0 * touch.extent
        hit = Pebble().ray_cast(touch.point + reach * touch.outward, -touch.outward, 2.0 * reach)
        if hit is None or self.rng.random() < FAILS:
            return None
        options = {"extent": touch.extent, "step": touch.step, "noise": NOISE, "rng": self.rng}
        plane, found = core.SamplingPlane(0.0), []
        for way in touch.directions:
            (contour,) = core.track(Pebble(), *hit, [plane], tangent=way, **options)
            found.append(core.Contour(contour.points, noise=NOISE))
        return found


def following(atlas, tried):
    """The next touch, other than those that were tried: that of an atlas, or the first."""
    if atlas is not None:
        return atlas.next_touch(tried)
    planes = (core.SamplingPlane(turn) for turn in np.radians([0.0, 60.0, 120.0]))
    directions = np.array([plane.axes(OUTWARD)[:, 0] for plane in planes])
    return core.NextTouch(START, OUTWARD, directions, EXTENT, EXTENT / 12.0, 0.0)


def run(path, tolerance, most, seed):
    """The atlas of all contacts, once it is "ok" or after `most` orders."""
    contours = list(core.contacts_from_csv(path.read_text()).strokes) if path.exists() else []
    robot, atlas, failed, has_news = Robot([seed, len(contours)]), None, [], bool(contours)
    while True:
        if has_news:
            atlas = core.atlas_of(contours, outward=OUTWARD, tolerance=tolerance)
            print(f"{len(contours) // 3} touches: {atlas.message}", flush=True)
            if atlas.status == "ok":
                return atlas
        touch = following(atlas, [*failed, *(order.point for order in robot.orders)])
        if (touch is not None and most == 0) or not (touch or robot.orders or failed):
            return atlas
        if touch is not None:
            robot.order(touch)
            most -= 1
        elif not robot.orders:
            failed = []  # Nothing else is left, so these places are tried again.
        has_news = False
        for order, felt in robot.answers():
            if felt is None:
                failed.append(order.point)
                print("The robot did not reach the object.", flush=True)
            else:
                contours, has_news = contours + felt, True
                save(path, contours)


def save(path, contours):
    given = core.Contacts([], "mm", outward=OUTWARD.tolist(), strokes=tuple(contours))
    path.write_text(core.contacts_to_csv(given))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("contacts", type=Path, help="the file of all contacts, which need not exist")
    parser.add_argument("--tolerance", type=float, default=0.3, help="mean deviation, in mm (%(default)s)")
    parser.add_argument("--touches", type=int, default=60, help="stop after this many orders (%(default)s)")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    atlas = run(options.contacts, options.tolerance, options.touches, options.seed)
    if atlas is None or atlas.status != "ok":
        sys.exit(f"robot: stopped after {options.touches} orders; the same command goes on from there")
    directions = np.random.default_rng(1).normal(size=(1000, 3))
    places = HALF_AXES * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    distance, std = atlas.distance(places)
    within = 100.0 * np.mean(np.abs(distance) <= 1.645 * std)
    off = np.abs(distance).mean()
    print(f"The surface is {off:.3f} mm off the pebble; {within:.0f} % are in the 90 % interval.")


if __name__ == "__main__":
    main()
