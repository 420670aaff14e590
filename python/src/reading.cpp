// Reading marks: what images say about a message.
#include "reading.h"

#include <fieldmark/core/number_text.h>
#include <fieldmark/watermark/evidence/noise.h>
#include <fieldmark/watermark/keys/signing.h>
#include <fieldmark/watermark/payload/payload_codec.h>
#include <fieldmark/watermark/scanning/page_reader.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include "field_handle.h"

namespace fieldmark::python {
namespace {

using namespace py::literals;
using watermark::Owner;
using watermark::ReadingKind;

constexpr Index kLeastSide = 16;  // of images, pixels
constexpr Index kMostPayloadBits = 256;

// The evidence of one image.
struct ImageEvidence {
  std::vector<double> cells;
  ReadingKind kind = ReadingKind::blind;
  std::optional<double> agreement{};  // with the owner's field, if they were aligned
};

// Options of a reading and its images, checked before any work.
struct Suspects {
  std::string detection;
  double fpr;
  std::vector<py::array> images;
};

void check_image(const std::string& where, const py::array& image) {
  const Shape shape = shape_of(image);
  if (shape.rank() != 3 || shape[2] != 3 || shape[0] < kLeastSide || shape[1] < kLeastSide)
    throw ShapeError("[" + where + "] must be [height, width, 3] with sides of at least " +
                     std::to_string(kLeastSide) + " pixels, got shape " + shape.str());
  const auto pixels = elements<float>(image);
  const auto outside = std::ranges::find_if(pixels, [](float v) { return !(v >= 0 && v <= 1); });
  if (outside != pixels.end())
    throw ValueError("[" + where + "] must be in [0, 1] (divide 8-bit values by 255), got " +
                     std::to_string(*outside));
}

std::vector<py::array> checked_images(const std::string& function, const py::object& given) {
  py::list all;
  if (py::isinstance<py::array>(given) && py::reinterpret_borrow<py::array>(given).ndim() == 3)
    all.append(given);  // one image
  else if (PyObject_HasAttrString(given.ptr(), "__iter__") != 0 && !py::isinstance<py::str>(given))
    all = py::list(given);
  else
    throw py::type_error("[" + function + "] images must be a list of arrays [height, width, 3], got " +
                         type_name(given));
  if (all.empty()) throw ValueError("[" + function + "] images must not be empty");
  std::vector<py::array> images;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::string where = function + ": images[" + std::to_string(i) + "]";
    images.push_back(borrowed<float>(where, all[i]));
    check_image(where, images.back());
  }
  return images;
}

Suspects checked(const std::string& function, const Owner& owner, const py::object& images,
                 const std::string& detection, double fpr) {
  if (detection != "auto" && detection != "blind" && detection != "informed")
    throw ValueError("[" + function + "] detection must be auto, blind or informed, got '" + detection + "'");
  if (detection == "informed" && !owner.mark().has_cells())
    throw ValueError("[" + function + "] detection must be blind for an owner of preset " +
                     owner.mark().preset() + ", which has no cells in space, got 'informed'");
  if (!(fpr > 0 && fpr <= 1))
    throw ValueError("[" + function + "] fpr must be in (0, 1], got " + number_text(fpr));
  return {detection, fpr, checked_images(function, images)};
}

ImageEvidence evidence_of(watermark::PageReader& reader, const Tensor<float>& image, bool forced) {
  watermark::PageReading r = reader.read(image, forced);
  if (forced) r.force_informed();
  return {r.evidence(), r.chosen(), r.agreement()};
}

std::vector<ImageEvidence> read(const Owner& owner, const Suspects& suspects) {
  const watermark::BlindReader blind(owner);
  std::unique_ptr<watermark::PageReader> informed;
  if (suspects.detection != "blind" && owner.mark().has_cells())
    informed = unlocked([&] { return std::make_unique<watermark::PageReader>(owner); });
  std::vector<ImageEvidence> all;
  for (const py::array& given : suspects.images) {
    Tensor<float> image(shape_of(given));
    std::ranges::copy(elements<float>(given), image.data.begin());
    all.push_back(unlocked([&]() -> ImageEvidence {
      if (!informed) return {.cells = blind.evidence(image)};
      return evidence_of(*informed, image, suspects.detection == "informed");
    }));
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }
  return all;
}

std::vector<double> total(const std::vector<ImageEvidence>& images) {
  std::vector<double> sum(images.front().cells.size());
  for (const ImageEvidence& image : images)
    for (std::size_t c = 0; c < sum.size(); ++c) sum[c] += image.cells[c];
  return sum;
}

std::string detection_used(const std::vector<ImageEvidence>& images) {
  const ReadingKind first = images.front().kind;
  const auto same = [first](const ImageEvidence& image) { return image.kind == first; };
  return std::ranges::all_of(images, same) ? watermark::reading_name(first) : "mixed";
}

py::object payload_of(const watermark::BitReading& reading) {
  if (std::ssize(reading.sum) > kMostPayloadBits) return py::none();
  const auto read = watermark::PayloadCodec(std::ssize(reading.sum)).read(reading.sum);
  if (!read) return py::none();
  return py::dict("kind"_a = watermark::payload_kind_name(read->payload.kind),
                  "value"_a = read->payload.value, "corrected"_a = read->corrected,
                  "chance"_a = read->chance);
}

py::object payload_of(const watermark::Message& message) {
  if (message.size() > kMostPayloadBits) return py::none();
  const auto payload = watermark::PayloadCodec(message.size()).payload(message);
  if (!payload) return py::none();
  return py::dict("kind"_a = watermark::payload_kind_name(payload->kind), "value"_a = payload->value);
}

// Adds the fields of a reading to a result.
void add_reading(py::dict& result, const watermark::BitReading& reading) {
  result["bits"] = to_bits(reading.message);
  result["payload"] = payload_of(reading);
  result["p_noise"] = watermark::noise_p_value(reading);
  result["bit_p_values"] = watermark::bit_p_values(reading);
  result["logits"] = reading.logit;
}

// Adds the fields of a test to a result.
void add_score(py::dict& result, const watermark::EvidenceScore& score) {
  result["p_value"] = score.p_value;
  result["p_value_two_sided"] = score.p_value_two_sided;
  result["statistic"] = score.statistic;
  result["p_value_bits"] = score.p_value_bits;
  result["p_value_bits_two_sided"] = score.p_value_bits_two_sided;
  result["matching_bits"] = score.match.matching;
}

py::dict of_image(const ImageEvidence& image) {
  return py::dict("detection"_a = watermark::reading_name(image.kind), "agreement"_a = image.agreement);
}

}  // namespace

