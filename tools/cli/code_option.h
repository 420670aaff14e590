#pragma once
#include <fieldmark/watermark/mark/owner.h>

#include <string>

#include "cli/command_line.h"
#include "cli/context.h"
#include "cli/message_option.h"

namespace fieldmark::cli {

/// Which code the cells have, where it is not the owner's own.
struct CodeOption {
  std::string key, copy;
  Index bits = 0;  ///< 0: as the message or the owner says
};

/// Adds --key and --bits.
void add_code_options(CommandLine& app, CodeOption& options);
/// Adds --copy. @param purpose  what is done with the copy: "Recipient ..."
void add_copy_option(CommandLine& app, CodeOption& options, const std::string& purpose);

/// Gives an owner the key, the copy and the length of the message that are asked for, see Owner::set_code().
/// Without --bits the length is four bits a digit of --message where these do not fit the owner's usual
/// length, and that is said. Notes an owner whose networks know its key.
/// @return the key that signs and commits: that of --key or of the owner, never that of a copy
/// @throws UsageError if the owner's cells cannot hold the message
watermark::Key choose_code(const CodeOption& options, const MessageOption& message, watermark::Owner& owner,
                           Context& context);

}  // namespace fieldmark::cli
