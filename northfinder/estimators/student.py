"""Student's t where a sigma is estimated, the normal distribution where it is absolute."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri, stdtrit

from northfinder.estimators.arrays import FloatArray


def student_quantile(probability: float, dof: ArrayLike) -> FloatArray:
    """Return the quantile of Student's t; infinite ``dof`` means the normal distribution."""
    freedom = np.asarray(dof, dtype=np.float64)
    absolute = np.isinf(freedom)
    quantile = stdtrit(np.where(absolute, 1.0, freedom), probability)
    return np.where(absolute, ndtri(probability), quantile)


def sigma_limit(sigmas: float, dof: ArrayLike) -> FloatArray:
    """Return the t value that noise alone exceeds as rarely as a normal one ``sigmas``."""
    return student_quantile(float(ndtr(sigmas)), dof)
