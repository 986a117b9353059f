"""Numbers of runs as smooth functions of the unknowns: one Gaussian process for each quantity (scikit-learn).

The kernel is a constant times a Gaussian with a length scale for each unknown, plus noise: mesh and step differ from
point to point. Of a quantity that varies by ratios the logarithm is emulated.
"""

import warnings
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_solve
from scipy.spatial.distance import cdist

from vesdyn.errors import RunError


class Emulator:
    """What the quantities of ``inference`` are anywhere, from a ``table`` (n_points, n_quantities) at ``places``.

    ``left_out`` (n_points, n_quantities) is what all other points tell of each, at unchanged length scales. Raises
    vesdyn.errors.RunError where too few runs give a quantity.
    """

    def __init__(self, inference, places, table):
        from threadpoolctl import threadpool_limits

        self.inference, self.places, self.table = inference, places, table
        self.shift = np.zeros(len(inference.quantities))  # of finer runs, in what is emulated
        self._processes, self.left_out = [], np.full(table.shape, np.nan)
        with threadpool_limits(1):  # the matrices are small
            for k, quantity in enumerate(inference.quantities):
                use = np.isfinite(table[:, k])
                if use.sum() < 2 * places.shape[1] + 2:
                    raise RunError(f"{quantity}: only {use.sum()} runs give it; narrow the ranges of the unknowns.")
                process, left_out = _fitted(places[use], emulated(quantity, table[use, k]))
                self._processes.append(process)
                self.left_out[use, k] = told(quantity, left_out)

    def numbers(self, places):
        """The quantities at ``places`` (m, n_unknowns): quantity to array (m,)."""
        return {quantity: told(quantity, process.mean(places) + shift)
                for quantity, process, shift in zip(self.inference.quantities, self._processes, self.shift)}  # fmt: skip

    def uncertainty(self, places):
        """Standard deviations (m,) of the quantities in units of their spread over the design, on the mean."""
        return np.mean([process.deviation(places) for process in self._processes], axis=0)

    def correct(self, coarse, fine):
        """Shift what is told by the mean difference of ``fine`` from ``coarse``, tables (n_checks, n_quantities)."""
        for k, quantity in enumerate(self.inference.quantities):
            both = np.isfinite(coarse[:, k]) & np.isfinite(fine[:, k])
            off = emulated(quantity, fine[both, k]) - emulated(quantity, coarse[both, k])
            self.shift[k] = off.mean() if both.any() else 0.0

    def corrected(self, table):
        """A ``table`` (n, n_quantities) of runs of the design's wish as finer runs would have it, on the mean."""
        columns = [told(q, emulated(q, table[:, k]) + self.shift[k]) for k, q in enumerate(self.inference.quantities)]
        return np.array(columns).T.reshape(table.shape)

    def off(self, told_table, table):
        """Differences (n, n_quantities) of two tables in what is emulated: relative ones where ratios are."""
        columns = [emulated(q, told_table[:, k]) - emulated(q, table[:, k]) for k, q in enumerate(self.inference.quantities)]
        return np.array(columns).T


class _Process(NamedTuple):
    fitted: object  # sklearn.gaussian_process.GaussianProcessRegressor of the scaled values
    middle: float
    spread: float

    def mean(self, places):
        """As `fitted.predict`, without its checks: this is called for each batch of samples."""
        gaussian = self.fitted.kernel_.k1
        scales = gaussian.k2.length_scale
        near = np.exp(-0.5 * cdist(places / scales, self.fitted.X_train_ / scales, "sqeuclidean"))
        return self.middle + self.spread * gaussian.k1.constant_value * (near @ self.fitted.alpha_)

    def deviation(self, places):
        return self.fitted.predict(places, return_std=True)[1]


def _fitted(places, values):
    """The process of ``values`` (n,) at ``places`` (n, d), and what it tells of each from the others (n,)."""
    from sklearn.exceptions import ConvergenceWarning  # here: slow to import
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    middle, spread = values.mean(), values.std() or 1.0
    gaussian = ConstantKernel(10.0, (1e-2, 1e5)) * RBF(np.full(places.shape[1], 1.5), (0.05, 50.0))
    process = GaussianProcessRegressor(gaussian + WhiteKernel(1e-4, (1e-8, 0.5)), alpha=1e-10)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # a length scale at its limit: no dependence
        process.fit(places, (values - middle) / spread)
    inverse = cho_solve((process.L_, True), np.eye(len(values)))
    return _Process(process, middle, spread), values - spread * process.alpha_ / np.diag(inverse)


def emulated(quantity, value):
    """What of a ``quantity`` is emulated: the logarithm of its ``value``, or this itself."""
    return np.log(value) if quantity.by_ratio else value


def told(quantity, value):
    """The inverse of `emulated`."""
    return np.exp(value) if quantity.by_ratio else value
