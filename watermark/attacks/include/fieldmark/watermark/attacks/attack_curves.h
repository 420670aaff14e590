#pragma once
#include <string>
#include <vector>

namespace fieldmark::watermark {

/// @{
/// The attacks that `bench attacks` measures, by name: each list a curve from mild to strong. Those on images
/// are names of parse_distortion(), the others of parse_field_attack(); average_attack_curve() needs a second
/// baked field and copy_attack_curve() another scene's.
const std::vector<std::vector<std::string>>& image_attack_curves();
const std::vector<std::vector<std::string>>& field_attack_curves();
const std::vector<std::string>& average_attack_curve();
const std::vector<std::string>& copy_attack_curve();
/// @}

}  // namespace fieldmark::watermark
