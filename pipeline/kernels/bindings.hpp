// What the binding files share: array types that check dtype, shape and strides at the boundary.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstddef>
#include <memory>
#include <stdexcept>

namespace ringlet {

namespace nb = nanobind;

/// Contiguous array on the CPU; -1 is any extent.
template <class T, ssize_t... Shape>
using Array = nb::ndarray<T, nb::numpy, nb::shape<Shape...>, nb::c_contig, nb::device::cpu>;

/// A new numpy array that owns its memory, filled with zeros.
template <class T, size_t N> nb::ndarray<nb::numpy, T> new_array(const size_t (&shape)[N]) {
    size_t count = 1;
    for (size_t extent : shape) count *= extent;
    auto data = std::make_unique<T[]>(count);
    T *raw = data.release();
    nb::capsule owner(raw, [](void *p) noexcept { delete[] static_cast<T *>(p); });
    return nb::ndarray<nb::numpy, T>(raw, N, shape, owner);
}

/// Raises ValueError unless the condition holds.
inline void require(bool condition, const char *message) {
    if (!condition) throw nb::value_error(message);
}

/// Number of OpenMP threads of every kernel (see `set_threads`).
int threads();

} // namespace ringlet
