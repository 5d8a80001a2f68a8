// Signed distance from the nodes of a grid to a closed triangle mesh, and where on the mesh it is measured.
//
// Nodes near the surface take the closest point of the nearest triangle; all others the nearest foot that sweeps over
// the grid bring them from there (Danielsson, "Euclidean Distance Mapping", 1980). Inside or outside is told by the
// angle-weighted pseudonormal of the face, edge or point that is nearest (Baerentzen and Aanaes, "Signed Distance
// Computation Using the Angle Weighted Pseudonormal", 2005), and away from the surface by the majority of the nodes on
// the border of the region that a node belongs to. Notation: a, b, c corners of a triangle, q a node, foot the closest
// point of the mesh. No result depends on the number of threads.
#pragma once

#include "rest.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace ringlet {

inline constexpr double kExact = 2.2; // [cells] nodes this close to a triangle take their exact foot

struct Triangle {
    int corner[3];
};

/// The closest point of a triangle, and where it is: 0-2 a corner, 3-5 the edge opposite to it, 6 the face.
struct Foot {
    Vec at;
    int feature;
};

inline Foot foot_on_edge(Vec q, Vec a, Vec b, int first, int second, int edge) {
    const Vec ab = b - a;
    const double s = dot(q - a, ab) / std::max(dot(ab, ab), 1e-300);
    if (s <= 0) return {a, first};
    if (s >= 1) return {b, second};
    return {a + s * ab, edge};
}

inline Foot foot_on_triangle(Vec q, Vec a, Vec b, Vec c) {
    const Vec ab = b - a, ac = c - a, aq = q - a;
    const double d00 = dot(ab, ab), d01 = dot(ab, ac), d11 = dot(ac, ac), d20 = dot(aq, ab), d21 = dot(aq, ac);
    const double area = std::max(d00 * d11 - d01 * d01, 1e-300);
    const double v = (d11 * d20 - d01 * d21) / area, w = (d00 * d21 - d01 * d20) / area;
    if (v >= 0 && w >= 0 && v + w <= 1) return {a + v * ab + w * ac, 6};
    Foot best = foot_on_edge(q, b, c, 1, 2, 3);
    for (const Foot &other : {foot_on_edge(q, c, a, 2, 0, 4), foot_on_edge(q, a, b, 0, 1, 5)})
        if (norm(other.at - q) < norm(best.at - q)) best = other;
    return best;
}

/// A closed mesh, wound outwards.
struct Mesh {
    std::vector<Vec> points;
    std::vector<Triangle> triangles;
    std::vector<std::array<Vec, 7>> outwards; // pseudonormals of corners, edges opposite to them, and face

    Vec corner(int triangle, int k) const { return points[triangles[triangle].corner[k]]; }

    /// Barycentric weights of a point of a triangle.
    void weights(int triangle, Vec q, double (&weight)[3]) const {
        const Vec a = corner(triangle, 0), ab = corner(triangle, 1) - a, ac = corner(triangle, 2) - a, aq = q - a;
        const double d00 = dot(ab, ab), d01 = dot(ab, ac), d11 = dot(ac, ac), d20 = dot(aq, ab), d21 = dot(aq, ac);
        const double area = std::max(d00 * d11 - d01 * d01, 1e-300);
        weight[1] = (d11 * d20 - d01 * d21) / area, weight[2] = (d00 * d21 - d01 * d20) / area;
        weight[0] = 1 - weight[1] - weight[2];
    }

    /// Fills `outwards`.
    void measure_normals() {
        struct Side {
            uint64_t edge;
            int triangle, opposite;
        };
        const size_t T = triangles.size();
        outwards.resize(T);
        std::vector<Vec> at_point(points.size(), Vec{0, 0, 0});
        std::vector<Side> sides;
        for (size_t t = 0; t < T; ++t) {
            const Vec p[3] = {corner(t, 0), corner(t, 1), corner(t, 2)};
            const Vec n = unit(cross(p[1] - p[0], p[2] - p[0]));
            outwards[t][6] = n;
            for (int k = 0; k < 3; ++k) {
                const int i = (k + 1) % 3, j = (k + 2) % 3;
                const double cosine = dot(unit(p[i] - p[k]), unit(p[j] - p[k]));
                Vec &sum = at_point[triangles[t].corner[k]];
                sum = sum + std::acos(std::clamp(cosine, -1.0, 1.0)) * n;
                const auto [low, high] = std::minmax(triangles[t].corner[i], triangles[t].corner[j]);
                sides.push_back({uint64_t(low) << 32 | uint32_t(high), int(t), k});
            }
        }
        std::stable_sort(sides.begin(), sides.end(), [](const Side &a, const Side &b) { return a.edge < b.edge; });
        for (size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
            Vec sum{0, 0, 0};
            for (; end < sides.size() && sides[end].edge == sides[begin].edge; ++end)
                sum = sum + outwards[sides[end].triangle][6];
            for (size_t k = begin; k < end; ++k) outwards[sides[k].triangle][3 + sides[k].opposite] = sum;
        }
        for (size_t t = 0; t < T; ++t)
            for (int k = 0; k < 3; ++k) outwards[t][k] = at_point[triangles[t].corner[k]];
    }

