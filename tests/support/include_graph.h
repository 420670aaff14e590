#pragma once
#include <fieldmark/core/files.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "support/source_dir.h"

/// The project's files and what they include, as far as includes name files of the project.
class IncludeGraph {
 public:
  IncludeGraph() {
    namespace fs = std::filesystem;
    for (const char* top :
         {"core", "engine", "imaging", "nerf", "distort", "extractor", "watermark", "baselines", "tools"})
      for (const auto& entry : fs::recursive_directory_iterator(fs::path(source_dir()) / top)) {
        const std::string file = fs::relative(entry.path(), source_dir()).generic_string();
        if (!file.ends_with(".h") && !file.ends_with(".cpp")) continue;
        files_.insert(file);
        const std::size_t include = file.find("/include/");
        if (include != std::string::npos) named_[file.substr(include + 9)] = file;
        if (file.starts_with("tools/cli/")) named_[file.substr(6)] = file;
        by_stem_[room(file) + ":" + fs::path(file).stem().string()].push_back(file);
      }
  }

  /// Returns the room of a file: "watermark/mark" for watermark/mark/src/owner.cpp.
  static std::string room(const std::string& file) {
    const std::size_t inside = std::min(file.find("/src/"), file.find("/include/"));
    return file.substr(0, inside == std::string::npos ? file.rfind('/') : inside);
  }

  /// Returns the rooms that `file` reaches by includes, where a header brings the source that defines it,
  /// each with the files that lead there.
  std::map<std::string, std::string> reached(const std::string& file) const {
    std::map<std::string, std::string> rooms, way{{file, file}};
    std::vector<std::string> next{file};
    while (!next.empty()) {
      const std::string at = next.back();
      next.pop_back();
      rooms.emplace(room(at), way[at]);
      for (const std::string& other : brings(at))
        if (way.emplace(other, way[at] + " > " + other).second) next.push_back(other);
    }
    return rooms;
  }

 private:
  std::vector<std::string> brings(const std::string& file) const {
    static const std::regex include("#include [<\"]([^>\"]+)[>\"]");
    const std::string text = fieldmark::read_text(std::filesystem::path(source_dir()) / file);
    std::vector<std::string> found;
    if (file.ends_with(".h"))
      found = by_stem_.at(room(file) + ":" + std::filesystem::path(file).stem().string());
    for (std::sregex_iterator at(text.begin(), text.end(), include), end; at != end; ++at) {
      const std::string name = (*at)[1];
      const auto beside = (std::filesystem::path(file).parent_path() / name).generic_string();
      if (const auto known = named_.find(name); known != named_.end())
        found.push_back(known->second);
      else if (files_.contains(beside))
        found.push_back(beside);
      else if (const auto own = by_stem_.find(room(file) + ":" + std::filesystem::path(name).stem().string());
               own != by_stem_.end() && name.find('/') == std::string::npos && name.ends_with(".h"))
        found.insert(found.end(), own->second.begin(), own->second.end());
    }
    return found;
  }

  std::set<std::string> files_;
  std::map<std::string, std::string> named_;                 ///< by its name in an include
  std::map<std::string, std::vector<std::string>> by_stem_;  ///< by "room:stem"
};
