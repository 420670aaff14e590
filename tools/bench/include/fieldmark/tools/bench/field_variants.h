#pragma once
#include <fieldmark/nerf/renderer.h>

#include <string>
#include <vector>

namespace fieldmark::bench {

/// One way of rendering a field: its difference from the default, and the settings themselves.
struct FieldVariant {
  std::string knob;              ///< the option swept: "samples", "stop", ...; "default" for the default
  std::string setting;           ///< its value, for display
  nerf::RenderOptions render{};  ///< options for the Renderer
  Index occupancy = 0;           ///< cells per axis of the grid, see occupancy_at(); 0: the field's own grid
  bool skip_empty = true;        ///< false: every cell counts as occupied
};

/// Returns the settings to compare for a field: the default first, then each knob alone, then combinations.
std::vector<FieldVariant> field_variants(const nerf::RadianceField& field, bool quick = false);

/// Resamples the field's grid to another resolution. Coarser: a cell is occupied if any cell within it is.
/// Finer: a cell is occupied if the cell around it is and the density at one of 3^3 evenly spread points in
/// it passes the threshold of training, an optical depth of 0.01 per sample.
/// @throws ValueError if OccupancyGrid rejects the resolution, or it is neither a divisor nor a multiple
nerf::OccupancyGrid occupancy_at(const nerf::RadianceField& field, Index resolution);

/// Returns the field with a variant's grid.
nerf::RadianceField with_variant(const nerf::RadianceField& field, const FieldVariant& variant);

}  // namespace fieldmark::bench
