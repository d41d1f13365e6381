"""NumPy's arrays behind the rules of arrays on a device: nothing is converted unless asked for.

A stand-in for CuPy. NumPy's functions refuse these arrays, and operations with NumPy's arrays fail;
methods and functions take no more arguments than CuPy's do.
"""

import numpy as np

float32, float64, int32, int64 = np.float32, np.float64, np.int32, np.int64


class Array:
    """An array of the device."""

    __array_priority__ = 100

    def __init__(self, held):
        self._held = np.asarray(held)

    def __array__(self, *_, **__):
        raise TypeError("Implicit conversion to a NumPy array is not allowed")

    def __array_ufunc__(self, ufunc, *_, **__):
        raise TypeError(f"numpy.{ufunc.__name__} of an array on a device")

    def __array_function__(self, func, *_):
        raise TypeError(f"numpy.{func.__name__} of an array on a device")

    held = property(lambda self: self._held)
    shape = property(lambda self: self._held.shape)
    size = property(lambda self: self._held.size)
    ndim = property(lambda self: self._held.ndim)
    dtype = property(lambda self: self._held.dtype)
    T = property(lambda self: Array(self._held.T))

    def __len__(self):
        return len(self._held)

    def __iter__(self):
        raise TypeError("going through an array of a device one by one")

    def __float__(self):
        return float(self._held)

    def __int__(self):
        return int(self._held)

    def __bool__(self):
        return bool(self._held)

    def __getitem__(self, index):
        return Array(self._held[_index(index)])

    def __setitem__(self, index, value):
        self._held[_index(index)] = _plain(value)

    def astype(self, dtype):
        return Array(self._held.astype(dtype))

    def copy(self):
        return Array(self._held.copy())

    def reshape(self, *shape):
        return Array(self._held.reshape(*shape))

    def sum(self, axis=None, dtype=None, keepdims=False):
        return Array(self._held.sum(axis=axis, dtype=dtype, keepdims=keepdims))

    def max(self, axis=None):
        return Array(self._held.max(axis=axis))

    def any(self):
        return Array(self._held.any())


def _plain(value):
    """The values of an operand: an array of the device, or one number."""
    if isinstance(value, Array):
        return value._held
    if isinstance(value, np.ndarray):
        raise TypeError("Unsupported type <class 'numpy.ndarray'>")
    return value


def _index(index):
    if isinstance(index, tuple):
        return tuple(map(_index, index))
    return _plain(index)


def _operator(name):
    def apply(self, other):
        return Array(getattr(self._held, name)(_plain(other)))

    return apply


for _name in ("add", "sub", "mul", "truediv", "and", "or", "pow", "matmul"):
    setattr(Array, f"__{_name}__", _operator(f"__{_name}__"))
    setattr(Array, f"__r{_name}__", _operator(f"__r{_name}__"))
for _name in ("lt", "le", "gt", "ge", "eq", "ne"):
    setattr(Array, f"__{_name}__", _operator(f"__{_name}__"))
Array.__neg__ = lambda self: Array(-self._held)
Array.__invert__ = lambda self: Array(~self._held)


def _in_place(name):
    def apply(self, other):
        self._held = getattr(self._held, name)(_plain(other))
        return self

    return apply


for _name in ("iadd", "isub", "imul", "itruediv"):
    setattr(Array, f"__{_name}__", _in_place(f"__{_name}__"))


def asarray(value):
    """Bring an array to the device."""
    return value if isinstance(value, Array) else Array(np.array(value))


def asnumpy(value):
    """Bring an array back."""
    return value._held.copy()


def _function(function, *allowed):
    """A function of arrays that takes only the keywords that CuPy's has."""

    def apply(*operands, **others):
        assert set(others) <= set(allowed), others
        others = {name: _plain(value) for name, value in others.items()}
        found = function(*map(_plain, operands), **others)
        return tuple(map(Array, found)) if isinstance(found, tuple) else Array(found)

    return apply


def _maker(function):
    def apply(shape, dtype=float):
        return Array(function(shape, dtype=dtype))

    return apply


zeros, empty, ones = _maker(np.zeros), _maker(np.empty), _maker(np.ones)
zeros_like, empty_like = _function(np.zeros_like), _function(np.empty_like)
nonzero, where = _function(np.nonzero), _function(np.where)
exp, log, sqrt, ceil = (_function(one) for one in (np.exp, np.log, np.sqrt, np.ceil))
minimum, maximum = _function(np.minimum), _function(np.maximum)
logaddexp, isfinite = _function(np.logaddexp), _function(np.isfinite)
ascontiguousarray = _function(np.ascontiguousarray)
roll, repeat = _function(np.roll, "axis"), _function(np.repeat, "axis")
bincount = _function(np.bincount, "weights", "minlength")
cumsum = _function(np.cumsum, "dtype")
searchsorted = _function(np.searchsorted, "side")
unique = _function(np.unique, "return_index")
arange, take = _function(np.arange, "dtype"), _function(np.take, "axis")
