#pragma once
#include <fieldmark/watermark/embedding/embed_views.h>
#include <fieldmark/watermark/mark/owner.h>

#include "nerf/small_field.h"
#include "watermark/test_key.h"

inline fieldmark::watermark::OwnerOptions small_owner_options() {
  return {.bits = 3,
          .mark_psnr = 30,
          .cells = 4,
          .reader_size = 32,
          .mark = {.bands = 2, .features = 4},
          .base_channels = 8,
          .seed = 9};
}

/// An owner of a field of random matter that nobody trained: cheap where only the owner's workings matter.
inline fieldmark::watermark::Owner small_owner(
    const fieldmark::watermark::OwnerOptions& options = small_owner_options()) {
  using namespace fieldmark::watermark;
  std::vector<double> area(64);
  for (std::size_t i = 0; i < area.size(); ++i) area[i] = i % 5 == 0 ? 0.0 : static_cast<double>(1 + i);
  Owner owner(small_field(), options, test_key(1), CellGrid(4, area));
  owner.gain = 0.05;
  return owner;
}

/// The same under preset paper, with small networks.
inline fieldmark::watermark::Owner small_paper_owner() {
  using namespace fieldmark::watermark;
  OwnerOptions o = small_owner_options();
  o.preset = Preset::paper;
  o.width = 8;
  o.channels = 4;
  return {small_field(), o, test_key(1), message_slots(o.bits)};
}
