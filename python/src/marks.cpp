// Marks: embed, bake, extract, verify.
#include <fieldmark/core/digest.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/watermark/embedding/baker.h>
#include <fieldmark/watermark/embedding/embed_views.h>
#include <fieldmark/watermark/embedding/embedder.h>
#include <fieldmark/watermark/embedding/recipe.h>
#include <fieldmark/watermark/evidence/evidence.h>
#include <fieldmark/watermark/evidence/noise.h>
#include <fieldmark/watermark/reading/blind_reader.h>
#include <fieldmark/watermark/reading/informed_reader.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <optional>

#include "field_handle.h"

namespace fieldmark::python {
namespace {

using namespace py::literals;
using watermark::Key;
using watermark::Owner;

// Computes the evidence of the cells, summed over images.
std::vector<double> evidence_of(const Owner& owner, const std::vector<py::object>& images,
                                const std::string& detection) {
  if (detection != "auto" && detection != "blind")
    throw ValueError("[read] detection must be auto or blind, got '" + detection + "'");
  if (images.empty()) throw ValueError("[read] images must not be empty");
  std::vector<double> sum(at(owner.cells.count()));
  std::optional<watermark::BlindReader> blind;
  std::optional<watermark::InformedReader> informed;
  unlocked([&] {
    if (detection == "auto" && owner.mark().has_cells())
      informed.emplace(owner);
    else
      blind.emplace(owner);
  });
  for (const py::object& given : images) {
    const py::array array = borrowed<float>("read: images: each", given);
    const auto pixels = elements<float>(array);
    const auto outside = std::ranges::find_if(pixels, [](float v) { return v < 0 || v > 1; });
    if (outside != pixels.end())
      throw ValueError("[read] images: each must be in [0, 1] (divide 8-bit values by 255), got " +
                       std::to_string(*outside));
    Tensor<float> image(shape_of(array));
    std::ranges::copy(pixels, image.data.begin());
    const std::vector<double> one =
        unlocked([&] { return informed ? informed->read(image).evidence() : blind->evidence(image); });
    for (std::size_t c = 0; c < sum.size(); ++c) sum[c] += one[c];
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }
  return sum;
}

std::shared_ptr<Owner> embed(std::shared_ptr<nerf::RadianceField> field, const Key& key, Index bits,
                             double seconds, Index steps, std::optional<double> mark_psnr, Index views,
                             std::uint64_t seed, const py::object& progress) {
  watermark::EmbedRecipe recipe = watermark::embed_recipe("fast");
  recipe.suit(*field);
  recipe.owner.bits = bits;
  recipe.owner.seed = recipe.embed.seed = seed;
  recipe.embed.schedule.seconds = seconds;
  recipe.embed.schedule.steps = steps;
  recipe.views.count = views;
  const auto cached = unlocked([&] {
    return watermark::cache_embed_views(*field, recipe.owner.patch(), recipe.views, seed, check_signals);
  });
  if (mark_psnr)
    recipe.owner.mark_psnr = *mark_psnr;
  else
    recipe.suit_mark_psnr(*field, cached);
  auto owner = std::make_shared<Owner>(recipe.make(*field, key, cached));
  watermark::Embedder embedder(*owner, cached, recipe.embed);
  run(embedder, progress);
  unlocked([&] { embedder.calibrate(); });
  return owner;
}

std::shared_ptr<nerf::RadianceField> bake(const Owner& owner, const std::string& message, double seconds,
                                          Index steps, std::uint64_t seed, const py::object& progress) {
  watermark::BakeOptions options{.seed = seed};
  options.schedule.seconds = seconds;
  options.schedule.steps = steps;
  watermark::Baker baker(owner, watermark::message_from_hex(message, owner.options().bits), options);
  run(baker, progress);
  if (owner.mark().has_gain()) unlocked([&] { baker.scale_to(owner.options().mark_psnr); });
  return std::make_shared<nerf::RadianceField>(baker.field());
}

py::dict extract(const Owner& owner, const std::vector<py::object>& images, const std::string& detection) {
  const auto code = owner.code();
  const auto read = watermark::read_bits(evidence_of(owner, images, detection), code, owner.options().bits);
  return py::dict("message"_a = to_hex(read.message), "logits"_a = read.logit,
                  "p_values"_a = watermark::bit_p_values(read), "p_noise"_a = watermark::noise_p_value(read));
}

py::dict verify(const Owner& owner, const std::string& message, const std::vector<py::object>& images,
                const std::string& detection) {
  const auto wanted = watermark::message_from_hex(message, owner.options().bits);
  const auto score = watermark::score_evidence(evidence_of(owner, images, detection), owner.code(), wanted);
  return py::dict("p_value"_a = score.p_value, "statistic"_a = score.statistic,
                  "matching_bits"_a = score.match.matching, "bits"_a = score.match.bits);
}

}  // namespace

void bind_marks(py::module_& module) {
  py::class_<Key>(module, "Key")
      .def_static("random", &watermark::random_key, "256 bits from the operating system.")
      .def_static("load", &watermark::load_key, "path"_a, "Reads a KEY file.")
      .def(
          "save", [](const Key& key, const std::filesystem::path& path) { watermark::save_key(path, key); },
          "path"_a, "Writes a KEY file that only its owner can read.")
      .def(
          "__eq__", [](const Key& a, const Key& b) { return a == b; }, "other"_a, py::is_operator())
      .def("__repr__", [](const Key&) { return "<fieldmark key, secret>"; });
  py::class_<Owner, std::shared_ptr<Owner>>(module, "Owner")
      .def_static(
          "load",
          [](const std::filesystem::path& path) { return std::make_shared<Owner>(Owner::load(path)); },
          "path"_a, "Reads an OWNER file.")
      .def("save", &Owner::save, "path"_a, "Writes an OWNER file; keep it secret.")
      .def_property_readonly("bits", [](const Owner& o) { return o.options().bits; })
      .def_property_readonly("mark_psnr", [](const Owner& o) { return o.options().mark_psnr; })
      .def_property_readonly("key", [](const Owner& o) { return o.key; })
      .def("extract", &extract, "images"_a, "detection"_a = "auto",
           "Reads the message from float32 images [height, width, 3] in [0, 1]: a dict with the message in "
           "hexadecimal\n"
           "digits, logits and p_values of the bits, and p_noise, that images without a mark give such bits.")
      .def("verify", &verify, "message"_a, "images"_a, "detection"_a = "auto",
           "Tests images for a message: a dict with p_value, statistic, matching_bits and bits.");
  module.def("embed", &embed, "field"_a, "key"_a, "bits"_a, "seconds"_a, "steps"_a, "mark_psnr"_a, "views"_a,
             "seed"_a, "progress"_a);
  module.def("bake", &bake, "owner"_a, "message"_a, "seconds"_a, "steps"_a, "seed"_a, "progress"_a);
}

}  // namespace fieldmark::python
