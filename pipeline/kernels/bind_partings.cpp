// Python's view of partings.
#include "bindings.hpp"

#include "partings.hpp"

#include <cmath>

namespace ringlet {

using Flats = Array<const double, -1, 2>;

static void require_finite(const double *values, size_t count, const char *message) {
    for (size_t i = 0; i < count; ++i) require(std::isfinite(values[i]), message);
}

static PartingLines lines_of(Array<const double, -1, 2, 2> segments) {
    require_finite(segments.data(), 4 * segments.shape(0), "PartingLines: a point is not finite");
    std::vector<PartingSegment> found(segments.shape(0));
    for (size_t i = 0; i < found.size(); ++i) {
        const double *s = segments.data() + 4 * i;
        found[i] = {{s[0], s[1]}, {s[2], s[3]}};
    }
    return PartingLines(std::move(found));
}

static nb::ndarray<nb::numpy, bool> across(const PartingLines &lines, Flats roots, Flats targets,
                                           Array<const int64_t, -1, -1> candidate) {
    const size_t N = candidate.shape(0), K = candidate.shape(1);
    require(roots.shape(0) == N, "across: expected a row of candidates for each root");
    for (size_t i = 0; i < N * K; ++i)
        require(candidate.data()[i] >= 0 && size_t(candidate.data()[i]) < targets.shape(0),
                "across: a candidate names no target");
    auto result = new_array<bool>({N, K});
    const Flat *from = reinterpret_cast<const Flat *>(roots.data());
    const Flat *to = reinterpret_cast<const Flat *>(targets.data());
    bool *out = result.data();
    const int64_t *chosen = candidate.data();
    nb::gil_scoped_release release;
#pragma omp parallel num_threads(threads())
    {
        std::vector<PartingSegment> near;
#pragma omp for
        for (ptrdiff_t i = 0; i < ptrdiff_t(N); ++i)
            ways_across(lines, from[i], to, chosen + i * K, K, near, out + i * K);
    }
    return result;
}

void bind_partings(nb::module_ &m) {
    nb::class_<PartingLines>(m, "PartingLines")
        .def("__init__",
             [](PartingLines *self, Array<const double, -1, 2, 2> segments) { new (self) PartingLines(lines_of(segments)); },
             nb::arg("segments"))
        .def("across", &across, nb::arg("roots"), nb::arg("targets"), nb::arg("candidate"));
}

} // namespace ringlet
