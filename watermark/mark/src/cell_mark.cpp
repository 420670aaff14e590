#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/ops/softmax.h>
#include <fieldmark/extractor/evidence_pool.h>
#include <fieldmark/watermark/mark/cell_mark.h>
#include <fieldmark/watermark/mark/owner.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "in_blocks.h"
#include "optional_term.h"

namespace fieldmark::watermark {
namespace {

using Json = nlohmann::json;

// Finds the likeliest class of each place and its softmax.
void likeliest(const float* logits, Index classes, SeenPlaces& places) {
  for (Index p = 0; p < places.height * places.width; ++p) {
    const float* row = logits + p * classes;
    const float* most = std::max_element(row, row + classes);
    double total = 0;
    for (Index c = 0; c < classes; ++c) total += std::exp(static_cast<double>(row[c] - *most));
    const Index cell = most - row;
    places.cell.push_back(cell + 1 < classes ? static_cast<std::int32_t>(cell) : -1);
    places.share.push_back(static_cast<float>(1 / total));
  }
}

}  // namespace

double residual_rms(const CellTrainingOptions& o, double mark_psnr, Index step) {
  const double db =
      mark_psnr - (mark_psnr - o.first_mark_psnr) * std::exp(-static_cast<double>(step) / o.anneal);
  return std::pow(10.0, -db / 20);
}

CellMark::CellMark(const MarkSite& site, const CellMarkOptions& options)
    : options_(options),
      network_(site.params, "mark", options.network, site.seed + 100),
      reader_(site.params, "extractor", {.classes = site.cells.count() + 1, .base = options.base_channels},
              site.seed + 200) {}

std::string CellMark::configuration() const {
  const MarkNetworkOptions& n = options_.network;
  return Json{{"preset", preset()},
              {"bands", n.bands},
              {"features", n.features},
              {"tilt", n.tilt},
              {"shading", n.shading},
              {"red_green", n.red_green},
              {"luminance", n.luminance},
              {"base_channels", options_.base_channels},
              // Keys of version 0.1 for the other kind of mark.
              {"width", 256},
              {"message_features", 0},
              {"fusion", Json::array()},
              {"channels", 64}}
      .dump();
}

CellMarkOptions stored_cell_mark(const std::string& configuration) {
  const Json j = Json::parse(configuration);
  return {.network = {.bands = j.at("bands"),
                      .features = j.at("features"),
                      .tilt = j.value("tilt", 0.0),
                      .shading = j.value("shading", 0.0),
                      .red_green = j.at("red_green"),
                      .luminance = j.at("luminance")},
          .base_channels = j.at("base_channels")};
}

MarkMaker cell_mark(const CellMarkOptions& options) {
  return [options](const MarkSite& site) { return std::make_shared<CellMark>(site, options); };
}

Var<float> CellMark::carrier(const Params<float>& params, Var<float> x, Var<float> c) const {
  return network_.carrier(params, x, c);
}

nerf::Renderer::Recolour CellMark::recolour(const Owner& owner, std::vector<std::int8_t> signs) const {
  return in_blocks([this, &owner, signs = std::move(signs)](Tape<float>& tape, const float* x, const float*,
                                                            Index n, float* rgb) {
    std::vector<float> s(static_cast<std::size_t>(n));
    owner.cells.blend(signs, x, n, s.data());
    const Var<float> carrier = network_.carrier(Params<float>(owner.params, nullptr),
                                                tape.constant(x, {n, 3}), tape.constant(rgb, {n, 3}));
    for (Index i = 0; i < 3 * n; ++i)
      rgb[i] = std::clamp(
          rgb[i] + static_cast<float>(owner.gain) * s[static_cast<std::size_t>(i / 3)] * carrier.value()[i],
          0.f, 1.f);
  });
}

std::vector<double> CellMark::evidence(const Owner& owner, const Tensor<float>& image,
                                       SeenPlaces* places) const {
  Tape<float> tape;
  const auto out = reader_(Params<float>(owner.params, nullptr),
                           tape.constant(image.data.data(), {1, image.shape[0], image.shape[1], 3}));
  const Index cells = owner.cells.count();
  std::vector<double> evidence(static_cast<std::size_t>(cells));
  extractor::cell_evidence(out.sign.value(), out.index.value(), out.height * out.width, cells,
                           evidence.data());
  if (places) {
    *places = {.window = places->window, .height = out.height, .width = out.width};
    likeliest(out.index.value(), cells + 1, *places);
  }
  return evidence;
}

std::function<Var<float>(Var<float>)> CellMark::confirmation(const Owner& owner,
                                                             const Tensor<float>& image) const {
  const Params<float> params(owner.params, nullptr);
  const Shape shape{1, image.shape[0], image.shape[1], 3};
  Tape<float> tape;
  const auto out = reader_(params, tape.constant(image.data.data(), shape));
  const Index classes = out.index.shape()[1], places = out.index.shape()[0];
  std::vector<float> positive, foreground;
  std::vector<std::int32_t> cell;
  for (Index p = 0; p < places; ++p) {
    const float* q = out.index.value() + p * classes;
    positive.push_back(out.sign.value()[p] > 0 ? 1.f : 0.f);
    cell.push_back(static_cast<std::int32_t>(std::max_element(q, q + classes) - q));
    foreground.push_back(cell.back() + 1 < classes ? 1.f : 0.f);
  }
  return [this, params, shape, positive = std::move(positive), foreground = std::move(foreground),
          cell = std::move(cell)](Var<float> other) {
    const auto seen = reader_(params, other.tape().reshape(other, shape));
    return term_or_zero(other, foreground, [&] {
      return add(bce_with_logits<float>(seen.sign, positive, foreground),
                 softmax_cross_entropy<float>(seen.index, cell, foreground));
    });
  };
}

}  // namespace fieldmark::watermark
