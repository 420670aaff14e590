#pragma once
#include <fieldmark/nerf/renderer.h>

#include <string>
#include <vector>

namespace fieldmark::bench {

/// One way of rendering a field: what differs from the default, and the settings themselves.
struct FieldVariant {
  std::string knob;              ///< what is swept: "samples", "stop", ...; "default" for the default itself
  std::string setting;           ///< its value, for people
  nerf::RenderOptions render{};  ///< as the Renderer takes them
  Index occupancy = 0;           ///< cells per axis of the grid, see occupancy_at(); 0: the field's own grid
  bool skip_empty = true;        ///< false: every cell counts as occupied
};

/// The settings to be compared for a field: the default first, then each knob on its own, then some together.
std::vector<FieldVariant> field_variants(const nerf::RadianceField& field, bool quick = false);

/// The field's grid at another resolution. Coarser: a cell is occupied where one of those in it is. Finer: a
/// cell is occupied where the one around it is and the density at one of 4^3 places spread evenly in it
/// passes the threshold of training, an optical depth of 0.01 a sample.
/// @throws ValueError if resolution is not one that OccupancyGrid takes, or neither a divisor nor a multiple
nerf::OccupancyGrid occupancy_at(const nerf::RadianceField& field, Index resolution);

/// The same field with a variant's grid.
nerf::RadianceField with_variant(const nerf::RadianceField& field, const FieldVariant& variant);

}  // namespace fieldmark::bench
