"""MuJoCo's C functions for compiled loops: called by name in the shared library, without calls into Python."""

from pathlib import Path

import llvmlite.binding
import mujoco
from numba import njit, types
from numba.extending import intrinsic


def _library() -> Path:
    """The library inside the installed package."""
    return next(Path(mujoco.__file__).parent.glob("libmujoco.so*"))


llvmlite.binding.load_library_permanently(str(_library()))
_ON_MODEL_AND_DATA = types.void(types.intp, types.intp)
mj_step = types.ExternalFunction("mj_step", _ON_MODEL_AND_DATA)
mj_inverse = types.ExternalFunction("mj_inverse", _ON_MODEL_AND_DATA)


@intrinsic
def numbers_at(_, address):
    """The pointer to float64 numbers at an address."""
    signature = types.CPointer(types.float64)(address)

    def made(context, builder, one, arguments):
        return builder.inttoptr(arguments[0], context.get_value_type(one.return_type))

    return signature, made


@njit(
    "void(intp, intp, float64[::1], float64[::1], float64[::1], float64[::1], float64[:, ::1], float64[:, ::1],"
    "float64[:, ::1], float64[:, ::1])",
    cache=True,
    nogil=True,
)
def inverse_along(
    model, data, at_position, at_velocity, at_acceleration, force, position, velocity, acceleration, out
):
    """Forces `out` (n, nv) along a motion; `at_position` to `force` are the vectors of `data`."""
    for k in range(position.shape[0]):
        at_position[:] = position[k]
        at_velocity[:] = velocity[k]
        at_acceleration[:] = acceleration[k]
        mj_inverse(model, data)
        out[k] = force
