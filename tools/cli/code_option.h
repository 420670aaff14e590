#pragma once
#include <fieldmark/watermark/mark/owner.h>

#include <string>

#include "cli/command_line.h"
#include "cli/context.h"
#include "cli/message_option.h"

namespace fieldmark::cli {

/// The code of the cells, if it differs from the owner's own.
struct CodeOption {
  std::string key, copy;
  Index bits = 0;  ///< 0: length of the message, or of the owner
};

/// Adds --key.
void add_key_option(CommandLine& app, std::string& key);
/// Adds --key and --bits.
void add_code_options(CommandLine& app, CodeOption& options);
/// Adds --copy. @param purpose  begins the help text: "Recipient ..."
void add_copy_option(CommandLine& app, CodeOption& options, const std::string& purpose);

/// Gives an owner the requested key, copy and message length, see Owner::set_code(). Without --bits, the
/// length is four bits per digit of --message if these do not fit the owner's usual length, and a note says
/// so. Also calls note_unproven_bound().
/// @return the key that signs and commits: that of --key or of the owner, never that of a copy
/// @throws UsageError if the owner's cells cannot hold the message, or no key is given and the owner has none
watermark::Key choose_code(const CodeOption& options, const MessageOption& message, watermark::Owner& owner,
                           Context& context);

/// Reads an owner file and gives the owner the key of a file, unless that is empty. Also calls
/// note_unproven_bound().
/// @throws UsageError if the owner then has no key
watermark::Owner keyed_owner(const std::string& path, const std::string& key, Context& context);

/// @throws UsageError if the owner's mark has no cells, so that its copies have no codes of their own
void check_copies(const watermark::Owner& owner);

}  // namespace fieldmark::cli
