#pragma once
#include <fieldmark/watermark/embedding/embed_views.h>
#include <fieldmark/watermark/mark/cell_mark.h>
#include <fieldmark/watermark/mark/fusion_mark.h>
#include <fieldmark/watermark/mark/owner.h>

#include "nerf/small_field.h"
#include "watermark/test_key.h"

inline fieldmark::watermark::OwnerOptions small_owner_options() {
  return {.bits = 3, .mark_psnr = 30, .reader_size = 32, .seed = 9};
}
inline fieldmark::watermark::CellMarkOptions small_cell_mark() {
  return {.network = {.bands = 2, .features = 4}, .base_channels = 8};
}
inline const fieldmark::watermark::CellMark& cell_mark_of(const fieldmark::watermark::Owner& owner) {
  return dynamic_cast<const fieldmark::watermark::CellMark&>(owner.mark());
}
inline const fieldmark::watermark::FusionMark& fusion_mark_of(const fieldmark::watermark::Owner& owner) {
  return dynamic_cast<const fieldmark::watermark::FusionMark&>(owner.mark());
}

/// Returns an owner of an untrained random field, which is cheap if only the owner's workings matter.
inline fieldmark::watermark::Owner small_owner(
    const fieldmark::watermark::OwnerOptions& options = small_owner_options(),
    const fieldmark::watermark::CellMarkOptions& mark = small_cell_mark()) {
  using namespace fieldmark::watermark;
  std::vector<double> area(64);
  for (std::size_t i = 0; i < area.size(); ++i) area[i] = i % 5 == 0 ? 0.0 : static_cast<double>(1 + i);
  Owner owner(small_field(), options, test_key(1), CellGrid(4, area), cell_mark(mark));
  owner.gain = 0.05;
  return owner;
}

/// Returns the same owner under preset paper, with small networks.
inline fieldmark::watermark::Owner small_paper_owner() {
  using namespace fieldmark::watermark;
  const OwnerOptions o = small_owner_options();
  return {small_field(), o, test_key(1), message_slots(o.bits), fusion_mark({.width = 8, .channels = 4})};
}
