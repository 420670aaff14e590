#include "cli/perceptual_term.h"

#include <fieldmark/core/digest.h>

#include <filesystem>
#include <span>
#include <sstream>

#include "support/catch.h"
#include "support/random_weights.h"
#include "support/temporary_folder.h"
#include "tools/environment.h"

using namespace fieldmark;
using cli::Context;

TEST_CASE("The perceptual term takes its weights from the option, else from below FIELDMARK_DATA",
          "[perceptual]") {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "weights");
  const std::string path = folder / "weights/vgg16_conv1_1-conv2_2.safetensors";
  const auto tensors = vgg16_tensors();
  random_weights(std::span(tensors).first(8)).write(path);
  std::ostringstream out, err;
  Context context({}, {"fieldmark", "x"}, out, err);
  {
    const EnvironmentVariable data("FIELDMARK_DATA", nullptr);
    CHECK_THROWS_WITH(cli::load_perceptual_term(0.01, "", context),
                      Contains("--perceptual: needs weights of VGG-16; name them with --vgg-weights"));
    CHECK(cli::load_perceptual_term(0.01, path, context).features->depths().back() == "relu2_2");
  }
  const EnvironmentVariable data("FIELDMARK_DATA", folder.path.c_str());
  const auto term = cli::load_perceptual_term(0.25, "", context);
  CHECK(term.weight == 0.25);
  CHECK(term.sha256 == sha256_file_hex(path));
  const std::string other = folder / "other.safetensors";
  random_weights(lpips_tensors(LpipsNetwork::alex)).write(other);
  CHECK_THROWS_WITH(cli::load_perceptual_term(0.01, other, context),
                    Contains(other) && Contains("tensor features.3.weight is not of VGG-16"));
  random_weights(lpips_tensors(LpipsNetwork::squeeze)).write(other);
  CHECK_THROWS_WITH(cli::load_perceptual_term(0.01, other, context),
                    Contains(other) && Contains("tensor features.3.squeeze.weight is not of VGG-16"));
}
