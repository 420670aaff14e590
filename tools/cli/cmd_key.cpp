#include <fieldmark/core/digest.h>
#include <fieldmark/watermark/keys/signing.h>

#include <filesystem>
#include <memory>
#include <ostream>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/outputs.h"

namespace fieldmark::cli {
namespace {

struct KeyArguments {
  std::string out;
  bool force = false;
};

int run_key(const KeyArguments& options, Context& context) {
  // A lost key is a lost proof: replaces a key only with --force.
  if (std::filesystem::exists(options.out) && !options.force)
    throw IoError(options.out +
                  ": exists already; --force replaces it, and proofs with the old key are lost");
  check_place(options.out);
  if (std::filesystem::exists(options.out)) watermark::load_key(options.out);  // throws unless it is a key
  const auto key = watermark::random_key();
  watermark::save_key(options.out, key);
  const std::string open = to_hex(watermark::public_key(key));
  const std::string sha256 = sha256_file_hex(options.out);
  context.text() << options.out << ": 256 bits from the operating system, keep them secret\nsha256 " << sha256
                 << "\npublic key " << open << ", verifies signatures made with this key\n";
  context.result({{"file", options.out}, {"bits", 256}, {"sha256", sha256}, {"public_key", open}});
  return kOk;
}

}  // namespace

Command add_key(CommandLine& app) {
  auto options = std::make_shared<KeyArguments>();
  app.add_option("--out", options->out, "Key file to write")->required()->type_name("KEY");
  app.add_flag("--force", options->force, "Replace an existing key, and no other file");
  return [options](Context& context) { return run_key(*options, context); };
}

}  // namespace fieldmark::cli
