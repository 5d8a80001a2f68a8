// Python's view of the methods of hair-hair contact.
#include "bindings.hpp"

#include "hair_grid.hpp"

#include <algorithm>
#include <cmath>

namespace ringlet {

static bool positive(double value) { return value > 0 && std::isfinite(value); }

static void make_grid(HairGrid *self, const RestShape &rest, double cell, double density, double pressure, double drag,
                      double limit) {
    require(positive(cell) && positive(density) && positive(limit),
            "HairGrid: cell, density and limit must be positive");
    require(pressure >= 0 && drag >= 0 && std::isfinite(pressure + drag),
            "HairGrid: pressure and drag must not be negative");
    new (self) HairGrid(rest, {cell, density, std::max(pressure, 1e-30), drag, limit});
    if (self->cells() < HairGrid::kMostCells) return;
    self->~HairGrid();
    throw nb::value_error("HairGrid: cell is too small for the reach of these strands");
}

void bind_neighbours(nb::module_ &m) {
    nb::class_<Neighbours>(m, "Neighbours");
    nb::class_<HairGrid, Neighbours>(m, "HairGrid")
        .def("__init__", &make_grid, nb::arg("rest"), nb::arg("cell"), nb::arg("density"), nb::arg("pressure"),
             nb::arg("drag"), nb::arg("limit"));
}

} // namespace ringlet
