#include "cli/outputs.h"
#include "cli/images.h"

#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/engine/model_file.h>
#include <fieldmark/imaging/image_format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <optional>

namespace fieldmark::cli {
namespace {

namespace fs = std::filesystem;

struct Model {
  std::string kind;
  bool secret = false;
};

// Returns true if a file begins as safetensors do: the length of the header in 8 bytes, then the header.
bool looks_like_model(std::istream& in) {
  char begin[10] = {};
  in.read(begin, sizeof begin);
  return in.gcount() == sizeof begin && begin[7] == 0 && begin[8] == '{' && begin[9] == '"';
}

// Returns the kind of the Fieldmark file at a path, or nullopt. A file that cannot be read, is damaged or
// comes from a later version may be the only copy of a key.
std::optional<Model> model_at(const std::string& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return std::nullopt;
  std::ifstream in(path, std::ios::binary);
  if (!in) return Model{"content, which cannot be read,", true};
  if (!looks_like_model(in)) return std::nullopt;
  try {
    const auto file = SafetensorsFile::read(path);
    if (!file.metadata.contains("fieldmark")) return std::nullopt;
    const std::string kind = model_info(file).kind;
    // Whoever replaces a checkpoint loses the work of an interrupted run, and maybe the only copy of a key.
    return Model{kind, kind == "owner" || kind == "checkpoint" || file.has("key")};
  } catch (const Error&) {
    return Model{"damaged or later model", true};
  }
}

std::string upper(std::string text) {
  std::ranges::transform(text, text.begin(),
                         [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

void refuse(const std::string& path, const Model& model) {
  throw IoError(path + ": exists already, and its " +
                (model.kind.find(' ') != std::string::npos ? model.kind : upper(model.kind)) +
                " would be lost; name another file, or move this one away");
}

}  // namespace

bool same_file(const fs::path& a, const fs::path& b) {
  std::error_code ignored;
  return !a.empty() && !b.empty() && fs::weakly_canonical(a, ignored) == fs::weakly_canonical(b, ignored);
}

void check_place(const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  std::error_code none;
  if (!folder.empty() && fs::status(folder, none).type() == fs::file_type::not_found)
    throw IoError(path + ": its folder " + folder.string() +
                  " does not exist; create it, or name another file");
  AtomicFile{path};
}

void check_writable(const std::string& path) {
  if (has_image_extension(path)) throw IoError(path + ": has the name of an image; name another file");
  check_place(path);
  if (const auto model = model_at(path); model && model->secret) refuse(path, *model);
}

void check_new_checkpoint(const std::string& path) {
  check_place(path);
  if (fs::exists(path))
    throw IoError(path +
                  ": exists already, and the work of an interrupted run would be lost; continue it with "
                  "--resume, or move the file away");
}

void check_writable_page(const std::string& path) {
  check_place(path);
  if (const auto model = model_at(path)) refuse(path, *model);
}

std::vector<fs::path> images_of_other_runs(const std::string& folder, bool overwrite,
                                           const std::string& replaced) {
  std::error_code none;
  if (!fs::is_directory(folder, none)) return {};
  auto images = images_in(folder);
  if (!images.empty() && !overwrite)
    throw IoError(folder + ": expected a folder without images, found " + std::to_string(images.size()) +
                  "; name another folder, or --overwrite to replace " + replaced);
  return images;
}

void prepare_folder(const std::string& path) {
  std::error_code error;
  if (fs::exists(path, error) && !fs::is_directory(path, error))
    throw IoError(path + ": expected a folder to write to, found a file; name another folder");
  fs::create_directories(path, error);
  if (error) throw IoError(path + ": the folder cannot be made: " + error.message());
  AtomicFile{fs::path(path) / "fieldmark"};
}

}  // namespace fieldmark::cli
