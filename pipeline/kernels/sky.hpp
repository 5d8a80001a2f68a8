// The head and the sky on the density grid: body density, mean transmittance towards the sky, outward normal.
#pragma once

#include "arena.hpp"
#include "density.hpp"
#include "distance_field.hpp"
#include "elementary.hpp"
#include "pose.hpp"
#include "sweep.hpp"

#include <memory>
#include <optional>

namespace ringlet {

/// Where a grid stands: shape, outer corner of its first voxel, side of a voxel.
struct GridFrame {
    int n[3];
    double origin[3], spacing;
};

/// Opacity of the head inside its surface, on voxels: 1.5 fibres a voxel [1/voxel], a ramp one voxel wide at its edge.
/// It is one voxel thinner than the head, so that hair on the skin does not lie in its shadow.
inline void body_density(const DistanceField &field, const Pose &pose, const GridFrame &grid, float *density, int threads) {
    const Rigid<float> to_rest(pose.inverse());
    const float h = float(grid.spacing);
    Floats lane;
    for (int i = 0; i < 16; ++i) lane[i] = float(i);
#pragma omp parallel for collapse(2) schedule(static) num_threads(threads)
    for (int x = 0; x < grid.n[0]; ++x)
        for (int y = 0; y < grid.n[1]; ++y) {
            float *row = density + (size_t(x) * grid.n[1] + y) * grid.n[2];
            for (int z = 0; z < grid.n[2]; z += 16) {
                const Vec3<float> middle{splat(float(grid.origin[0] + (x + 0.5) * grid.spacing)),
                                         splat(float(grid.origin[1] + (y + 0.5) * grid.spacing)),
                                         (lane + (z + 0.5f)) * h + float(grid.origin[2])};
                Floats phi;
                Vec3<float> gradient;
                sample(field, to_rest(middle), phi, gradient);
                const Floats solid = clamp(0.5f - (phi + h) / h, 0, 1) * (1.5f / h);
                for (int i = 0; i < 16 && z + i < grid.n[2]; ++i) row[z + i] = solid[i];
            }
        }
}

/// What hair answers to light from one of the sky's directions, seen from an eye.
struct Answer {
    static constexpr int kMirrored = 5;

    float mean[3];            // of fibres of all directions, R, G, B; of mean 1 over the sky's directions
    float turned[3][3];       // its gradient [1/m] along x, y, z: away from the grid's middle the eye is in another direction
    float mirrored[kMirrored]; // green, m (h h - 1/3) for half vectors h: xx, yy, xy, xz, yz
};

/// Hair and head at half the resolution, and the sky's directions.
struct Sky {
    std::vector<float> hair; // [1/m]
    const float *body;       // [1/m]; null: no head
    int n[3];
    double spacing;          // [m]
    const float *loss;       // (3,)
    const float *directions; // (D, 3)
    const Answer *answers;   // (D,)
    int count;               // D

    /// Directions by the axis that they go along most and their sense along it, a few at a time.
    std::vector<std::vector<int>> together() const {
        constexpr size_t kTogether = 5;
        std::vector<std::vector<int>> groups;
        for (int axis = 0; axis < 3; ++axis)
            for (int sense : {-1, 1}) {
                size_t in_last = kTogether;
                for (int d = 0; d < count; ++d) {
                    const float *direction = directions + 3 * d;
                    if (dominant(direction) != axis || (direction[axis] > 0) != (sense > 0)) continue;
                    if (in_last == kTogether) groups.emplace_back(), in_last = 0;
                    groups.back().push_back(d), ++in_last;
                }
            }
        return groups;
    }
};

/// Sums of the light of all directions in both kinds of rows: what hair answers in R, G and B, the light as it is, and what
/// fibres mirror. Integers, so that no order of directions changes them.
struct SkySums {
    static constexpr float kWhole = 1 << 28; // of all directions; sums may be a few times as much, and negative
    static constexpr int kSums = 6 + Answer::kMirrored;

    LargeBlock memory;
    int32_t *rows[2][kSums]; // what they are before the first direction means nothing
    bool begun[2] = {false, false};