  private:
    static Vec unit(Vec a) { return (1 / std::max(norm(a), 1e-300)) * a; }
};

/// The grid around a mesh.
class MeshDistance {
  public:
    Mesh mesh;
    int n[3];
    double origin[3], spacing;
    std::vector<float> values;   // (nx, ny, nz) [m], negative inside
    std::vector<int32_t> owner;  // triangle of the foot
    std::vector<float> foot;     // (nx, ny, nz, 3) [m]

    void measure(int threads) {
        const size_t count = size_t(n[0]) * n[1] * n[2];
        values.assign(count, std::numeric_limits<float>::infinity());
        owner.assign(count, -1);
        foot.assign(3 * count, 0);
        inside_.assign(count, 0);
        mesh.measure_normals();
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads)
        for (int slab = 0; slab < (n[0] + kSlab - 1) / kSlab; ++slab)
            near_surface(slab * kSlab, std::min(n[0], (slab + 1) * kSlab));
        tell_sides();
        for (int round = 0; round < 3; ++round)
            for (int axis = 0; axis < 3; ++axis) bring_feet(axis, threads);
        for (size_t k = 0; k < count; ++k) values[k] = inside_[k] ? -values[k] : values[k];
    }

    /// The triangle that is closest to a point, of those that are closest to the nodes around it, and the barycentric
    /// weights of its foot there.
    int closest(Vec q, double (&weight)[3]) const {
        const double p[3] = {q.x, q.y, q.z};
        int low[3], best = -1;
        for (int k = 0; k < 3; ++k) low[k] = int(std::clamp((p[k] - origin[k]) / spacing, 0.0, n[k] - 2.0));
        double nearest = std::numeric_limits<double>::infinity();
        for (int side = 0; side < 8; ++side) {
            const int t = owner[node(low[0] + (side & 1), low[1] + (side >> 1 & 1), low[2] + (side >> 2))];
            const Vec at = foot_on_triangle(q, mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)).at;
            const double d = norm(q - at);
            if (d >= nearest) continue;
            nearest = d, best = t;
            mesh.weights(t, at, weight);
        }
        return best;
    }

    /// How far the mesh's points move to `next`, (3, nx, ny, nz) [m], at the foot of every node.
    void drift(const std::vector<Vec> &next, float *out, int threads) const {
        const ptrdiff_t count = ptrdiff_t(values.size());
#pragma omp parallel for num_threads(threads)
        for (ptrdiff_t k = 0; k < count; ++k) {
            double weight[3];
            mesh.weights(owner[k], Vec{foot[3 * k], foot[3 * k + 1], foot[3 * k + 2]}, weight);
            Vec moved{0, 0, 0};
            for (int corner = 0; corner < 3; ++corner) {
                const int point = mesh.triangles[owner[k]].corner[corner];
                moved = moved + weight[corner] * (next[point] - mesh.points[point]);
            }
            out[k] = float(moved.x), out[count + k] = float(moved.y), out[2 * count + k] = float(moved.z);
        }
    }

  private:
    static constexpr int kSlab = 4; // planes of nodes that one task fills
    std::vector<uint8_t> inside_;

    size_t node(int x, int y, int z) const { return (size_t(x) * n[1] + y) * n[2] + z; }

    /// Exact distances of the nodes near triangles, in planes begin .. end of x.
    void near_surface(int begin, int end) {
        const double reach = kExact * spacing;
        for (size_t t = 0; t < mesh.triangles.size(); ++t) {
            const Vec a = mesh.corner(t, 0), b = mesh.corner(t, 1), c = mesh.corner(t, 2);
            const double low[3] = {std::min({a.x, b.x, c.x}), std::min({a.y, b.y, c.y}), std::min({a.z, b.z, c.z})};
            const double high[3] = {std::max({a.x, b.x, c.x}), std::max({a.y, b.y, c.y}), std::max({a.z, b.z, c.z})};
            int first[3], last[3];
            for (int k = 0; k < 3; ++k) {
                first[k] = int(std::clamp(std::ceil((low[k] - reach - origin[k]) / spacing), 0.0, double(n[k])));
                last[k] = int(std::clamp(std::floor((high[k] + reach - origin[k]) / spacing), -1.0, n[k] - 1.0));
            }
            for (int x = std::max(first[0], begin); x <= std::min(last[0], end - 1); ++x)
                for (int y = first[1]; y <= last[1]; ++y)
                    for (int z = first[2]; z <= last[2]; ++z) offer(int(t), x, y, z, reach);
        }
    }

    /// Triangle t to a node, which takes it when it is the nearest so far.
    void offer(int t, int x, int y, int z, double reach) {
        const size_t k = node(x, y, z);
        const Vec q{origin[0] + spacing * x, origin[1] + spacing * y, origin[2] + spacing * z};
        const double best = std::min(double(values[k]), reach);
        if (std::abs(dot(q - mesh.corner(t, 0), mesh.outwards[t][6])) >= best) return;
        const Foot found = foot_on_triangle(q, mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2));
        const double d = norm(q - found.at);
        if (d >= best) return;
        values[k] = float(d);
        owner[k] = t;
        inside_[k] = dot(q - found.at, mesh.outwards[t][found.feature]) < 0;
        foot[3 * k] = float(found.at.x), foot[3 * k + 1] = float(found.at.y), foot[3 * k + 2] = float(found.at.z);
    }

    /// Inside or outside for the nodes away from the surface, region by region.
    void tell_sides() {
        std::vector<uint8_t> seen(values.size(), 0);
        std::vector<size_t> region;
        const size_t stride[3] = {size_t(n[1]) * n[2], size_t(n[2]), 1};
        for (size_t start = 0; start < values.size(); ++start) {
            if (owner[start] >= 0 || seen[start]) continue;
            long votes = 0;
            region.assign(1, start);
            seen[start] = 1;
            for (size_t next = 0; next < region.size(); ++next) {
                const size_t k = region[next];
                const size_t place[3] = {k / stride[0], k / stride[1] % n[1], k % n[2]};
                for (int side = 0; side < 6; ++side) {
                    const int axis = side / 2;
                    if (side % 2 ? place[axis] + 1 == size_t(n[axis]) : place[axis] == 0) continue;
                    const size_t beside = side % 2 ? k + stride[axis] : k - stride[axis];
                    if (owner[beside] >= 0) votes += inside_[beside] ? 1 : -1;
                    else if (!seen[beside]) seen[beside] = 1, region.push_back(beside);
                }
            }
            for (size_t k : region) inside_[k] = votes > 0;
        }
    }

    /// Each line of nodes along an axis, there and back: a node takes the foot of the one before when it is nearer.
    void bring_feet(int axis, int threads) {
        const ptrdiff_t stride[3] = {ptrdiff_t(n[1]) * n[2], ptrdiff_t(n[2]), 1};
        const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
#pragma omp parallel for num_threads(threads)
        for (int i = 0; i < n[u]; ++i)
            for (int way = 0; way < 2; ++way)
                for (int step = 1; step < n[axis]; ++step)
                    for (int j = 0; j < n[v]; ++j) {
                        int place[3];
                        place[u] = i, place[v] = j, place[axis] = way ? n[axis] - 1 - step : step;
                        const size_t k = node(place[0], place[1], place[2]);
                        take_foot(k, way ? k + stride[axis] : k - stride[axis], place);
                    }
    }

    void take_foot(size_t k, size_t from, const int (&place)[3]) {
        if (owner[from] < 0 || owner[from] == owner[k]) return;
        float square = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const float away = float(origin[axis] + spacing * place[axis]) - foot[3 * from + axis];
            square += away * away;
        }
        if (square >= values[k] * values[k]) return;
        values[k] = std::sqrt(square);
        owner[k] = owner[from];
        std::copy_n(&foot[3 * from], 3, &foot[3 * k]);
    }
};

} // namespace ringlet
