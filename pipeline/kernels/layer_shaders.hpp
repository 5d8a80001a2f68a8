// What a strand's point shows besides light: how far away it is, and where its strand goes.
#pragma once

#include "strand_point.hpp"

#include <algorithm>
#include <cmath>

namespace ringlet {

/// (1, 1, distance along the line of sight [m]): drawn, the first two are coverage, the third coverage times distance.
struct DistanceShader : PointShader {
    double eye[3], ahead[3];

    void shade(const StrandPoint *points, size_t count, int, float *radiance) const override {
        for (size_t i = 0; i < count; ++i) {
            const float *x = points[i].root + 3 * points[i].j;
            double distance = 0;
            for (int k = 0; k < 3; ++k) distance += (x[k] - eye[k]) * ahead[k];
            radiance[3 * i] = radiance[3 * i + 1] = 1;
            radiance[3 * i + 2] = float(distance);
        }
    }
};

/// The unit direction from root to tip.
struct TangentShader : PointShader {
    void shade(const StrandPoint *points, size_t count, int P, float *radiance) const override {
        for (size_t i = 0; i < count; ++i) {
            const int before = std::max(points[i].j - 1, 0), after = std::min(points[i].j + 1, P - 1);
            float way[3], square = 1e-30f;
            for (int k = 0; k < 3; ++k) {
                way[k] = points[i].root[3 * after + k] - points[i].root[3 * before + k];
                square += way[k] * way[k];
            }
            for (int k = 0; k < 3; ++k) radiance[3 * i + k] = way[k] / std::sqrt(square);
        }
    }
};

} // namespace ringlet