    explicit SkySums(const int n[3]) : memory(sizeof(int32_t) * kSums * (Rows(n, false).size() + Rows(n, true).size())) {
        int32_t *next = reinterpret_cast<int32_t *>(memory.data());
        for (int across_z = 0; across_z < 2; ++across_z)
            for (int32_t *&channel : rows[across_z]) channel = next, next += Rows(n, across_z).size();
    }

    /// Adds e^(-k n - body), k for R, G and B, of directions that meet the slices in the same order: together, as it costs more
    /// to read and write a sum than to find what is added.
    template <int count> void add(const SweptVoxels *const (&voxels)[count], const Sky &sky, const std::vector<int> &together) {
        std::vector<Sweep<count>> sweeps;
        for (int d : together) sweeps.emplace_back(voxels, sky.spacing, sky.directions + 3 * d);
        const Sweep<count> &first = sweeps[0];
        const int across_z = dominant(sky.directions + 3 * together[0]) == 2;
        const Ints kept = begun[across_z] ? Ints{} - 1 : Ints{};
        int32_t *const *to = rows[across_z];
        for (int k = 0; k < first.slices(); ++k) {
            for (int line = 0; line < first.lines(); ++line)
                for (size_t j = 0; j < first.length(); j += 16) {
                    Floats sums[kSums] = {};
                    size_t at = 0;
                    for (size_t i = 0; i < together.size(); ++i) at = add_step(sweeps[i], k, line, j, sky, together[i], sums);
                    for (int q = 0; q < kSums; ++q) {
                        Ints all;
                        __builtin_memcpy(&all, to[q] + at, sizeof all);
                        all = (all & kept) + whole(sums[q] * (kWhole / sky.count));
                        __builtin_memcpy(to[q] + at, &all, sizeof all);
                    }
                }
            for (Sweep<count> &sweep : sweeps) sweep.next();
        }
        begun[across_z] = true;
    }

