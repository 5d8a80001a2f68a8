// Python's view of the choice of guides.
#include "bindings.hpp"

#include "follow.hpp"

#include <nanobind/stl/tuple.h>

#include <cmath>
#include <tuple>

namespace ringlet {

using Rows = Array<const double, -1, -1>;

static std::tuple<nb::ndarray<nb::numpy, uint32_t>, nb::ndarray<nb::numpy, float>>
choose(Rows strands, Rows guides, Array<const int64_t, -1, -1> candidate, int k, double alike, double unlike) {
    const size_t N = strands.shape(0), D = strands.shape(1), C = candidate.shape(1), G = guides.shape(0);
    require(D >= 3 && guides.shape(1) == D, "follow: strands and guides have different features");
    require(candidate.shape(0) == N && C <= kCandidatesMax, "follow: expected a row of at most 64 candidates for each strand");
    require(k >= 1 && k <= kFollowedMax, "follow: expected 1 to 8 guides for each strand");
    require(alike >= 0 && unlike > alike, "follow: expected 0 <= alike < unlike");
    for (size_t i = 0; i < N * C; ++i)
        require(candidate.data()[i] < int64_t(G), "follow: a candidate beyond the last guide");
    auto guide = new_array<uint32_t>({N, size_t(k)});
    auto weight = new_array<float>({N, size_t(k)});
    const Follow follow{{guides.data(), G}, int(D), int(C), k, alike, unlike};
    const double *from = strands.data();
    const int64_t *among = candidate.data();
    uint32_t *to = guide.data();
    float *much = weight.data();
    nb::gil_scoped_release release;
#pragma omp parallel for num_threads(threads())
    for (ptrdiff_t i = 0; i < ptrdiff_t(N); ++i) follow(from + i * D, among + i * C, to + i * k, much + i * k);
    return {guide, weight};
}

void bind_follow(nb::module_ &m) {
    m.def("follow", &choose, nb::arg("strands"), nb::arg("guides"), nb::arg("candidate"), nb::arg("k"), nb::arg("alike"),
          nb::arg("unlike"));
}

} // namespace ringlet
