// Python's view of the methods of hair-hair contact.
#include "bindings.hpp"

#include "hair_capsules.hpp"
#include "hair_grid.hpp"

#include <cmath>

namespace ringlet {

static bool positive(double value) { return value > 0 && std::isfinite(value); }

static void make_grid(HairGrid *self, const RestShape &rest, double cell, double density, double pressure, double drag,
                      double limit, int hold) {
    require(positive(cell) && positive(density) && positive(limit),
            "HairGrid: cell, density and limit must be positive");
    require(pressure >= 0 && drag >= 0 && std::isfinite(pressure + drag),
            "HairGrid: pressure and drag must not be negative");
    require(hold >= 1, "HairGrid: hold must be 1 or more");
    new (self) HairGrid(rest, {cell, density, pressure, drag, limit, hold});
    if (self->cells() < HairGrid::kMostCells) return;
    self->~HairGrid();
    throw nb::value_error("HairGrid: cell is too small for the reach of these strands");
}

static void make_capsules(HairCapsules *self, const RestShape &rest, double radius, double stiffness, double friction,
                          double speed) {
    require(positive(radius) && positive(speed), "HairCapsules: radius and speed must be positive");
    require(stiffness >= 0 && friction >= 0 && std::isfinite(stiffness + friction),
            "HairCapsules: stiffness and friction must not be negative");
    new (self) HairCapsules(rest, {radius, stiffness, friction, speed});
}

void bind_neighbours(nb::module_ &m) {
    nb::class_<Neighbours>(m, "Neighbours");
    nb::class_<HairGrid, Neighbours>(m, "HairGrid")
        .def("__init__", &make_grid, nb::arg("rest"), nb::arg("cell"), nb::arg("density"), nb::arg("pressure"),
             nb::arg("drag"), nb::arg("limit"), nb::arg("hold") = 1);
    nb::class_<HairCapsules, Neighbours>(m, "HairCapsules")
        .def("__init__", &make_capsules, nb::arg("rest"), nb::arg("radius"), nb::arg("stiffness"), nb::arg("friction"),
             nb::arg("speed"));
}

} // namespace ringlet
