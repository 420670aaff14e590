#include "cli/code_option.h"

#include <fieldmark/core/files.h>
#include <fieldmark/watermark/tracing/copies.h>

#include <sstream>

#include "cli/cli.h"
#include "support/catch.h"
#include "support/source_dir.h"
#include "support/temporary_folder.h"
#include "watermark/small_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {

struct Chosen {
  Key key;
  std::string notes;
};

Chosen choose(const cli::CodeOption& options, const std::string& hex, Owner& owner) {
  std::ostringstream out, err;
  cli::Context context({}, {}, out, err);
  const Key key =
      cli::choose_code(options, {.message = hex, .text = "", .uuid = "", .payload = ""}, owner, context);
  return {key, out.str() + err.str()};
}

}  // namespace

TEST_CASE("code_option: without options the owner keeps its key and its length") {
  Owner owner = small_owner();
  const Chosen chosen = choose({}, "a", owner);  // three bits are one digit
  CHECK(chosen.key == test_key(1));
  CHECK(chosen.notes.empty());
  CHECK(owner.key == test_key(1));
  CHECK(owner.options().bits == 3);
}

TEST_CASE("code_option: a message of other digits sets the length, and says so, --bits has the last word") {
  Owner owner = small_owner();
  CHECK_THAT(choose({}, "a5", owner).notes, Contains("--message has 8 bits, the owner was embedded for 3"));
  CHECK(owner.options().bits == 8);
  owner = small_owner();
  CHECK(choose({.key = "", .copy = "", .bits = 6}, "a5", owner).notes.empty());
  CHECK(owner.options().bits == 6);
  CHECK_THROWS_WITH(choose({.key = "", .copy = "", .bits = 1000}, "", owner),
                    Contains("--bits: bits must be 1 to"));
  Owner paper = small_paper_owner();
  CHECK(choose({}, "a5", paper).notes.empty());  // message_of() reports what is wrong with it
  CHECK(paper.options().bits == 3);
}

TEST_CASE("code_option: another key deals the cells and signs, a copy's key deals them and never signs") {
  const TemporaryFolder folder;
  save_key(folder / "key", test_key(5));
  Owner owner = small_owner();
  CHECK(choose({.key = folder / "key", .copy = "", .bits = 0}, "", owner).key == test_key(5));
  CHECK(owner.key == test_key(5));
  owner = small_owner();
  CHECK(choose({.key = folder / "key", .copy = "Anna", .bits = 0}, "", owner).key == test_key(5));
  CHECK(owner.key == copy_key(test_key(5), "Anna"));
}

TEST_CASE("code_option: an owner without a key needs one") {
  const TemporaryFolder folder;
  save_key(folder / "key", test_key(5));
  Owner owner = small_owner();
  owner.key.reset();
  CHECK_THROWS_AS(choose({}, "", owner), cli::UsageError);
  CHECK_THROWS_WITH(choose({}, "", owner), Contains("--key: OWNER holds no key"));
  CHECK(choose({.key = folder / "key", .copy = "", .bits = 0}, "", owner).key == test_key(5));
  CHECK(owner.key == test_key(5));
  owner.key.reset();
  owner.save(folder / "owner");
  std::ostringstream out, err;
  cli::Context context({}, {}, out, err);
  CHECK_THROWS_AS(cli::keyed_owner(folder / "owner", "", context), cli::UsageError);
  CHECK(cli::keyed_owner(folder / "owner", folder / "key", context).key == test_key(5));
}

TEST_CASE("code_option: an owner of version 0.1 comes with a line on its bound") {
  Owner owner = Owner::load(std::filesystem::path(source_dir()) / "tests/regression/version_0_1/owner.fm");
  CHECK_THAT(choose({}, "", owner).notes, Contains("trained under its own key") && Contains("not proven"));
}

TEST_CASE("code_option: copies need a mark with cells") {
  CHECK_NOTHROW(cli::check_copies(small_owner()));
  CHECK_THROWS_WITH(
      cli::check_copies(small_paper_owner()),
      "--owner: an owner of preset paper has no cells, so its copies have no codes of their own");
  Owner paper = small_paper_owner();
  CHECK_THROWS_WITH(choose({.key = "", .copy = "Anna", .bits = 0}, "", paper), Contains("has no cells"));
}
