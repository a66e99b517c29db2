# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What people would use instead: peers that fit a surface to a case of benchmarks.accuracy.

Peers that fit the contacts start from the paper's frame, in unit radius. Where one needs a setting that its
user would have to find, several were tried on the exact surfaces at all three noise levels, and the one that
was best over these is used.
Optional packages are imported where they are used.
"""

import warnings
from typing import NamedTuple

import numpy as np

from core import reconstruct
from core.patch.monge import exponents, monomials

from .whole import cloud


class Fit(NamedTuple):
    """A fitted surface in its own frame; kappas and height_std are None where the method has none.

    height and height_std are functions of x and y in the frame, in length.
    """

    axes: np.ndarray
    height: object
    kappas: tuple[float, float] | None = None
    height_std: object = None


def _start(case):
    """The paper's frame and quadric (a Reconstruction), contacts (n, 3) in it and in unit radius, and L.

    The reference point is the first contact.
    """
    r = reconstruct(case.point, case.contours, outward=case.axes[:, 2], method="least-squares", degree=2)
    return r, np.vstack([np.zeros(3), r.contacts]) / r.radius, r.radius


def _scaled_fit(r, height):
    """The Fit in the frame of r; `height` maps points (m, 2) to heights (m,), both in unit radius."""
    return Fit(r.frame.axes, lambda x, y: r.radius * height(np.column_stack([x, y]) / r.radius))


def _process(points, values, length=1.0, nu=2.5, noisiest=0.1, **options):
    """The process of values (n,) at points (n, 2) whose hyperparameters have the maximum likelihood."""
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

    kernel = ConstantKernel(1.0, (1e-4, 1e4)) * Matern(length, (0.05, 20.0), nu=nu)
    process = GaussianProcessRegressor(kernel + WhiteKernel(1e-4, (1e-9, noisiest)), **options)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # It warns of hyperparameters at their bounds.
        return process.fit(points, values)


def gaussian_process(case, nu=2.5):
    """A process of the heights, with a noise of its own.

    nu : the order of the Matérn covariance; np.inf is the squared exponential
    """
    r, contacts, _ = _start(case)
    return _scaled_fit(r, _process(contacts[:, :2], contacts[:, 2], nu=nu, normalize_y=True).predict)


def quadric_process(case):
    """A quadric and a process of its residuals, with a deviation; this suits real surfaces better."""
    r, contacts, _ = _start(case)
    height, height_std = matern_on_quadric(contacts)
    fit = _scaled_fit(r, height)
    return fit._replace(height_std=lambda x, y: r.radius * height_std(np.column_stack([x, y]) / r.radius))


def matern_on_quadric(contacts, noisiest=0.1):
    """Fits contacts (n, 3) in unit radius; returns functions of points (m, 2): height and deviation, (m,).

    noisiest : the largest variance of the noise, as a multiple of that of the quadric's residuals
    """
    terms = exponents(0, 2)
    basis = monomials(contacts, terms)
    b = np.linalg.lstsq(basis, contacts[:, 2], rcond=None)[0]
    left = contacts[:, 2] - basis @ b
    scale = max(left.std(), 1e-9)
    process = _process(contacts[:, :2], left / scale, 0.5, noisiest=noisiest)

    def height_std(points):
        noisy = process.predict(points, return_std=True)[1] ** 2 - process.kernel_.k2.noise_level
        return scale * np.sqrt(np.maximum(noisy, 0.0))

    return lambda points: monomials(points, terms) @ b + scale * process.predict(points), height_std


def radial_basis(case, kernel, **options):
    """scipy's RBFInterpolator with these options; smoothing is in unit radius."""
    from scipy.interpolate import RBFInterpolator

    r, contacts, _ = _start(case)
    return _scaled_fit(r, RBFInterpolator(contacts[:, :2], contacts[:, 2], kernel=kernel, **options))


