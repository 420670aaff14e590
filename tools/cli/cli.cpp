#include "cli/cli.h"

#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/image_format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <new>
#include <ostream>
#include <utility>

#include "cli/commands.h"
#include "cli/context.h"
#include "cli/outputs.h"
#include "cli/suggest.h"
#include "cli/wrapped_help.h"

namespace fieldmark::cli {

Command add_results(CommandLine& app);  // cmd_results.cpp

namespace {

struct Entry {
  const char* name;
  const char* help;
  Command (*add)(CommandLine&);
};
constexpr Entry kCommands[] = {
    {"scene", "Make a data set of a built-in scene", add_scene},
    {"data", "Check a data set; list, verify and fetch public ones", add_data},
    {"train", "Train a field on images", add_train},
    {"eval", "Compare a field with the ground truth", add_eval},
    {"compare", "Compare images: PSNR, SSIM, LPIPS", add_compare},
    {"render", "Render views of a field", add_render},
    {"export", "Export a field as a page, a point cloud or a mesh", add_export},
    {"key", "Make a secret key", add_key},
    {"embed", "Train a mark for a field and its extractor", add_embed},
    {"bake", "Write a field with a message, to publish", add_bake},
    {"measure", "Measure bit accuracy and quality of a mark", add_measure},
    {"extract", "Read the message from images", add_extract},
    {"verify", "Decide whether images show a message, with p-values", add_verify},
    {"trace", "Find whose copy images come from", add_trace},
    {"null", "Test the key on unmarked images, and compare counts of p-values with their bounds", add_null},
    {"check", "Check evidence of verify for alterations", add_check},
    {"distort", "Distort images: noise, rotation, JPEG and more", add_distort},
    {"attack-field", "Attack the mark of a field", add_attack_field},
    {"bench", "Benchmark the engine, training, marks and attacks", add_bench},
    {"reproduce", "Train and measure the systems of the paper's tables", add_reproduce},
    {"results", "List, measure and render the results of docs/results", add_results},
    {"gradcheck", "Check every hand-derived gradient against finite differences", add_gradcheck},
    {"info", "Print the contents of a field, owner, key or other safetensors file", add_info},
};

// Placeholders of values that are files or folders.
constexpr const char* kPathTypes[] = {"FILE", "DIR", "FIELD", "OWNER", "KEY", "IMAGE"};

struct Subcommand {
  CLI::App* app;
  Command command;
};

bool is_inside(const std::filesystem::path& file, const std::filesystem::path& folder) {
  std::error_code ignored;
  const auto inner = std::filesystem::weakly_canonical(file, ignored),
             outer = std::filesystem::weakly_canonical(folder, ignored);
  return std::ranges::mismatch(outer, inner).in1 == outer.end();
}

struct ResultFile {
  const char* option;
  std::string file;
};

std::vector<ResultFile> result_files(const CommonOptions& common) {
  std::vector<ResultFile> all{{"--json", common.json}, {"--report", common.report}};
  std::erase_if(all, [](const ResultFile& r) { return r.file.empty() || r.file == "-"; });
  return all;
}

// A result file must be no value of another option, and no file of a folder that the command reads.
void check_against_value(const ResultFile& result, const std::string& option, const std::string& value) {
  std::error_code none;
  const std::string begin = std::string(result.option) + ": " + result.file;
  if (same_file(result.file, value))
    throw UsageError(begin + " is the value of " + option + " too; name another file");
  if (option != "--out" && std::filesystem::is_directory(value, none) &&
      std::filesystem::exists(result.file, none) && is_inside(result.file, value))
    throw UsageError(begin + " is a file of " + value + ", which " + option + " reads; name another file");
}

void check_against_options(const CLI::App& app, const ResultFile& result) {
  for (const CLI::Option* option : app.get_options()) {
    const bool path = std::ranges::any_of(kPathTypes, [&](const char* type) {
      return option->get_type_name().find(type) != std::string::npos;
    });
    const std::string name = option->get_name();
    if (!path || name == "--json" || name == "--report") continue;
    for (const std::string& value : option->results()) check_against_value(result, name, value);
  }
  for (const CLI::App* nested : app.get_subcommands()) check_against_options(*nested, result);
}

void check_result_files(const CLI::App& app, const CommonOptions& common) {
  for (const ResultFile& result : result_files(common)) {
    check_against_options(app, result);
    if (has_image_extension(result.file))
      throw UsageError(std::string(result.option) + ": " + result.file +
                       " has the name of an image; name another file");
  }
}

class Program {
 public:
  Program(std::ostream& out, std::ostream& err) : out_(out), err_(err) {
    app_.name("fieldmark");
    app_.require_subcommand(1);
    app_.set_version_flag("--version", FIELDMARK_VERSION);
    app_.formatter(std::make_shared<WrappedHelp>());
    for (const auto& entry : kCommands) {
      CLI::App* sub = app_.add_subcommand(entry.name, entry.help);
      sub->option_defaults()->always_capture_default();
      CommandLine options(*sub);
      Command command = entry.add(options);
      add_common(options, common_);
      subcommands_.push_back({sub, std::move(command)});
    }
  }

