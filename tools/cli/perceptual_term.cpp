#include "cli/perceptual_term.h"

#include <fieldmark/core/digest.h>
#include <fieldmark/core/error.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <ostream>

#include "cli/cli.h"
#include "cli/shared_data.h"

namespace fieldmark::cli {
namespace {

// The first layers of other networks, such as SqueezeNet, have the names and shapes of VGG-16's.
void check_network(const SafetensorsFile& file) {
  const std::vector<WeightTensor> known = vgg16_tensors();
  for (const auto& tensor : file.tensors)
    if (tensor.name.starts_with("features.") &&
        std::ranges::find(known, tensor.name, &WeightTensor::name) == known.end())
      throw IoError(file.path + ": tensor " + tensor.name +
                    " is not of VGG-16; --vgg-weights wants its weights");
}

}  // namespace

watermark::PerceptualTerm load_perceptual_term(double weight, const std::string& file, Context& context) {
  std::filesystem::path path = file;
  if (file.empty()) path = shared_data("weights/vgg16_conv1_1-conv2_2.safetensors");
  if (path.empty())
    throw UsageError(
        "--perceptual: needs weights of VGG-16; name them with --vgg-weights, or set "
        "FIELDMARK_DATA to a folder with weights/vgg16_conv1_1-conv2_2.safetensors");
  const SafetensorsFile weights = SafetensorsFile::read(path);
  check_network(weights);
  const auto features = std::make_shared<const Vgg16Features<float>>(weights);
  context.text() << "perceptual term: VGG-16 down to " << features->depths().back() << ", lambda " << weight
                 << "\n";
  return {.weight = weight, .features = features, .sha256 = sha256_file_hex(path)};
}

}  // namespace fieldmark::cli
