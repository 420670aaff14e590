#pragma once
#include <string>
#include <vector>

namespace fieldmark::watermark {

/// @{
/// Returns the names of the attacks that `bench attacks` measures: each list is a curve from mild to strong.
/// The image attacks are names of parse_distortion(), the others of parse_field_attack();
/// average_attack_curve() needs a second baked field and copy_attack_curve() a field of another scene.
const std::vector<std::vector<std::string>>& image_attack_curves();
const std::vector<std::vector<std::string>>& field_attack_curves();
const std::vector<std::string>& average_attack_curve();
const std::vector<std::string>& copy_attack_curve();
/// @}

}  // namespace fieldmark::watermark