  int run(const std::vector<std::string>& line) {
    if (const std::string text = unknown_word(line); !text.empty()) return usage(text);
    try {
      std::vector<std::string> reversed(line.rbegin(), line.rend() - (line.empty() ? 0 : 1));
      app_.parse(std::move(reversed));
    } catch (const CLI::Success& e) {
      app_.exit(e, out_, err_);
      return kOk;
    } catch (const CLI::ParseError& e) {
      return usage(e.what());
    }
    if (common_.threads > 0) set_threads(common_.threads);
    for (auto& [sub, command] : subcommands_) {
      if (!sub->parsed()) continue;
      check_result_files(*sub, common_);
      Context context(common_, line, out_, err_);
      const int code = command(context);
      return context.left_out() ? kFailed : code;
    }
    return kUsage;
  }

  int usage(const std::string& what) {
    std::string name = called_;
    for (const auto& [sub, command] : subcommands_) {
      if (!sub->parsed()) continue;
      name = " " + sub->get_name();
      for (const CLI::App* nested : sub->get_subcommands()) name += " " + nested->get_name();
    }
    err_ << "fieldmark:" << (name.empty() ? "" : name + ":") << " " << what << " (see fieldmark" << name
         << " --help)\n";
    return kUsage;
  }

 private:
  // Describes an unknown command or option and suggests the nearest known one.
  std::string unknown_word(const std::vector<std::string>& line) {
    if (line.size() < 2 || line[1].starts_with("-")) return "";
    std::vector<std::string> names;
    const CLI::App* sub = nullptr;
    for (const auto& known : subcommands_) {
      names.push_back(known.app->get_name());
      if (names.back() == line[1]) sub = known.app;
    }
    if (sub) called_ = " " + line[1];
    if (!sub) return "no command is called '" + line[1] + "'" + did_you_mean(line[1], names);
    std::vector<const CLI::App*> apps = sub->get_subcommands(nullptr);  // `data fetch` has options of its own
    names.clear();
    for (const CLI::App* nested : apps) names.push_back(nested->get_name());
    if (line.size() > 2 && !line[2].starts_with("-") && !names.empty() && !std::ranges::count(names, line[2]))
      return "no command is called '" + line[2] + "'" + did_you_mean(line[2], names);
    names.clear();
    const auto nested = std::ranges::find_if(
        apps, [&](const CLI::App* app) { return line.size() > 2 && app->get_name() == line[2]; });
    if (nested != apps.end()) {
      called_ += " " + line[2];
      apps = {*nested};
    }
    apps.push_back(sub);
    for (const CLI::App* app : apps)
      for (const CLI::Option* option : app->get_options())
        for (const auto& name : option->get_lnames()) names.push_back("--" + name);
    for (std::size_t i = 2; i < line.size() && line[i] != "--"; ++i) {
      const std::string word = line[i].substr(0, line[i].find('='));
      // CLI11 would take the next word as the value.
      if (word.starts_with("--") && line[i].size() == word.size() + 1)
        return word + ": expected a value behind =, got an empty one";
      if (!word.starts_with("--") || std::find(names.begin(), names.end(), word) != names.end()) continue;
      return "no option is called " + word + did_you_mean(word, names);
    }
    return "";
  }

  static std::string did_you_mean(const std::string& word, const std::vector<std::string>& names) {
    const std::string near = nearest_word(word, names);
    return near.empty() ? "" : "; did you mean " + near + "?";
  }

  std::ostream &out_, &err_;
  std::string called_;  // " NAME" of a known command
  CommonOptions common_;
  CLI::App app_{
      "Watermarks radiance fields, so that owners can prove from any rendered image that a field is theirs."};
  std::vector<Subcommand> subcommands_;
};

int run_guarded(const std::vector<std::string>& line, std::ostream& out, std::ostream& err) {
  Program program(out, err);
  const auto failed = [&](const std::string& what) {
    err << "fieldmark: " << what << "\n";
    return kFailed;
  };
  try {
    const int code = program.run(line);
    if (!out.flush()) return failed("standard output: cannot be written");
    return code;
  } catch (const UsageError& e) {
    return program.usage(e.what());
  } catch (const Interrupted& e) {
    err << "fieldmark: interrupted" << (*e.what() ? std::string(": ") + e.what() : "") << "\n";
    return kInterrupted;
  } catch (const std::bad_alloc&) {
    return failed("not enough memory");
  } catch (const std::exception& e) {
    return failed(e.what());
  }
}

}  // namespace

std::string without_function(const std::string& what) {
  const std::size_t end = what.find("] ");
  return what.starts_with("[") && end != std::string::npos ? what.substr(end + 2) : what;
}

int run(int argc, const char* const* argv, std::ostream& out, std::ostream& err) noexcept try {
  return run_guarded({argv, argv + argc}, out, err);
} catch (...) {
  return kFailed;
}

}  // namespace fieldmark::cli
