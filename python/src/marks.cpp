// Marks: embed, bake, extract, verify.
#include <fieldmark/watermark/embedding/baker.h>
#include <fieldmark/watermark/embedding/embed_views.h>
#include <fieldmark/watermark/embedding/embedder.h>
#include <fieldmark/watermark/embedding/recipe.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <optional>

#include "field_handle.h"
#include "reading.h"

namespace fieldmark::python {
namespace {

using namespace py::literals;
using watermark::Key;
using watermark::Owner;

constexpr Index kMostBits = 256, kLeastViews = 8, kMostViews = 10000;
constexpr double kLeastPsnr = 20, kMostPsnr = 60;  // dB
constexpr double kRate = 1e-6;

constexpr const char* kExtract =
    "Reads the message from images, without knowing it.\n\n"
    "Returns a dict like the result of `fieldmark extract --json`, see docs/json.md: message in hexadecimal\n"
    "digits, bits, payload, logits, read, fpr, detection, p_noise, bit_p_values, and the same of each image "
    "in\n"
    "views.\n"
    "p_noise bounds the probability that images without a mark of this key give bits as clear as these;\n"
    "bit_p_values bound it for each bit, and are not the probability that the bit is wrong. read is p_noise\n"
    "<= fpr.\n\n"
    ":param images: float32 arrays [height, width, 3] in [0, 1], sides of at least 16; one array is one "
    "image\n"
    ":param detection: blind, the extractor alone; informed, against the unmarked render; or auto, informed\n"
    "    for each image that agrees with the owner's field\n"
    ":param fpr: false-positive rate at which the message counts as read, in (0, 1]";
constexpr const char* kVerify =
    "Tests images for a message that was known before they were read.\n\n"
    "Returns a dict like the result of `fieldmark verify --json`, see docs/json.md, without what needs "
    "files\n"
    "or controls: found, fpr, p_value, p_value_two_sided, statistic, p_value_bits, p_value_bits_two_sided,\n"
    "matching_bits, contradicting_bits, bits, p_noise, payload, views, detection, public_key, per_view.\n"
    "p_value bounds the probability that a key drawn independently of the images reaches this statistic;\n"
    "found is p_value <= fpr. It is about the key: contradicting_bits above 0 speak for another message.\n"
    "p_noise as in extract().\n\n"
    ":param message: hexadecimal digits, most significant bit first\n"
    ":param images: float32 arrays [height, width, 3] in [0, 1], sides of at least 16; one array is one "
    "image\n"
    ":param detection: auto, blind or informed, as in extract()\n"
    ":param fpr: false-positive rate at which the mark counts as found, in (0, 1]";

void require(bool holds, const char* rule, const std::string& got) {
  if (!holds) throw ValueError("[embed] " + std::string(rule) + ", got " + got);
}

std::shared_ptr<Owner> embed(std::shared_ptr<nerf::RadianceField> field, const Key& key, Index bits,
                             double seconds, Index steps, std::optional<double> mark_psnr, Index views,
                             std::uint64_t seed, const py::object& progress) {
  require(bits >= 1 && bits <= kMostBits, "bits must be 1 to 256", std::to_string(bits));
  require(views >= kLeastViews && views <= kMostViews, "views must be 8 to 10000", std::to_string(views));
  if (mark_psnr)
    require(*mark_psnr >= kLeastPsnr && *mark_psnr <= kMostPsnr, "mark_psnr must be 20 to 60 dB",
            std::to_string(*mark_psnr));
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
  std::shared_ptr<Owner> owner;
  std::optional<watermark::Embedder> embedder;
  unlocked([&] {
    if (mark_psnr)
      recipe.owner.mark_psnr = *mark_psnr;
    else
      recipe.suit_mark_psnr(*field, cached);
    owner = std::make_shared<Owner>(recipe.make(*field, key, cached));
    embedder.emplace(*owner, cached, recipe.embed);
  });
  run(*embedder, progress);
  unlocked([&] { embedder->calibrate(); });
  return owner;
}

std::shared_ptr<nerf::RadianceField> bake(const Owner& owner, const std::string& message, double seconds,
                                          Index steps, std::uint64_t seed, const py::object& progress) {
  watermark::BakeOptions options{.seed = seed};
  options.schedule.seconds = seconds;
  options.schedule.steps = steps;
  const auto wanted = watermark::message_from_hex(message, owner.options().bits);
  std::optional<watermark::Baker> baker;
  unlocked([&] { baker.emplace(owner, wanted, options); });
  run(*baker, progress);
  return unlocked([&] {
    if (owner.mark().has_gain()) baker->scale_to(owner.options().mark_psnr);
    return std::make_shared<nerf::RadianceField>(baker->field());
  });
}

}  // namespace

void bind_marks(py::module_& module) {
  py::class_<Key>(module, "Key", "A secret key of 256 bits.")
      .def_static("random", &watermark::random_key, "256 bits from the operating system.")
      .def_static("load", &watermark::load_key, "path"_a, "Reads a KEY file.")
      .def(
          "save", [](const Key& key, const std::filesystem::path& path) { watermark::save_key(path, key); },
          "path"_a, "Writes a KEY file that only its owner can read.")
      .def(
          "__eq__", [](const Key& a, const Key& b) { return a == b; }, "other"_a, py::is_operator())
      .def("__repr__", [](const Key&) { return "<fieldmark key, secret>"; });
  py::class_<Owner, std::shared_ptr<Owner>>(
      module, "Owner",
      "An owner's secret: unmarked field, mark, extractor and, unless it is kept\n"
      "elsewhere, the key.")
      .def_static(
          "load",
          [](const std::filesystem::path& path) { return std::make_shared<Owner>(Owner::load(path)); },
          "path"_a, "Reads an OWNER file.")
      .def("save", &Owner::save, "path"_a, "Writes an OWNER file; keep it secret.")
      .def_property_readonly(
          "bits", [](const Owner& o) { return o.options().bits; }, "Length of the message.")
      .def_property_readonly(
          "mark_psnr",
          [](const Owner& o) {
            return o.mark().has_gain() ? std::optional(o.options().mark_psnr) : std::nullopt;
          },
          "PSNR of marked to unmarked renders in dB; None for a mark whose networks decide it.")
      .def_property_readonly(
          "key", [](const Owner& o) { return o.key; }, "The secret key; None if the file holds none.")
      .def(
          "with_key",
          [](const Owner& o, const Key& key) {
            auto other = std::make_shared<Owner>(o);
            other->set_code(key, o.options().bits);
            return other;
          },
          "key"_a, "Returns the same owner with another key.")
      .def_property_readonly(
          "key_free", &Owner::key_free,
          "True if the networks were trained under random codes and know no key; False for owners\n"
          "of version 0.1, whose bound of the p-values is not proven.")
      .def("extract", &extract, "images"_a, "detection"_a = "auto", "fpr"_a = kRate, kExtract)
      .def("verify", &verify, "message"_a, "images"_a, "detection"_a = "auto", "fpr"_a = kRate, kVerify);
  module.def("embed", &embed, py::arg("field").none(false), "key"_a, "bits"_a, "seconds"_a, "steps"_a,
             "mark_psnr"_a, "views"_a, "seed"_a, "progress"_a);
  module.def("bake", &bake, "owner"_a, "message"_a, "seconds"_a, "steps"_a, "seed"_a, "progress"_a);
}

}  // namespace fieldmark::python
