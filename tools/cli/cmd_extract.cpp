#include <CLI/CLI.hpp>
#include <memory>
#include <ostream>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/reading.h"

namespace fieldmark::cli {
namespace {

namespace wm = watermark;

struct Options {
  std::string owner;
  std::vector<std::string> pictures;
};

int run(const Options& options, Context& context) {
  const auto owner = wm::Owner::load(options.owner);
  const auto readings = read_pictures(owner, options.pictures, context);
  const auto code = owner.code();
  Json views = Json::array();
  for (std::size_t i = 0; i < readings.each.size(); ++i) {
    const auto bits = wm::read_bits(readings.each[i], code, owner.options().bits);
    const std::string name = readings.pictures[i].string();
    context.text() << wm::to_bits(bits.message) << "  " << name << "\n";
    views.push_back({{"image", name}, {"bits", wm::to_bits(bits.message)}, {"logits", bits.logit}});
  }
  const auto all = wm::read_bits(readings.sum, code, owner.options().bits);
  context.text() << wm::to_bits(all.message) << "  all " << readings.each.size() << " together: message "
                 << wm::to_hex(all.message) << "\n";
  context.result({{"message", wm::to_hex(all.message)},
                  {"bits", wm::to_bits(all.message)},
                  {"logits", all.logit},
                  {"reading", "blind"},
                  {"views", views}});
  return kOk;
}

}  // namespace

Command add_extract(CLI::App& app) {
  auto o = std::make_shared<Options>();
  app.add_option("--owner", o->owner, "The owner's secret file")->required()->type_name("OWNER");
  app.add_option("pictures", o->pictures, "Pictures, or folders of them")->required()->type_name("IMAGE|DIR");
  return [o](Context& context) { return run(*o, context); };
}

}  // namespace fieldmark::cli
