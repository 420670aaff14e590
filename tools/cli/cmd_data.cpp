#include <fieldmark/core/error.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <ostream>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/data_check.h"
#include "cli/fetch.h"
#include "cli/manifest.h"
#include "cli/suggest.h"

namespace fieldmark::cli {
namespace {

struct DataArguments {
  std::string name, folder, base_url;
};

std::vector<Manifest> manifests() {
  std::vector<Manifest> all;
  for (const auto text : embedded_manifests()) all.push_back(parse_manifest(text, "data_manifests"));
  return all;
}

int list(Context& context) {
  Json sets = Json::array();
  for (const auto& m : manifests()) {
    char size[64];
    std::snprintf(size, sizeof size, "%4zu files %7.1f MB", m.files.size(),
                  static_cast<double>(m.bytes()) / 1e6);
    context.text() << m.name << "\n    " << m.title << "\n   " << size << "   licence: " << m.licence
                   << "\n    " << m.url << "\n";
    sets.push_back({{"name", m.name},
                    {"kind", m.kind},
                    {"title", m.title},
                    {"files", m.files.size()},
                    {"bytes", m.bytes()},
                    {"licence", m.licence},
                    {"source", m.citation},
                    {"url", m.url}});
  }
  context.result({{"data_sets", sets}});
  return kOk;
}

Manifest find(const std::string& name) {
  std::vector<std::string> names;
  for (auto& m : manifests()) {
    if (m.name == name) return m;
    names.push_back(m.name);
  }
  const std::string near = nearest_word(name, names);
  throw UsageError("no data set is called '" + name + "'" +
                   (near.empty() ? "" : "; did you mean " + near + "?") + " (fieldmark data list names all)");
}

int verify(const DataArguments& options, Context& context) {
  const Manifest m = find(options.name);
  if (!std::filesystem::is_directory(options.folder)) throw IoError(options.folder + ": expected a folder");
  const InterruptGuard guard;
  std::vector<ManifestFault> faults;
  {
    Progress progress = context.progress("verify " + m.name);
    faults = verify_manifest(m, options.folder, [&](double fraction) {
      progress.update(fraction);
      return !guard.interrupted();
    });
  }
  if (guard.interrupted()) throw Interrupted("nothing was decided");
  Json list = Json::array();
  for (const auto& fault : faults) {
    context.text() << options.folder << "/" << fault.path << ": " << fault.what << "\n";
    list.push_back({{"file", fault.path}, {"what", fault.what}});
  }
  context.text() << m.name << ": " << m.files.size() - faults.size() << " of " << m.files.size()
                 << " files are right\n";
  context.result({{"name", m.name}, {"ok", faults.empty()}, {"files", m.files.size()}, {"faults", list}});
  return faults.empty() ? kOk : kFailed;
}

int fetch(const DataArguments& options, Context& context) {
  Manifest m = find(options.name);
  if (!options.base_url.empty()) m.base_url = options.base_url;
  const InterruptGuard guard;
  Fetched fetched;
  {
    Progress progress = context.progress("fetch " + m.name);
    const double all = static_cast<double>(std::max<std::uintmax_t>(m.bytes(), 1));
    fetched = fetch_manifest(m, options.folder, [&](std::uintmax_t bytes) {
      progress.update(static_cast<double>(bytes) / all);
      return !guard.interrupted();
    });
  }
  if (!fetched.complete) throw Interrupted("the same command resumes the download");
  context.text() << m.name << ": " << fetched.fetched << " files fetched, " << fetched.present
                 << " were present; all are right\n";
  context.result({{"name", m.name},
                  {"ok", true},
                  {"files", m.files.size()},
                  {"fetched", fetched.fetched},
                  {"present", fetched.present}});
  return kOk;
}

void add_name_and_folder(CommandLine& app, DataArguments& options, const char* folder) {
  app.add_option("name", options.name, "Data set to use, a name of `fieldmark data list`")
      ->required()
      ->type_name("NAME");
  app.add_option("dir", options.folder, folder)->required()->type_name("DIR");
}

}  // namespace

Command add_data(CommandLine& app) {
  auto options = std::make_shared<DataArguments>();
  CommandLine lists = app.add_subcommand("list", "List every data set with size, licence and source");
  CommandLine verifies =
      app.add_subcommand("verify", "Compare size and SHA-256 of each file with the manifest");
  add_name_and_folder(verifies, *options, "Folder to check");
  CommandLine fetches = app.add_subcommand("fetch", "Download missing and damaged files, and check them");
  add_name_and_folder(fetches, *options, "Folder to download to");
  fetches
      .add_option("--base-url", options->base_url,
                  "Address of a folder with the files, http or https; needed if the manifest has none")
      ->check([](const std::string& url) {
        return url.starts_with("http://") || url.starts_with("https://")
                   ? std::string()
                   : "expected http:// or https://, got " + url;
      })
      ->type_name("URL");
  auto examined = std::make_shared<DataCheckArguments>();
  CommandLine checks =
      app.add_subcommand("check", "Print the contents of a data set, and warnings with remedies");
  add_data_check(checks, *examined);
  return [options, examined, lists, fetches, checks](Context& context) {
    if (lists.parsed()) return list(context);
    if (checks.parsed()) return run_data_check(*examined, context);
    return fetches.parsed() ? fetch(*options, context) : verify(*options, context);
  };
}

}  // namespace fieldmark::cli
