#include "cli/message_option.h"

#include <CLI/CLI.hpp>
#include "cli/cli.h"
#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("message options: each kind is encoded, and told again", "[message_option]") {
  const auto text = cli::message_of({.message = "", .text = "hello", .uuid = "", .payload = ""}, 100);
  CHECK(text.size() == 100);
  CHECK(cli::payload_json(text) == cli::Json{{"kind", "text"}, {"value", "hello"}});
  const auto hex = cli::message_of({.message = "", .text = "", .uuid = "", .payload = "C0ffee"}, 64);
  CHECK(cli::payload_json(hex) == cli::Json{{"kind", "hex"}, {"value", "c0ffee"}});
  const std::string uuid = "01234567-89ab-cdef-0123-456789abcdef";
  CHECK(cli::payload_json(
            cli::message_of({.message = "", .text = "", .uuid = uuid, .payload = ""}, 147))["value"] == uuid);
  CHECK_THROWS_AS(cli::message_of({.message = "", .text = "", .uuid = uuid, .payload = ""}, 146),
                  cli::UsageError);  // as the help text says
  const auto plain = cli::message_of({.message = "a5c3", .text = "", .uuid = "", .payload = ""}, 16);
  CHECK(to_hex(plain) == "a5c3");
  CHECK(cli::payload_json(plain).is_null());
}

TEST_CASE("message options: what does not fit is a usage error that names the option", "[message_option]") {
  const cli::MessageOption none, text{.message = "", .text = "hello", .uuid = "", .payload = ""},
      uuid{.message = "", .text = "", .uuid = "12", .payload = ""},
      hex{.message = "", .text = "", .uuid = "", .payload = "xy"};
  CHECK_FALSE(none.given());
  CHECK(text.given());
  CHECK_THROWS_WITH(cli::message_of(none, 100), "one of --message, --text, --uuid and --payload is needed");
  CHECK_THROWS_WITH(cli::message_of(text, 48),
                    Contains("--text: payload: has 40 bits, a message of 48 bits can hold at most 32; it "
                             "needs a message of "));
  CHECK_THROWS_AS(cli::message_of(uuid, 256), cli::UsageError);
  CHECK_THROWS_AS(cli::message_of(hex, 100), cli::UsageError);
  for (const char* pair :
       {"--text a --uuid b", "--text a --payload b", "--message a --text b", "--uuid a --payload b"}) {
    CLI::App app;
    cli::CommandLine line(app);
    cli::MessageOption options;
    cli::add_message_options(line, options, "Message");
    CHECK_THROWS_AS(app.parse(pair), CLI::ExcludesError);
  }
}

TEST_CASE("message options: readings are told in words and as JSON", "[message_option]") {
  std::vector<double> logits;
  for (auto bit : cli::message_of({.message = "", .text = "hello", .uuid = "", .payload = ""}, 100).bits)
    logits.push_back(bit ? 2.0 : -2.0);
  logits[50] *= -1;
  const auto read = cli::read_payload(logits);
  const auto json = cli::payload_json(read);
  CHECK(json["kind"] == "text");
  CHECK(json["value"] == "hello");
  CHECK(json["corrected"] == 1);
  CHECK(json["chance"].get<double>() < 1e-12);
  CHECK_THAT(cli::payload_text(read, 100), Contains("text hello, 1 of 100 bits corrected"));
  const auto nothing = cli::read_payload(std::vector<double>(100, 0.0));
  CHECK(cli::payload_json(nothing).is_null());
  CHECK_THAT(cli::payload_text(nothing, 100), Contains("none (random bits"));
  CHECK_THAT(cli::payload_text(nothing, 8), Contains("holds no payload"));
}