py::dict extract(const Owner& owner, const py::object& images, const std::string& detection, double fpr) {
  const Suspects suspects = checked("extract", owner, images, detection, fpr);
  const auto code = owner.code();
  const Index bits = owner.options().bits;
  const auto evidence = read(owner, suspects);
  const auto reading = watermark::read_bits(total(evidence), code, bits);
  py::list views;
  for (const ImageEvidence& image : evidence) {
    py::dict view = of_image(image);
    add_reading(view, watermark::read_bits(image.cells, code, bits));
    views.append(view);
  }
  py::dict result("read"_a = watermark::noise_p_value(reading) <= fpr, "fpr"_a = fpr,
                  "message"_a = to_hex(reading.message), "detection"_a = detection_used(evidence));
  add_reading(result, reading);
  result["views"] = views;
  return result;
}

py::dict verify(const Owner& owner, const std::string& message, const py::object& images,
                const std::string& detection, double fpr) {
  const auto wanted = watermark::message_from_hex(message, owner.options().bits);
  const Suspects suspects = checked("verify", owner, images, detection, fpr);
  const auto code = owner.code();
  const auto evidence = read(owner, suspects);
  const auto score = watermark::score_evidence(total(evidence), code, wanted);
  py::list views;
  for (const ImageEvidence& image : evidence) {
    const auto one = watermark::score_evidence(image.cells, code, wanted);
    py::dict view = of_image(image);
    add_score(view, one);
    view["bits"] = to_bits(one.reading.message);
    view["logits"] = one.reading.logit;
    view["bit_p_values"] = watermark::bit_p_values(one.reading);
    views.append(view);
  }
  py::dict result("found"_a = score.p_value <= fpr, "fpr"_a = fpr);
  add_score(result, score);
  result["contradicting_bits"] = watermark::contradicting_bits(score.reading, wanted);
  result["bits"] = score.match.bits;
  result["p_noise"] = watermark::noise_p_value(score.reading);
  result["payload"] = payload_of(wanted);
  result["views"] = evidence.size();
  result["detection"] = detection_used(evidence);
  result["public_key"] = to_hex(watermark::public_key(owner.own_key()));
  result["per_view"] = views;
  return result;
}

}  // namespace fieldmark::python
