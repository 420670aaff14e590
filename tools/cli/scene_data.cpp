#include "cli/scene_data.h"

#include <ostream>

namespace fieldmark::cli {

nerf::Dataset load_scene(const std::string& folder, const nerf::DatasetOptions& options, Context& context) {
  nerf::Dataset data = nerf::load_dataset(folder, options);
  for (const auto& note : data.notes) context.note(note);
  return data;
}

Json warning_of(const nerf::Oddity& oddity) {
  Json json{{"kind", oddity.kind},
            {"count", oddity.count},
            {"text", oddity.text},
            {"remedy", oddity.remedy},
            {"images", oddity.images}};
  if (!oddity.partners.empty()) json["partners"] = oddity.partners;
  return json;
}

void warn_of(const std::vector<nerf::Oddity>& oddities, Json& warnings, Context& context) {
  for (const nerf::Oddity& o : oddities) {
    context.text() << "warning: " << o.text << "; fieldmark data check tells more\n";
    warnings.push_back(warning_of(o));
  }
}

}  // namespace fieldmark::cli
