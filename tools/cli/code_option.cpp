#include "cli/code_option.h"

#include <fieldmark/watermark/tracing/copies.h>

#include "cli/cli.h"
#include "cli/owner_note.h"

namespace fieldmark::cli {
namespace {

constexpr Index kDigitBits = 4;
constexpr Index kMostBits = 4096;  // cells hold fewer; the owner determines how many

Index message_bits(const CodeOption& options, const std::string& hex, const watermark::Owner& owner,
                   Context& context) {
  const Index usual = owner.options().bits, digits = std::ssize(hex);
  if (options.bits > 0) return options.bits;
  const bool fits = hex.empty() || digits == (usual + kDigitBits - 1) / kDigitBits;
  if (fits || !owner.mark().has_cells()) return usual;
  context.note("--message has " + std::to_string(digits * kDigitBits) + " bits, the owner was embedded for " +
               std::to_string(usual));
  return digits * kDigitBits;
}

watermark::Key chosen_key(const std::string& file, const watermark::Owner& owner) {
  if (file.empty() && !owner.key)
    throw UsageError("--key: OWNER holds no key (embed --no-key); give one, for reading that of `bake`");
  return file.empty() ? owner.own_key() : watermark::load_key(file);
}

}  // namespace

void add_key_option(CommandLine& app, std::string& key) {
  app.add_option("--key", key, "Key from `fieldmark key`; default: that of OWNER")->type_name("KEY");
}

void add_code_options(CommandLine& app, CodeOption& o) {
  add_key_option(app, o.key);
  app.add_option(
         "--bits", o.bits,
         "Length of the message in bits, 1 to the number of cells, for presets paper and code as embedded;\n"
         "default: the length embedded, or four bits per digit of --message if that is given and differs")
      ->range(Index{1}, kMostBits)
      ->type_name("N")
      ->default_str("");
}

void add_copy_option(CommandLine& app, CodeOption& o, const std::string& purpose) {
  app.add_option("--copy", o.copy, purpose + ", any text; default: no recipient")->type_name("NAME");
}

watermark::Key choose_code(const CodeOption& options, const MessageOption& message, watermark::Owner& owner,
                           Context& context) {
  if (!options.copy.empty()) check_copies(owner);
  const watermark::Key key = chosen_key(options.key, owner);
  const Index bits = message_bits(options, message.message, owner, context);
  read_option(options.bits > 0 ? "--bits" : "--message", [&] {
    owner.set_code(options.copy.empty() ? key : watermark::copy_key(key, options.copy), bits);
  });
  note_unproven_bound(owner, context);
  return key;
}

watermark::Owner keyed_owner(const std::string& path, const std::string& key, Context& context) {
  auto owner = watermark::Owner::load(path);
  owner.set_code(chosen_key(key, owner), owner.options().bits);
  note_unproven_bound(owner, context);
  return owner;
}

void check_copies(const watermark::Owner& owner) {
  if (!owner.mark().has_cells())
    throw UsageError("--owner: an owner of preset " + owner.mark().preset() +
                     " has no cells, so its copies have no codes of their own");
}

}  // namespace fieldmark::cli