def moving_least_squares(case, width=0.5):
    """A quadric for each point at which the height is needed, weighted by a Gaussian of `width`, in L.

    Narrower weights would see one curve at a time, which does not determine a quadric.
    """
    r, contacts, _ = _start(case)
    terms = exponents(0, 2)
    basis = monomials(contacts, terms)
    products = (basis[:, :, None] * basis[:, None]).reshape(len(basis), -1)

    def height(points):
        apart = points[:, None] - contacts[:, :2]
        weights = np.exp(-0.5 * np.sum(apart**2, axis=2) / width**2)
        normal = (weights @ products).reshape(-1, len(terms), len(terms))
        coefficients = np.linalg.solve(normal, (weights @ (basis * contacts[:, 2:]))[..., None])[..., 0]
        return np.sum(monomials(points, terms) * coefficients, axis=1)

    return _scaled_fit(r, height)


def jet(case, degree):
    """A polynomial with all terms, by least squares in the paper's frame; kappas by its shape operator."""
    r, contacts, radius = _start(case)
    terms = exponents(1, degree)
    b = np.linalg.lstsq(monomials(contacts, terms), contacts[:, 2], rcond=1e-10)[0]
    slopes, second = b[:2], np.array([[2.0 * b[2], b[3]], [b[3], 2.0 * b[4]]])
    first = np.eye(2) + np.outer(slopes, slopes)
    operator = np.linalg.solve(first, second) / np.sqrt(1.0 + slopes @ slopes)
    kappas = np.sort(np.linalg.eigvals(operator).real) / radius
    return _scaled_fit(r, lambda points: monomials(points, terms) @ b)._replace(kappas=tuple(kappas))


def smoothing_spline(case, degree=2, misfit=5e-3):
    """FITPACK's surfit, with the given noise and a `misfit` of its own, in L.

    Without the misfit it would add knots without end. The spline is quadratic, because between three lines a
    cubic one is as free as a jet.
    """
    from scipy.interpolate import SmoothBivariateSpline

    r, contacts, radius = _start(case)
    weights = np.full(len(contacts), 1.0 / np.hypot(case.noise / radius, misfit))
    options = {"w": weights, "bbox": [-1.2, 1.2, -1.2, 1.2], "kx": degree, "ky": degree}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # It warns of knots that it would like to add.
        spline = SmoothBivariateSpline(*contacts.T, **options)
    return _scaled_fit(r, lambda points: spline.ev(*points.T))


def screened_poisson(case, true_normals, neighbors=40):
    """pymeshlab's screened Poisson reconstruction of the contacts with normals.

    The normals are the surface's own, which no curve tells, or are estimated from neighboring contacts. Fewer
    neighbors would all be of one curve, which does not determine a normal. A finer octree changes only the
    time. Heights are linear between the vertices of the upper side.
    """
    from scipy.interpolate import LinearNDInterpolator

    r, contacts, _ = _start(case)
    normals = np.vstack([contour.normals for contour in case.contours]) @ r.frame.axes
    offsets = np.vstack([contour.points for contour in case.contours]) - case.point
    given = normals[np.linalg.norm(offsets, axis=1) > 0.0]
    normals = np.vstack([case.axes[:, 2] @ r.frame.axes, given])  # The contacts have the same order.
    meshes = cloud(contacts, normals)
    if not true_normals:
        meshes.compute_normal_for_point_clouds(
            k=neighbors, flipflag=True, viewpos=np.array([0.0, 0.0, 100.0])
        )
    meshes.generate_surface_reconstruction_screened_poisson(depth=6, fulldepth=4, pointweight=50.0, threads=1)
    mesh = meshes.current_mesh()
    vertices = mesh.vertex_matrix()
    above = (mesh.vertex_normal_matrix()[:, 2] > 0.0) & (np.abs(vertices).max(axis=1) < 1.3)
    return _scaled_fit(r, LinearNDInterpolator(vertices[above, :2], vertices[above, 2]))
