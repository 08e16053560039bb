"""MuJoCo's C functions, for compiled loops: called by their names in the shared library, without a crossing into Python."""

from pathlib import Path

import llvmlite.binding
import mujoco
from numba import njit, types


def _library() -> Path:
    """The library inside the installed package."""
    return next(Path(mujoco.__file__).parent.glob("libmujoco.so*"))


llvmlite.binding.load_library_permanently(str(_library()))
_ON_MODEL_AND_DATA = types.void(types.intp, types.intp)
mj_step = types.ExternalFunction("mj_step", _ON_MODEL_AND_DATA)
mj_inverse = types.ExternalFunction("mj_inverse", _ON_MODEL_AND_DATA)


@njit(
    "void(intp, intp, float64[::1], float64[::1], float64[::1], float64[::1], float64[:, ::1], float64[:, ::1],"
    "float64[:, ::1], float64[:, ::1])",
    cache=True,
    nogil=True,
)
def inverse_along(
    model, data, at_position, at_velocity, at_acceleration, force, position, velocity, acceleration, out
):
    """Forces `out` (n, nv) along a motion; the four vectors in the middle are those of `data`."""
    for k in range(position.shape[0]):
        at_position[:] = position[k]
        at_velocity[:] = velocity[k]
        at_acceleration[:] = acceleration[k]
        mj_inverse(model, data)
        out[k] = force