    /// What comes to 16 voxels from direction d; their place.
    template <int count>
    RINGLET_INLINE static size_t add_step(Sweep<count> &sweep, int k, int line, size_t j, const Sky &sky, int d, Floats (&sums)[kSums]) {
        const Answer &answer = sky.answers[d];
        const int a = dominant(sky.directions + 3 * d), b = a == 0 ? 1 : 0, c = a == 2 ? 1 : 2;
        const float spacing = float(sky.spacing);
        const auto from_middle = [&](int number, int axis) { return (float(number) - 0.5f * float(sky.n[axis] - 1)) * spacing; };
        Floats tau[count], lane;
        for (int i = 0; i < 16; ++i) lane[i] = float(i) * spacing;
        const SweptPlace at = sweep.step(k, line, j, tau);
        const float u = from_middle(at.slice, a), v = from_middle(at.line, b), w = from_middle(at.first, c);
        for (int q = 0; q < 3; ++q) {
            const Floats light = exponential(count == 2 ? -(sky.loss[q] * tau[0] + tau[count - 1]) : -(sky.loss[q] * tau[0]));
            const float *turned = answer.turned[q], here = answer.mean[q] + turned[a] * u + turned[b] * v + turned[c] * w;
            sums[q] += light * (here + turned[c] * lane);
            sums[3 + q] += light;
            if (q == 1)
                for (int m = 0; m < Answer::kMirrored; ++m) sums[6 + m] += light * answer.mirrored[m];
        }
        return at.at;
    }
};

/// Adds up what threads have of slab x and visits (sums of one voxel, number in (nx, ny, nz)).
template <class Visit>
RINGLET_INLINE void each_sum(const std::vector<std::unique_ptr<SkySums>> &all, const int n[3], int across_z, int x, Visit &&visit) {
    const Rows rows(n, across_z);
    const int line = across_z ? 2 : 1, along = 3 - line;
    const size_t step = across_z ? n[2] : 1; // between the voxels of a row
    for (int i = 0; i < n[line]; ++i)
        for (int j = 0; j < n[along]; j += 16) {
            const size_t from = x * rows.stride(0) + i * rows.stride(line) + j, lanes = std::min(16, n[along] - j);
            const size_t voxel = (size_t(x) * n[1] + (across_z ? j : i)) * n[2] + (across_z ? i : j);
            Ints sums[SkySums::kSums] = {};
            for (const auto &own : all) {
                if (!own || !own->begun[across_z]) continue;
#pragma GCC unroll 16
                for (int k = 0; k < SkySums::kSums; ++k) {
                    Ints part;
                    __builtin_memcpy(&part, own->rows[across_z][k] + from, sizeof part);
                    sums[k] += part;
                }
            }
            float values[SkySums::kSums][16];
#pragma GCC unroll 16
            for (int k = 0; k < SkySums::kSums; ++k) {
                const Floats value = real(sums[k]) * (1 / SkySums::kWhole);
                __builtin_memcpy(values[k], &value, sizeof value);
            }
            for (size_t lane = 0; lane < lanes; ++lane) visit([&](int k) RINGLET_ALWAYS { return values[k][lane]; }, voxel + lane * step);
        }
}

/// Writes the mean of e^(-k n - body) over all directions, as hair answers, to entries 0, 1, 2 of records (nx, ny, nz, 16), what
/// fibres mirror to 8 .. 12, and as it is to those of `open` (nx, ny, nz, 4).
inline void write_transmittance(const Sky &sky, float *records, float *open, int threads) {
    const SweptVoxels hair(sky.hair.data(), sky.n, threads);
    const std::optional<SweptVoxels> body = sky.body ? std::optional<SweptVoxels>({sky.body, sky.n, threads}) : std::nullopt;
    const std::vector<std::vector<int>> groups = sky.together();
    std::vector<std::unique_ptr<SkySums>> all(groups.size()); // of threads that had something to do
#pragma omp parallel num_threads(threads)
    {
        SkySums *own = nullptr;
#pragma omp for schedule(dynamic, 1) nowait
        for (size_t k = 0; k < groups.size(); ++k) {
            if (!own) own = (all[k] = std::make_unique<SkySums>(sky.n)).get();
            if (body) own->add<2>({&hair, &*body}, sky, groups[k]);
            else own->add<1>({&hair}, sky, groups[k]);
        }
    }
    const auto add = [&](const auto &sum, size_t voxel, float kept) RINGLET_ALWAYS {
        float *record = records + 16 * voxel, *plain = open + 4 * voxel;
#pragma GCC unroll 16
        for (int k = 0; k < SkySums::kSums; ++k) {
            float &to = k < 3 ? record[k] : k < 6 ? plain[k - 3] : record[k + 2];
            to = kept * to + sum(k);
        }
    };
#pragma omp parallel for schedule(static) num_threads(threads)
    for (int x = 0; x < sky.n[0]; ++x) {
        each_sum(all, sky.n, false, x, [&](const auto &sum, size_t voxel) RINGLET_ALWAYS { add(sum, voxel, 0); });
        each_sum(all, sky.n, true, x, [&](const auto &sum, size_t voxel) RINGLET_ALWAYS { add(sum, voxel, 1); });
    }
}

/// Writes minus the gradient of the smoothed hair to entries 4, 5, 6 of the records.
inline void add_normals(Sky &sky, float *records, int threads) {
    // Twice 0.7 is one voxel here, two of the density grid
    for (int pass = 0; pass < 2; ++pass) blur(sky.hair.data(), sky.n, threads);
    const ptrdiff_t stride[3] = {ptrdiff_t(sky.n[1]) * sky.n[2], sky.n[2], 1};
#pragma omp parallel for schedule(static) num_threads(threads)
    for (int x = 0; x < sky.n[0]; ++x)
        for (int y = 0; y < sky.n[1]; ++y)
            for (int z = 0; z < sky.n[2]; ++z) {
                const ptrdiff_t i = x * stride[0] + y * stride[1] + z;
                const int at[3] = {x, y, z};
                for (int axis = 0; axis < 3; ++axis) {
                    const ptrdiff_t below = at[axis] > 0 ? stride[axis] : 0;
                    const ptrdiff_t above = at[axis] + 1 < sky.n[axis] ? stride[axis] : 0;
                    records[16 * i + 4 + axis] = sky.hair[i - below] - sky.hair[i + above];
                }
            }
}

} // namespace ringlet
