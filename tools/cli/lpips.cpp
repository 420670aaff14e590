#include "cli/lpips.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <ostream>

#include "cli/shared_data.h"

namespace fieldmark::cli {

void add_lpips_weights(CommandLine& app, std::string& file) {
  app.add_option("--lpips-weights", file,
                 "AlexNet weights of LPIPS, or none to skip LPIPS;\n"
                 "default: $FIELDMARK_DATA/weights/lpips_alex_v0.1.safetensors")
      ->type_name("FILE")
      ->default_str("");
}

std::optional<Lpips<float>> load_lpips(LpipsNetwork network, const std::string& file, Context& context) {
  if (file == "none") return std::nullopt;
  const std::string name = network == LpipsNetwork::alex ? "alex" : "squeeze";
  std::filesystem::path path = file;
  if (file.empty()) {
    path = shared_data("weights/lpips_" + name + "_v0.1.safetensors");
    if (path.empty()) {
      context.text() << "no LPIPS (" << name << "): no weights given, none in $FIELDMARK_DATA/weights\n";
      return std::nullopt;
    }
  }
  return Lpips<float>(SafetensorsFile::read(path), network);
}

double lpips_or_nan(const std::optional<Lpips<float>>& lpips, const Tensor<float>& a,
                    const Tensor<float>& b) {
  if (!lpips || std::min(a.shape[0], a.shape[1]) < lpips->smallest()) return std::nan("");
  return lpips->distance(a, b).value;
}

}  // namespace fieldmark::cli
