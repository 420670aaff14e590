#include <fieldmark/core/digest.h>
#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/tools/results/rows.h>

#include <algorithm>
#include <chrono>
#include <cstdio>

namespace fieldmark::results {
namespace fs = std::filesystem;

Rows load_rows(const fs::path& folder) {
  Rows rows;
  if (!fs::is_directory(folder)) return rows;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".json") continue;
    const std::string id = entry.path().lexically_relative(folder).replace_extension().generic_string();
    try {
      Json row = Json::parse(read_text(entry.path()));
      for (const char* key :
           {"schema", "kind", "command", "commit", "date", "seconds", "inputs", "code", "result"})
        row.at(key);
      if (row.at("id") != id) throw IoError(entry.path().string() + ": expected the row of this name");
      rows[id] = std::move(row);
    } catch (const Json::exception& e) {
      throw IoError(entry.path().string() + ": expected a row of `fieldmark results`, found " + e.what());
    }
  }
  return rows;
}

void save_row(const fs::path& folder, const Json& row) {
  const fs::path path = folder / (row.at("id").get<std::string>() + ".json");
  std::error_code failed;
  fs::create_directories(path.parent_path(), failed);
  if (failed) throw IoError(path.parent_path().string() + ": cannot make the folder: " + failed.message());
  write_file_atomically(path, row.dump(1) + "\n");
}

Json make_row(const Measured& m) {
  const Machine on = machine();
  const std::chrono::year_month_day day(
      std::chrono::floor<std::chrono::days>(std::chrono::system_clock::now()));
  char date[16];
  std::snprintf(date, sizeof date, "%04d-%02u-%02u", static_cast<int>(day.year()),
                static_cast<unsigned>(day.month()), static_cast<unsigned>(day.day()));
  return {{"schema", kSchema},     {"id", m.id},
          {"kind", m.kind},        {"command", m.command},
          {"commit", on.commit},   {"date", date},
          {"cpu", on.cpu},         {"isa", on.isa},
          {"threads", on.threads}, {"compiler", on.compiler},
          {"seed", m.seed},        {"budget", m.budget > 0 ? Json(m.budget) : Json(nullptr)},
          {"seconds", m.seconds},  {"inputs", m.inputs},
          {"output", m.output},    {"code", m.code},
          {"result", m.result}};
}

fs::path path_of(const Plan& plan, const std::string& word, const Places& places) {
  if (word.starts_with('@')) return places.work / word.substr(1);
  const std::string folder = plan.scene(word.substr(6));
  return places.data.empty() || folder.empty() ? fs::path() : places.data / folder;
}

Json with_names(Json result, const Places& places) {
  if (result.is_structured()) {
    for (Json& part : result) part = with_names(std::move(part), places);
    return result;
  }
  if (!result.is_string()) return result;
  const std::string text = result.get<std::string>();
  for (const auto& [folder, name] : {std::pair{places.work, "@"}, std::pair{places.data, "data/"}}) {
    const std::string below = folder.generic_string() + "/";
    if (!folder.empty() && text.starts_with(below)) return name + text.substr(below.size());
  }
  return result;
}

Json hash_of(const fs::path& path) {
  if (path.empty() || !fs::exists(path)) return nullptr;
  if (!fs::is_directory(path)) return sha256_file_hex(path);
  Words lines;
  for (const auto& entry : fs::recursive_directory_iterator(path))
    if (entry.is_regular_file())
      lines.push_back(entry.path().lexically_relative(path).generic_string() + " " +
                      sha256_file_hex(entry.path()));
  std::ranges::sort(lines);
  std::string all;
  for (const std::string& line : lines) all += line + "\n";
  return sha256_hex(all);
}

Json input_hashes(const Plan& plan, const PlannedRow& row, const Rows& rows, const Places& places) {
  static std::map<fs::path, Json> data_sets;  // hundreds of megabytes: hashed once
  Json hashes = Json::object();
  for (const std::string& word : row.inputs()) {
    if (word.starts_with('@')) {
      const auto made = rows.find(plan.producer(word)->id);
      hashes[word] = made == rows.end() ? Json(nullptr) : made->second.value("output", Json(nullptr));
    } else {
      const fs::path path = path_of(plan, word, places);
      if (!data_sets.contains(path)) data_sets[path] = hash_of(path);
      hashes[word] = data_sets[path];
    }
  }
  return hashes;
}

std::string stale_reason(const Plan& plan, const PlannedRow& planned, const Rows& rows,
                         const Places& places) {
  const auto found = rows.find(planned.id);
  if (found == rows.end()) return "not measured";
  const Json& row = found->second;
  if (row["schema"] != kSchema) return "another schema";
  if (row["inputs"].is_null()) return "measured by version 0.1";
  if (row["commit"].get<std::string>().ends_with("changes")) return "measured from changed sources";
  if (row["command"] != planned.command) return "command changed";
  if (row["code"] != plan.code(planned)) return "code changed";
  const Json now = input_hashes(plan, planned, rows, places);
  for (const auto& [word, hash] : now.items())
    if (word.starts_with('@') ? row["inputs"].value(word, Json()) != hash
                              : !hash.is_null() && row["inputs"].value(word, Json()) != hash)
      return "input changed: " + word.substr(word.starts_with('@') ? 1 : 0);  // @ is a command to Doxygen
  return "";
}

}  // namespace fieldmark::results
