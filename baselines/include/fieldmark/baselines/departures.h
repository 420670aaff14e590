#pragma once
#include <string>
#include <vector>

namespace fieldmark::baselines {

/// One choice of CopyRNeRF's training or networks: as published, and as the presets have it.
struct Departure {
  std::string part;          ///< what is chosen
  std::string paper;         ///< in the paper; "-": not given
  std::string code;          ///< in the authors' code; "-": as the paper
  std::string preset_paper;  ///< in preset paper
  std::string preset_code;   ///< in preset code
};

/// Where the presets paper and code stand beside Luo et al. 2023 and their released code. What is an option
/// of a preset comes from embed_recipe(), so it is what `embed` does.
std::vector<Departure> departures();

}  // namespace fieldmark::baselines
